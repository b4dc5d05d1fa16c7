/* Runs registered tests, each in a process of its own with a temporary folder, and counts. */
#include "tests/harness/test.h"

#include <errno.h>
#include <ftw.h>
#include <limits.h>
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/wait.h>
#include <unistd.h>

#define TEST_TIME_LIMIT_S 300
#define RUN_FLAG          "--run-here" /* run one test in this process */
#define TEST_FAILURES_MAX 20           /* printed per test */

static struct test_case *first_test;
static int failures;
static uint64_t seed;
static char root[PATH_MAX];

void test_register(struct test_case *test)
{
    struct test_case **at = &first_test;
    while (*at && strcmp((*at)->name, test->name) < 0)
        at = &(*at)->next;
    test->next = *at;
    *at = test;
}

__attribute__((format(printf, 3, 0))) static void print_failure(const char *file, int line,
                                                                const char *format, va_list args)
{
    if (failures++ >= TEST_FAILURES_MAX)
        return;
    fprintf(stderr, "  %s:%d: ", file, line);
    vfprintf(stderr, format, args);
    fprintf(stderr, " (LP_TEST_SEED=%llu)\n", (unsigned long long)seed);
}

void test_fail(const char *file, int line, const char *format, ...)
{
    va_list args;
    va_start(args, format);
    print_failure(file, line, format, args);
    va_end(args);
}

void test_abort(const char *file, int line, const char *format, ...)
{
    va_list args;
    va_start(args, format);
    print_failure(file, line, format, args);
    va_end(args);
    fflush(NULL);
    _exit(1);
}

bool test_str_equal(const char *a, const char *b)
{
    return a && b && strcmp(a, b) == 0;
}

bool test_str_has(const char *text, const char *piece)
{
    return text && strstr(text, piece);
}

test_random test_random_begin(void)
{
    return (test_random){seed};
}

/* SplitMix64 (Steele, Lea, Flood 2014). */
uint64_t test_random_u64(test_random *random)
{
    uint64_t z = random->state += 0x9e3779b97f4a7c15u;
    z = (z ^ z >> 30) * 0xbf58476d1ce4e5b9u;
    z = (z ^ z >> 27) * 0x94d049bb133111ebu;
    return z ^ z >> 31;
}

uint32_t test_random_below(test_random *random, uint32_t limit)
{
    return (uint32_t)(((test_random_u64(random) >> 32) * limit) >> 32);
}

double test_random_unit(test_random *random)
{
    return (double)(test_random_u64(random) >> 11) * 0x1p-53;
}

const char *test_root(void)
{
    return root;
}

static int remove_entry(const char *path, const struct stat *status, int type, struct FTW *where)
{
    (void)status;
    (void)type;
    (void)where;
    return remove(path);
}

static int run_here(const char *name)
{
    for (const struct test_case *test = first_test; test; test = test->next) {
        if (strcmp(test->name, name) != 0)
            continue;
        alarm(TEST_TIME_LIMIT_S);
        test->body();
        if (failures > TEST_FAILURES_MAX)
            fprintf(stderr, "  ... %d failures in all\n", failures);
        return failures ? 1 : 0;
    }
    return 2;
}

static bool run_one(const struct test_case *test, const char *program)
{
    char folder[] = "/tmp/lightprobe-test-XXXXXX";
    if (!mkdtemp(folder)) {
        fprintf(stderr, "FAILED %s: no temporary folder: %s\n", test->name, strerror(errno));
        return false;
    }
    fflush(NULL);
    pid_t child = fork();
    if (child == 0) {
        /* A process of its own from the start: threads that libraries began do not survive a fork,
         * and their destructors would wait for them. */
        if (chdir(folder) == 0 && setenv("LP_TEST_ROOT", root, 1) == 0)
            execl("/proc/self/exe", program, RUN_FLAG, test->name, (char *)NULL);
        _exit(2);
    }
    int status = -1;
    while (child > 0 && waitpid(child, &status, 0) < 0 && errno == EINTR)
        ;
    nftw(folder, remove_entry, 16, FTW_DEPTH | FTW_PHYS);
    bool passed = child > 0 && WIFEXITED(status) && WEXITSTATUS(status) == 0;
    if (!passed && child > 0 && WIFSIGNALED(status))
        fprintf(stderr, "FAILED %s: signal %d\n", test->name, WTERMSIG(status));
    else if (!passed)
        fprintf(stderr, "FAILED %s\n", test->name);
    return passed;
}

static bool wanted(const struct test_case *test, int argc, char **argv)
{
    for (int i = 1; i < argc; i++)
        if (strcmp(argv[i], test->name) == 0)
            return true;
    return argc < 2;
}

int main(int argc, char **argv)
{
    if (argc == 2 && strcmp(argv[1], "--list") == 0) {
        for (const struct test_case *test = first_test; test; test = test->next)
            puts(test->name);
        return 0;
    }
    const char *seed_text = getenv("LP_TEST_SEED");
    seed = seed_text ? strtoull(seed_text, NULL, 10) : 20261122;
    const char *root_text = getenv("LP_TEST_ROOT");
    if (root_text ? !realpath(root_text, root) : !getcwd(root, sizeof root)) {
        fprintf(stderr, "no checkout: set LP_TEST_ROOT or start in it\n");
        return 2;
    }
    if (argc == 3 && strcmp(argv[1], RUN_FLAG) == 0)
        return run_here(argv[2]);
    int passed = 0, failed = 0;
    for (const struct test_case *test = first_test; test; test = test->next) {
        if (!wanted(test, argc, argv))
            continue;
        if (run_one(test, argv[0]))
            passed++;
        else
            failed++;
    }
    printf("%d passed, %d failed\n", passed, failed);
    return failed || passed == 0;
}
