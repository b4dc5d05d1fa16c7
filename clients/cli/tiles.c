/* Renders a plan's tiles over the pool of threads. */
#include "clients/cli/tiles.h"

#include <stdlib.h>

struct tiles_work {
    struct pool_work work;
    const struct lp_render_plan *plan;
    struct lp_film *film;
    struct lp_counters *counters; /* one for each tile */
    struct lp_progress *progress;
};

static void run_tile(struct pool_work *self, uint32_t tile)
{
    struct tiles_work *work = (struct tiles_work *)self;
    if (lp_progress_cancelled(work->progress))
        return;
    lp_render_thread_begin(); /* two registers; the pool's threads do other work too */
    lp_render_tile(work->film, &work->counters[tile], work->plan, tile);
    atomic_fetch_add_explicit(&work->progress->done, 1, memory_order_relaxed);
}

enum lp_code tiles_render(struct lp_film *film, struct lp_counters *sum,
                          const struct lp_render_plan *plan, struct pool *pool,
                          struct lp_progress *progress, struct lp_error *err)
{
    struct lp_counters *counters = calloc(plan->tile_count, sizeof *counters);
    if (!counters)
        return lp_fail(err, LP_NO_MEMORY, "", "out of memory for %u tiles", plan->tile_count);
    lp_progress_phase(progress, "rendering tiles", plan->tile_count);
    struct tiles_work work = {.work.run = run_tile,
                              .plan = plan,
                              .film = film,
                              .counters = counters,
                              .progress = progress};
    pool_run(pool, &work.work, plan->tile_count);
    enum lp_code code = LP_OK;
    if (lp_progress_cancelled(progress)) {
        code = lp_fail(err, LP_CANCELLED, "", "cancelled");
    } else {
        struct lp_counters total = {0};
        for (uint32_t tile = 0; tile < plan->tile_count; tile++)
            lp_counters_add(&total, &counters[tile]);
        *sum = total;
    }
    free(counters);
    return code;
}
