/* The unit tests' harness: each TEST runs in a process and a temporary folder of its own.
 *
 *     TEST(octree_finds_every_voxel) { ... CHECK(found); CHECK_EQ(count, 8u); }
 *
 * A program of tests prints a line per failure and ends with "N passed, N failed"; arguments are
 * names of tests to run (default: all), `--list` shows them. Set LP_TEST_SEED to repeat a run of
 * the shaped random input. */
#ifndef LP_TEST_H
#define LP_TEST_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

struct test_case {
    const char *name;
    void (*body)(void);
    struct test_case *next;
};
void test_register(struct test_case *test);

/* Notes a failed check and goes on; the test counts as failed. */
void test_fail(const char *file, int line, const char *format, ...)
    __attribute__((format(printf, 3, 4)));
/* Ends the test at once when something it stands on is missing. */
_Noreturn void test_abort(const char *file, int line, const char *format, ...)
    __attribute__((format(printf, 3, 4)));

#define TEST(name)                                                                                 \
    static void test_body_##name(void);                                                            \
    __attribute__((constructor)) static void test_register_##name(void)                            \
    {                                                                                              \
        static struct test_case test = {#name, test_body_##name, NULL};                            \
        test_register(&test);                                                                      \
    }                                                                                              \
    static void test_body_##name(void)

#define CHECK(condition) ((condition) ? (void)0 : test_fail(__FILE__, __LINE__, "%s", #condition))
#define REQUIRE(condition)                                                                         \
    ((condition) ? (void)0 : test_abort(__FILE__, __LINE__, "%s", #condition))
/* Integers of any type. */
#define CHECK_EQ(a, b)                                                                             \
    do {                                                                                           \
        long long check_a = (long long)(a), check_b = (long long)(b);                              \
        if (check_a != check_b)                                                                    \
            test_fail(__FILE__, __LINE__, "%s is %lld, not %s = %lld", #a, check_a, #b, check_b);  \
    } while (0)
#define CHECK_NEAR(a, b, tolerance)                                                                \
    do {                                                                                           \
        double near_a = (double)(a), near_b = (double)(b), near_t = (double)(tolerance);           \
        double near_d = near_a > near_b ? near_a - near_b : near_b - near_a;                       \
        if (!(near_d <= near_t))                                                                   \
            test_fail(__FILE__, __LINE__, "%s = %.9g is not within %g of %s = %.9g", #a, near_a,   \
                      near_t, #b, near_b);                                                         \
    } while (0)
#define CHECK_STR(a, b)                                                                            \
    do {                                                                                           \
        const char *str_a = (a), *str_b = (b);                                                     \
        if (!test_str_equal(str_a, str_b))                                                         \
            test_fail(__FILE__, __LINE__, "%s is \"%s\", not \"%s\"", #a,                          \
                      str_a ? str_a : "(null)", str_b ? str_b : "(null)");                         \
    } while (0)
/* That text contains a piece: for error sentences. */
#define CHECK_HAS(text, piece)                                                                     \
    do {                                                                                           \
        if (!test_str_has((text), (piece)))                                                        \
            test_fail(__FILE__, __LINE__, "\"%s\" does not say \"%s\"", (text), (piece));          \
    } while (0)

bool test_str_equal(const char *a, const char *b);
bool test_str_has(const char *text, const char *piece);

/* Shaped random input: a small generator whose seed is printed with a failure. */
typedef struct test_random {
    uint64_t state;
} test_random;
test_random test_random_begin(void);
uint64_t test_random_u64(test_random *random);
uint32_t test_random_below(test_random *random, uint32_t limit); /* 0..limit-1 */
double test_random_unit(test_random *random);                    /* [0, 1) */

/* The checkout's root (absolute), for fixtures: tests run in a temporary folder. */
const char *test_root(void);

#endif
