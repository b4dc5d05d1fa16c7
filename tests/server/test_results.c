/* Result files: kept while referred to, counted, bounded. */
#include "server/results.h"
#include "tests/harness/test.h"

#include <fcntl.h>
#include <pthread.h>
#include <stdio.h>
#include <string.h>
#include <sys/stat.h>
#include <unistd.h>

#define SHA_A "aaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaa"
#define SHA_B "bbbbbbbbbbbbbbbbbbbbbbbbbbbbbbbbbbbbbbbbbbbbbbbbbbbbbbbbbbbbbbbb"

static int folder(void)
{
    REQUIRE(mkdir("results", 0700) == 0 || access("results", F_OK) == 0);
    int fd = open("results", O_RDONLY | O_DIRECTORY);
    REQUIRE(fd >= 0);
    return fd;
}

static struct results *make(int folder_fd, uint64_t limit)
{
    struct results *results = NULL;
    REQUIRE(results_create(&results, folder_fd, limit, NULL) == LP_OK);
    return results;
}

static bool there(const char *name)
{
    char path[128];
    snprintf(path, sizeof path, "results/%s", name);
    return access(path, F_OK) == 0;
}

TEST(a_file_lives_while_somebody_refers_to_it)
{
    int fd = folder();
    struct results *results = make(fd, 1 << 20);
    char key[RESULTS_KEY_BYTES], again[RESULTS_KEY_BYTES];
    REQUIRE(results_put(results, key, SHA_A, "png", "hello", 5, NULL) == LP_OK);
    REQUIRE(results_put(results, again, SHA_A, "png", "hello", 5, NULL) == LP_OK);
    CHECK_STR(key, SHA_A ".png");
    CHECK_EQ(results_usage(results).files, 1);
    CHECK_EQ(results_usage(results).used_bytes, RESULTS_BLOCK_BYTES);
    uint64_t bytes = 0;
    int file = results_open(results, key, &bytes);
    CHECK(file >= 0);
    CHECK_EQ(bytes, 5);
    close(file);
    CHECK(!results_drop(results, key));
    results_sweep(results);
    CHECK(there(SHA_A ".png"));
    CHECK(results_drop(results, again));
    results_sweep(results);
    CHECK(!there(SHA_A ".png"));
    CHECK_EQ(results_usage(results).files, 0);
    CHECK_EQ(results_usage(results).used_bytes, 0);
    CHECK(results_open(results, key, &bytes) < 0);
    results_destroy(&results);
    close(fd);
}

TEST(a_doomed_file_comes_back_when_it_is_put_again)
{
    int fd = folder();
    struct results *results = make(fd, 1 << 20);
    char key[RESULTS_KEY_BYTES];
    REQUIRE(results_put(results, key, SHA_A, "png", "hello", 5, NULL) == LP_OK);
    CHECK(results_drop(results, key));
    REQUIRE(results_put(results, key, SHA_A, "png", "hello", 5, NULL) == LP_OK);
    results_sweep(results);
    CHECK(there(SHA_A ".png"));
    CHECK_EQ(results_usage(results).used_bytes, RESULTS_BLOCK_BYTES);
    results_destroy(&results);
    CHECK(!there(SHA_A ".png"));
    close(fd);
}

TEST(space_is_reserved_before_it_is_used)
{
    int fd = folder();
    struct results *results = make(fd, 10 * RESULTS_BLOCK_BYTES);
    char key[RESULTS_KEY_BYTES];
    CHECK(!results_reserve(results, 11 * RESULTS_BLOCK_BYTES));
    CHECK(!results_reserve(results, UINT64_MAX));
    CHECK(results_reserve(results, 6 * RESULTS_BLOCK_BYTES));
    CHECK(!results_reserve(results, 5 * RESULTS_BLOCK_BYTES));
    REQUIRE(results_put(results, key, SHA_B, "exr", "x", 1, NULL) == LP_OK);
    results_settle(results, 6 * RESULTS_BLOCK_BYTES);
    CHECK(results_reserve(results, 9 * RESULTS_BLOCK_BYTES));
    CHECK(!results_reserve(results, 1));
    CHECK(results_drop(results, key));
    CHECK(results_reserve(results, RESULTS_BLOCK_BYTES)); /* from the drop on, not the sweep */
    results_destroy(&results);
    close(fd);
}

