/* Options: precedence, ranges, and sentences for what is wrong. */
#include "server/config.h"
#include "tests/harness/test.h"

#include <stdlib.h>
#include <string.h>

#define READ(...)                                                                                  \
    read_arguments((char *const[]){"lightprobed", __VA_ARGS__},                                    \
                   (int)(sizeof((char *const[]){"lightprobed", __VA_ARGS__}) / sizeof(char *)))

static struct config config;
static enum config_action action;
static struct lp_error error;

static enum lp_code read_arguments(char *const *argv, int argc)
{
    memset(&error, 0, sizeof error);
    return config_read(&config, &action, argc, argv, &error);
}

TEST(defaults_are_filled)
{
    CHECK_EQ(READ("--check-config"), LP_OK);
    CHECK_EQ(action, CONFIG_CHECK);
    CHECK_STR(config.listen, "127.0.0.1:8080");
    CHECK(config.workers >= 1 && config.workers <= CONFIG_WORKERS_MAX);
    CHECK_EQ(config.queue_limit, 64);
    CHECK_EQ(config.result_retention_s, 900);
    CHECK(config.memory_limit_mib >= 256);
}

TEST(flags_win_over_the_environment)
{
    setenv("LIGHTPROBE_WORKERS", "7", 1);
    setenv("LIGHTPROBE_QUEUE_LIMIT", "9", 1);
    CHECK_EQ(READ("--workers", "3"), LP_OK);
    CHECK_EQ(config.workers, 3);
    CHECK_EQ(config.queue_limit, 9);
    CHECK_EQ(READ("--workers=4", "--listen=localhost:0"), LP_OK);
    CHECK_EQ(config.workers, 4);
    CHECK_STR(config.listen, "localhost:0");
}

TEST(a_wrong_environment_is_named)
{
    setenv("LIGHTPROBE_WORKERS", "many", 1);
    CHECK_EQ(READ("--data", "x"), LP_INVALID);
    CHECK_STR(error.where, "LIGHTPROBE_WORKERS");
    CHECK_EQ(READ("--help"), LP_OK); /* help works whatever the environment holds */
    CHECK_EQ(action, CONFIG_HELP);
}

TEST(numbers_are_whole_and_in_range)
{
    static char *const wrong[] = {
        "", "0", "257", "-1", "+1", " 1", "1 ", "1.0", "0x1", "two", "99999999999999999999999"};
    for (size_t i = 0; i < sizeof wrong / sizeof wrong[0]; i++) {
        CHECK_EQ(READ("--workers", wrong[i]), LP_INVALID);
        CHECK_STR(error.where, "--workers");
        CHECK_HAS(error.text, "from 1 to 256");
    }
    CHECK_EQ(READ("--workers", "256"), LP_OK);
}

TEST(results_stay_as_long_as_the_contract_says)
{
    CHECK_EQ(READ("--result-retention-s", "599"), LP_INVALID);
    CHECK_EQ(READ("--result-retention-s", "600"), LP_OK);
}

TEST(wrong_usage_has_a_sentence)
{
    CHECK_EQ(READ("--frobnicate"), LP_INVALID);
    CHECK_HAS(error.text, "unknown option");
    CHECK_EQ(READ("stray"), LP_INVALID);
    CHECK_EQ(READ("--data"), LP_INVALID);
    CHECK_HAS(error.text, "needs a value");
    CHECK_EQ(READ("--config", "file"), LP_INVALID);
    CHECK_HAS(error.text, "not in this version");
    CHECK_EQ(READ("--token-file"), LP_INVALID);
    CHECK_HAS(error.text, "not in this version");
}
