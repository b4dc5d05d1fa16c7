/* Shows how far long work has come, and turns Ctrl-C into a clean end.
 *
 * A thread of its own polls a struct lp_progress and draws a bar on a terminal, or prints plain
 * lines elsewhere, always on standard error. While it runs, SIGINT and SIGTERM come to it: the
 * first one sets progress.cancelled, the second ends the process at once. */
#ifndef REPORTER_H
#define REPORTER_H

#include <pthread.h>
#include <signal.h>

#include "engine/executor.h"

enum reporter_style {
    REPORTER_AUTO, /* a bar on a terminal, lines elsewhere */
    REPORTER_QUIET /* nothing is printed; signals are still taken */
};

/* The caller's storage; the fields are the reporter's own. */
struct reporter {
    struct lp_progress *progress;
    enum reporter_style style;
    bool terminal;
    int signals; /* signalfd */
    int stop;    /* eventfd */
    pthread_t thread;
    sigset_t mask_before;
};

/* Starts the thread. SIGINT and SIGTERM stay blocked in the calling thread, and in the threads it
 * makes, until reporter_finish: start pools afterwards. `progress` must outlive the reporter. */
LP_MUST_CHECK enum lp_code reporter_init(struct reporter *reporter, struct lp_progress *progress,
                                         enum reporter_style style, struct lp_error *err);
/* Ends the thread and wipes the bar. */
void reporter_finish(struct reporter *reporter);

#endif
