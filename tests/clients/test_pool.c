/* The pool: every part exactly once, whatever its width, round after round. */
#include "tests/harness/test.h"

#include <pthread.h>
#include <signal.h>
#include <stdlib.h>
#include <string.h>

#include "clients/cli/pool.h"
#include "engine/import.h"

#define PARTS_MAX 5000

struct counting {
    struct pool_work work;
    _Atomic uint32_t runs[PARTS_MAX];
    _Atomic uint32_t at_once, most_at_once;
    uint32_t meet; /* parts wait until this many run at once; 0: never */
};

static void count_part(struct pool_work *self, uint32_t part)
{
    struct counting *counting = (struct counting *)self;
    uint32_t now = atomic_fetch_add(&counting->at_once, 1) + 1;
    uint32_t most = atomic_load(&counting->most_at_once);
    while (most < now && !atomic_compare_exchange_weak(&counting->most_at_once, &most, now))
        ;
    while (counting->meet && atomic_load(&counting->most_at_once) < counting->meet)
        ;
    if (part < PARTS_MAX)
        atomic_fetch_add(&counting->runs[part], 1);
    atomic_fetch_sub(&counting->at_once, 1);
}

static void check_round(struct pool *pool, struct counting *counting, uint32_t parts)
{
    memset(counting, 0, sizeof *counting);
    counting->work.run = count_part;
    pool_run(pool, &counting->work, parts);
    for (uint32_t i = 0; i < PARTS_MAX; i++)
        if (counting->runs[i] != (i < parts))
            test_fail(__FILE__, __LINE__, "%u parts: part %u ran %u times", parts, i,
                      counting->runs[i]);
    CHECK_EQ(counting->at_once, 0);
    CHECK(counting->most_at_once <= pool_width(pool));
}

TEST(pool_runs_every_part_once_at_any_width)
{
    static const uint32_t widths[] = {1, 2, 3, 4, 8, 33};
    static const uint32_t parts[] = {0, 1, 2, 3, 7, 64, 1000, PARTS_MAX};
    struct counting *counting = malloc(sizeof *counting);
    REQUIRE(counting);
    for (size_t w = 0; w < sizeof widths / sizeof widths[0]; w++) {
        struct pool *pool = NULL;
        struct lp_error err = {0};
        REQUIRE(pool_create(&pool, widths[w], &err) == LP_OK);
        CHECK_EQ(pool_width(pool), widths[w]);
        CHECK_EQ(pool_executor(pool)->width, widths[w]);
        for (size_t p = 0; p < sizeof parts / sizeof parts[0]; p++)
            check_round(pool, counting, parts[p]);
        pool_destroy(&pool);
        CHECK(!pool);
    }
    free(counting);
}

TEST(pool_runs_many_short_rounds)
{
    struct counting *counting = malloc(sizeof *counting);
    struct pool *pool = NULL;
    REQUIRE(counting && pool_create(&pool, 4, NULL) == LP_OK);
    for (uint32_t round = 0; round < 3000; round++) {
        memset(counting, 0, sizeof(struct pool_work) + 16 * sizeof counting->runs[0]);
        counting->work.run = count_part;
        pool_run(pool, &counting->work, round % 9);
        for (uint32_t i = 0; i < 9; i++)
            CHECK_EQ(counting->runs[i], i < round % 9);
    }
    pool_destroy(&pool);
    free(counting);
}

/* Hangs (and fails by the harness's time limit) if the pool is narrower than it says. */
TEST(pool_runs_parts_at_the_same_time)
{
    struct counting *counting = calloc(1, sizeof *counting);
    struct pool *pool = NULL;
    REQUIRE(counting && pool_create(&pool, 3, NULL) == LP_OK);
    counting->work.run = count_part;
    counting->meet = 3;
    pool_run(pool, &counting->work, 3);
    CHECK_EQ(counting->most_at_once, 3);
    pool_destroy(&pool);
    free(counting);
}

struct signals_seen {
    struct pool_work work;
    _Atomic uint32_t parts, open;
    pthread_t caller;
};

static void look_at_signals(struct pool_work *self, uint32_t part)
{
    (void)part;
    struct signals_seen *seen = (struct signals_seen *)self;
    sigset_t mask;
    pthread_sigmask(SIG_SETMASK, NULL, &mask);
    if (!pthread_equal(pthread_self(), seen->caller) && !sigismember(&mask, SIGINT))
        atomic_fetch_add(&seen->open, 1);
    atomic_fetch_add(&seen->parts, 1);
}

TEST(pool_leaves_signals_to_others)
{
    struct signals_seen seen = {.work.run = look_at_signals, .caller = pthread_self()};
    struct pool *pool = NULL;
    REQUIRE(pool_create(&pool, 4, NULL) == LP_OK);
    pool_run(pool, &seen.work, 2000);
    CHECK_EQ(seen.parts, 2000);
    CHECK_EQ(seen.open, 0);
    sigset_t mask;
    pthread_sigmask(SIG_SETMASK, NULL, &mask);
    CHECK(!sigismember(&mask, SIGINT));
    pool_destroy(&pool);
}

TEST(pool_refuses_what_is_too_wide)
{
    struct pool *pool = NULL;
    struct lp_error err = {0};
    CHECK(pool_create(&pool, POOL_WIDTH_MAX + 1, &err) == LP_INVALID);
    CHECK(!pool);
    CHECK_HAS(err.text, "threads");
    REQUIRE(pool_create(&pool, 0, NULL) == LP_OK);
    CHECK(pool_width(pool) >= 1 && pool_width(pool) <= POOL_WIDTH_MAX);
    pool_destroy(&pool);
    pool_destroy(&pool);
    pool_destroy(NULL);
}

TEST(pool_as_executor_builds_the_same_bytes_at_any_width)
{
    void *expected = NULL;
    size_t expected_bytes = 0;
    struct lp_procedural_params params = {.which = LP_PROCEDURAL_SPHERE, .depth = 6};
    REQUIRE(lp_import_procedural(&expected, &expected_bytes, &params, NULL) == LP_OK);
    for (uint32_t width = 1; width <= 8; width *= 2) {
        void *bytes = NULL;
        size_t byte_count = 0;
        struct pool *pool = NULL;
        REQUIRE(pool_create(&pool, width, NULL) == LP_OK);
        params.executor = pool_executor(pool);
        REQUIRE(lp_import_procedural(&bytes, &byte_count, &params, NULL) == LP_OK);
        CHECK_EQ(byte_count, expected_bytes);
        CHECK(byte_count == expected_bytes && memcmp(bytes, expected, byte_count) == 0);
        free(bytes);
        pool_destroy(&pool);
    }
    free(expected);
}
