/* The daemon's options: one table drives flags, environment, ranges and --help. */
#include "server/config.h"

#include <errno.h>
#include <inttypes.h>
#include <sched.h>
#include <stddef.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

enum option_kind { OPTION_TEXT, OPTION_COUNT, OPTION_LATER };

/* 0 as a default of a count means: asked of the machine in config_defaults. */
struct option {
    const char *flag, *env, *value;
    enum option_kind kind;
    size_t offset;
    uint64_t min, max, default_count;
    const char *default_text, *doc;
};

#define AT(field) offsetof(struct config, field)
static const struct option options[] = {
    {"--listen", "LIGHTPROBE_LISTEN", "HOST:PORT", OPTION_TEXT, AT(listen), 0, 0, 0,
     "127.0.0.1:8080", "where to listen: a loopback address (port 0: a free one) or unix:PATH"},
    {"--data", "LIGHTPROBE_DATA", "DIR", OPTION_TEXT, AT(data), 0, 0, 0, "data",
     "folder of scenes and results, created if absent"},
    {"--workers", "LIGHTPROBE_WORKERS", "N", OPTION_COUNT, AT(workers), 1, CONFIG_WORKERS_MAX, 0,
     "all cores", "render threads"},
    {"--queue-limit", "LIGHTPROBE_QUEUE_LIMIT", "N", OPTION_COUNT, AT(queue_limit), 1, 100000, 64,
     NULL, "jobs that may wait; more are refused with 503"},
    {"--memory-limit-mib", "LIGHTPROBE_MEMORY_LIMIT_MIB", "N", OPTION_COUNT, AT(memory_limit_mib),
     16, UINT64_C(1) << 30, 0, "half of the machine's memory",
     "memory of all renders that wait or run"},
    {"--result-retention-s", "LIGHTPROBE_RESULT_RETENTION_S", "N", OPTION_COUNT,
     AT(result_retention_s), CONFIG_RETENTION_MIN, 365 * 86400, 900, NULL,
     "seconds for which a result stays readable"},
    {"--results-limit-mib", "LIGHTPROBE_RESULTS_LIMIT_MIB", "N", OPTION_COUNT,
     AT(results_limit_mib), 1, UINT64_C(1) << 30, 4096, NULL, "disk space of all results"},
    {"--connection-limit", "LIGHTPROBE_CONNECTION_LIMIT", "N", OPTION_COUNT, AT(connection_limit),
     1, 100000, 8192, NULL, "connections; requests on further ones are refused with 503"},
    {"--config", "LIGHTPROBE_CONFIG", "FILE", OPTION_LATER, 0, 0, 0, 0, NULL,
     "not in this version"},
    {"--token-file", "LIGHTPROBE_TOKEN_FILE", "FILE", OPTION_LATER, 0, 0, 0, 0, NULL,
     "not in this version"},
};
#define OPTION_COUNT_ALL (sizeof options / sizeof options[0])

static char *option_text(struct config *config, const struct option *option)
{
    return (char *)config + option->offset;
}

static uint64_t *option_count(struct config *config, const struct option *option)
{
    return (uint64_t *)(void *)((char *)config + option->offset);
}

static void config_defaults(struct config *out)
{
    *out = (struct config){0};
    for (size_t i = 0; i < OPTION_COUNT_ALL; i++) {
        if (options[i].kind == OPTION_TEXT)
            snprintf(option_text(out, &options[i]), CONFIG_TEXT_BYTES, "%s",
                     options[i].default_text);
        else if (options[i].kind == OPTION_COUNT)
            *option_count(out, &options[i]) = options[i].default_count;
    }
    cpu_set_t cores;
    int count = sched_getaffinity(0, sizeof cores, &cores) == 0 ? CPU_COUNT(&cores) : 1;
    out->workers = count < 1                    ? 1
                   : count > CONFIG_WORKERS_MAX ? CONFIG_WORKERS_MAX
                                                : (uint64_t)count;
    long pages = sysconf(_SC_PHYS_PAGES), page_bytes = sysconf(_SC_PAGESIZE);
    uint64_t mib =
        pages > 0 && page_bytes > 0 ? (uint64_t)pages * (uint64_t)page_bytes / 2 / (1u << 20) : 0;
    out->memory_limit_mib = mib < 256 ? 256 : mib;
}

static enum lp_code option_set(struct config *out, const struct option *option, const char *where,
                               const char *value, struct lp_error *err)
{
    if (option->kind == OPTION_LATER)
        return lp_fail(err, LP_INVALID, where, "this option is not in this version; leave it out");
    if (option->kind == OPTION_TEXT) {
        size_t n = strlen(value);
        if (n == 0 || n >= CONFIG_TEXT_BYTES)
            return lp_fail(err, LP_INVALID, where, "%s must have 1 to %d characters", option->value,
                           CONFIG_TEXT_BYTES - 1);
        memcpy(option_text(out, option), value, n + 1);
        return LP_OK;
    }
    char *end = NULL;
    errno = 0;
    unsigned long long count = strtoull(value, &end, 10);
    /* strtoull would take signs and spaces. */
    if (value[0] < '0' || value[0] > '9' || *end || errno || count < option->min ||
        count > option->max)
        return lp_fail(err, LP_INVALID, where,
                       "\"%.40s\" is not a whole number from %" PRIu64 " to %" PRIu64, value,
                       option->min, option->max);
    *option_count(out, option) = count;
    return LP_OK;
}