TEST(doomed_files_go_before_the_limit_is_passed)
{
    int fd = folder();
    static const char blocks[3 * RESULTS_BLOCK_BYTES];
    struct results *results = make(fd, 4 * RESULTS_BLOCK_BYTES);
    char a[RESULTS_KEY_BYTES], b[RESULTS_KEY_BYTES], small[RESULTS_KEY_BYTES];
    REQUIRE(results_put(results, a, SHA_A, "png", blocks, 2 * RESULTS_BLOCK_BYTES, NULL) == LP_OK);
    CHECK(results_drop(results, a));
    /* It is on the disk still, and counts there, but not against the next job. */
    CHECK_EQ(results_usage(results).used_bytes, 2 * RESULTS_BLOCK_BYTES);
    CHECK(results_reserve(results, 4 * RESULTS_BLOCK_BYTES));
    REQUIRE(results_put(results, small, SHA_B, "json", "x", 1, NULL) == LP_OK);
    CHECK(there(SHA_A ".png")); /* not in the way yet */
    REQUIRE(results_put(results, b, SHA_B, "png", blocks, sizeof blocks, NULL) == LP_OK);
    CHECK(!there(SHA_A ".png"));
    CHECK_EQ(results_usage(results).used_bytes, 4 * RESULTS_BLOCK_BYTES);
    results_settle(results, 4 * RESULTS_BLOCK_BYTES);
    CHECK(!results_reserve(results, 1));
    CHECK(results_drop(results, b));
    CHECK(results_drop(results, small));
    results_sweep(results);
    CHECK_EQ(results_usage(results).used_bytes, 0);
    CHECK_EQ(results_usage(results).files, 0);
    results_destroy(&results);
    close(fd);
}

TEST(what_an_earlier_run_left_is_removed)
{
    int fd = folder();
    static const char *const names[] = {SHA_A ".png", ".tmp-0123", "operator-notes.txt"};
    for (size_t i = 0; i < 3; i++)
        close(openat(fd, names[i], O_CREAT | O_WRONLY, 0600));
    struct results *results = make(fd, 1 << 20);
    CHECK(!there(names[0]));
    CHECK(!there(names[1]));
    CHECK(there(names[2])); /* not ours */
    results_destroy(&results);
    close(fd);
}

TEST(a_write_that_fails_leaves_nothing)
{
    int fd = folder();
    struct results *results = make(fd, 1 << 20);
    struct lp_error error = {0};
    char key[RESULTS_KEY_BYTES];
    memset(key, 0, sizeof key);
    REQUIRE(rmdir("results") == 0); /* no file can be created beneath it any more */
    CHECK_EQ(results_put(results, key, SHA_A, "png", "hello", 5, &error), LP_IO);
    CHECK_STR(key, "");
    CHECK_EQ(results_usage(results).files, 0);
    CHECK_EQ(results_usage(results).used_bytes, 0);
    results_destroy(&results);
    close(fd);
}

static void *put_and_drop(void *argument)
{
    struct results *results = argument;
    for (int i = 0; i < 300; i++) {
        char key[RESULTS_KEY_BYTES];
        uint64_t bytes;
        if (results_put(results, key, i & 1 ? SHA_A : SHA_B, "png", "hello", 5, NULL) != LP_OK)
            return "put failed";
        int fd = results_open(results, key, &bytes);
        if (fd < 0)
            return "a file that is referred to is not there";
        close(fd);
        if (results_drop(results, key))
            results_sweep(results);
    }
    return NULL;
}

TEST(threads_that_make_the_same_files_do_not_lose_them)
{
    int fd = folder();
    struct results *results = make(fd, RESULTS_BLOCK_BYTES); /* so that they unlink, too */
    pthread_t threads[4];
    for (int i = 0; i < 4; i++)
        REQUIRE(pthread_create(&threads[i], NULL, put_and_drop, results) == 0);
    for (int i = 0; i < 4; i++) {
        void *failure = NULL;
        pthread_join(threads[i], &failure);
        CHECK(failure == NULL);
    }
    results_sweep(results);
    CHECK_EQ(results_usage(results).files, 0);
    CHECK_EQ(results_usage(results).used_bytes, 0);
    results_destroy(&results);
    close(fd);
}
