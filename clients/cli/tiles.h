/* Renders a plan's tiles over the pool of threads. */
#ifndef TILES_H
#define TILES_H

#include "clients/cli/pool.h"
#include "engine/render.h"

/* Fills the film and `*sum`. Polls progress->cancelled before each tile: LP_CANCELLED, the film is
 * of no use then. The film's bits and the counters do not depend on the pool's width. */
LP_MUST_CHECK enum lp_code tiles_render(struct lp_film *film, struct lp_counters *sum,
                                        const struct lp_render_plan *plan, struct pool *pool,
                                        struct lp_progress *progress, struct lp_error *err);

#endif
