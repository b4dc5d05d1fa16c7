/* Dispatch of tasks, the serial executor, and the writing side of progress. */
#include "engine/executor.h"

#include "engine/build_task.h"

void lp_task_run(const struct lp_task *task, uint32_t part)
{
    switch (task->kind) {
    case LP_TASK_BUILD:
        lp_build_task_run(task->of.build, part);
        break;
    }
}

static void run_serially(struct lp_executor *self, const struct lp_task *task, uint32_t part_count)
{
    (void)self;
    for (uint32_t part = 0; part < part_count; part++)
        lp_task_run(task, part);
}

struct lp_executor *lp_executor_serial(void)
{
    static struct lp_executor serial = {.run = run_serially, .width = 1}; /* never written to */
    return &serial;
}

void lp_progress_phase(struct lp_progress *progress, const char *phase, uint64_t total)
{
    if (!progress)
        return;
    atomic_store_explicit(&progress->done, 0, memory_order_relaxed);
    atomic_store_explicit(&progress->total, total, memory_order_relaxed);
    atomic_store_explicit(&progress->phase, phase, memory_order_release);
}
