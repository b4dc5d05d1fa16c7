/* The daemon's options: one table drives flags, environment, ranges and --help. */
#ifndef CONFIG_H
#define CONFIG_H

#include "engine/base.h"

#include <stdio.h>

#define CONFIG_TEXT_BYTES    1024
#define CONFIG_WORKERS_MAX   256
#define CONFIG_RETENTION_MIN 600 /* seconds: the contract keeps results that long */

/* Everything that can be set. All filled after config_read. */
struct config {
    char listen[CONFIG_TEXT_BYTES]; /* HOST:PORT or unix:PATH */
    char data[CONFIG_TEXT_BYTES];   /* folder */
    uint64_t workers;               /* render threads */
    uint64_t queue_limit;           /* jobs that may wait */
    uint64_t memory_limit_mib;      /* of all admitted films */
    uint64_t result_retention_s;
    uint64_t results_limit_mib; /* of DIR/results */
    uint64_t connection_limit;
};

enum config_action {
    CONFIG_RUN,
    CONFIG_CHECK,   /* --check-config: say what holds, and end */
    CONFIG_VERSION, /* --version */
    CONFIG_HELP     /* --help */
};

/* Reads flags over environment (LIGHTPROBE_...) over defaults. LP_INVALID: one sentence, where =
 * the flag or variable. Thread: main, before others start. */
LP_MUST_CHECK enum lp_code config_read(struct config *out, enum config_action *action, int argc,
                                       char *const *argv, struct lp_error *err);

/* --help and --check-config. */
void config_write_help(FILE *file);
void config_write(const struct config *config, FILE *file);

#endif
