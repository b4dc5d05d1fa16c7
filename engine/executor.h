/* How the engine asks its caller for several threads: tasks as data, run by an executor. */
#ifndef LP_EXECUTOR_H
#define LP_EXECUTOR_H

#include "engine/base.h"

#include <stdatomic.h>

struct lp_build_task; /* engine/build_task.h: one pass of building a tree */

/* A pass of work cut into independent parts. The arm is chosen by `kind`. */
enum lp_task_kind { LP_TASK_BUILD };
struct lp_task {
    enum lp_task_kind kind;
    union {
        struct lp_build_task *build; /* LP_TASK_BUILD */
    } of;
};

/* Runs part `part` of a task. Parts may run in any order and at once; none fails.
 * Thread: any, on behalf of the executor. */
void lp_task_run(const struct lp_task *task, uint32_t part);

/* The caller's threads. `run` calls lp_task_run(task, p) once for every p < part_count and returns
 * when all are done. Results never depend on `width` or on the order of parts. */
struct lp_executor {
    void (*run)(struct lp_executor *self, const struct lp_task *task, uint32_t part_count);
    uint32_t width; /* how many parts can run at once, >= 1 */
};

/* Runs every part on the calling thread. Needs no set-up; shared by everybody. */
struct lp_executor *lp_executor_serial(void);

/* How far long work has come. Written by the engine, read by any thread that shows it; `cancelled`
 * is written by the caller and polled between passes and rows. All zero to begin with. */
struct lp_progress {
    _Atomic uint64_t done, total; /* units of the phase; total 0 = not known */
    _Atomic(const char *) phase;  /* static string, NULL before the first */
    atomic_bool cancelled;
};

/* Enters a phase. `progress` may be NULL. Thread: any one writer. */
void lp_progress_phase(struct lp_progress *progress, const char *phase, uint64_t total);

static inline bool lp_progress_cancelled(const struct lp_progress *progress)
{
    return progress && atomic_load_explicit(&progress->cancelled, memory_order_relaxed);
}

#endif