/* The option that `argument` names, "--flag" or "--flag=value"; `*value` is NULL or the latter. */
static const struct option *option_find(const char *argument, const char **value)
{
    const char *equals = strchr(argument, '=');
    size_t n = equals ? (size_t)(equals - argument) : strlen(argument);
    *value = equals ? equals + 1 : NULL;
    for (size_t i = 0; i < OPTION_COUNT_ALL; i++)
        if (strlen(options[i].flag) == n && memcmp(options[i].flag, argument, n) == 0)
            return &options[i];
    return NULL;
}

static enum lp_code config_read_environment(struct config *config, struct lp_error *err)
{
    for (size_t i = 0; i < OPTION_COUNT_ALL; i++) {
        const char *value = getenv(options[i].env);
        if (!value || !*value)
            continue;
        enum lp_code code = option_set(config, &options[i], options[i].env, value, err);
        if (code)
            return code;
    }
    return LP_OK;
}

enum lp_code config_read(struct config *out, enum config_action *action, int argc,
                         char *const *argv, struct lp_error *err)
{
    struct config config;
    enum config_action wanted = CONFIG_RUN;
    config_defaults(&config);
    for (int i = 1; i < argc; i++) { /* help must work in any environment */
        if (strcmp(argv[i], "--help") == 0 || strcmp(argv[i], "-h") == 0) {
            *action = CONFIG_HELP;
            *out = config;
            return LP_OK;
        }
        if (strcmp(argv[i], "--version") == 0) {
            *action = CONFIG_VERSION;
            *out = config;
            return LP_OK;
        }
    }
    enum lp_code code = config_read_environment(&config, err);
    if (code)
        return code;
    for (int i = 1; i < argc; i++) {
        const char *value;
        if (strcmp(argv[i], "--check-config") == 0) {
            wanted = CONFIG_CHECK;
            continue;
        }
        const struct option *option = option_find(argv[i], &value);
        if (!option)
            return lp_fail(err, LP_INVALID, argv[i], "unknown option; --help lists them");
        if (!value && option->kind != OPTION_LATER) {
            if (i + 1 >= argc)
                return lp_fail(err, LP_INVALID, option->flag, "needs a value: %s %s", option->flag,
                               option->value);
            value = argv[++i];
        }
        code = option_set(&config, option, option->flag, value ? value : "", err);
        if (code)
            return code;
    }
    *out = config;
    *action = wanted;
    return LP_OK;
}

void config_write_help(FILE *file)
{
    fprintf(file, "lightprobed: renders light probes from sparse voxel octrees over HTTP.\n\n"
                  "usage: lightprobed [options]\n\n");
    for (size_t i = 0; i < OPTION_COUNT_ALL; i++) {
        const struct option *o = &options[i];
        char left[64];
        snprintf(left, sizeof left, "%s %s", o->flag, o->value);
        fprintf(file, "  %-26s %s\n", left, o->doc);
        if (o->kind == OPTION_LATER)
            continue;
        fprintf(file, "  %-26s default ", "");
        if (o->default_text)
            fprintf(file, "%s", o->default_text);
        else
            fprintf(file, "%" PRIu64, o->default_count);
        if (o->kind == OPTION_COUNT)
            fprintf(file, "; %" PRIu64 " to %" PRIu64, o->min, o->max);
        fprintf(file, "; environment %s\n", o->env);
    }
    fprintf(file,
            "  %-26s read the configuration, print it, and end\n"
            "  %-26s print the version, and end\n"
            "  %-26s print this, and end\n\n"
            "Flags win over the environment. Standard output carries one line,\n"
            "\"ready http://HOST:PORT\", when the daemon takes requests; logs go to\n"
            "standard error. SIGTERM drains. Exit: 0 drained, 1 failed while running,\n"
            "2 could not start as configured.\n",
            "--check-config", "--version", "--help");
}

void config_write(const struct config *config, FILE *file)
{
    struct config copy = *config;
    for (size_t i = 0; i < OPTION_COUNT_ALL; i++) {
        if (options[i].kind == OPTION_TEXT)
            fprintf(file, "%s=%s\n", options[i].env, option_text(&copy, &options[i]));
        else if (options[i].kind == OPTION_COUNT)
            fprintf(file, "%s=%" PRIu64 "\n", options[i].env, *option_count(&copy, &options[i]));
    }
}
