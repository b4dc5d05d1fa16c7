/* A pool of threads that works off numbered parts: the command line's executor for the engine, and
 * its renderer of tiles. */
#ifndef POOL_H
#define POOL_H

#include "engine/executor.h"

#define POOL_WIDTH_MAX 256

/* Work in parts; embed it as the first member of a struct with what the parts need. */
struct pool_work {
    /* Runs one part. Called for every part once, on any of the pool's threads, several at once. */
    void (*run)(struct pool_work *self, uint32_t part);
};

struct pool;

/* Starts width - 1 threads (the caller of pool_run is one more). `width` 0: as many as this process
 * may use processors; at most POOL_WIDTH_MAX. The threads leave all signals to others.
 * LP_NO_MEMORY: the system gives no more threads. */
LP_MUST_CHECK enum lp_code pool_create(struct pool **out, uint32_t width, struct lp_error *err);
/* Ends the threads; no pool_run may be under way. Accepts NULL and sets it. */
void pool_destroy(struct pool **pool);

uint32_t pool_width(const struct pool *pool);

/* Runs parts 0..part_count-1 and returns when all are done. One call at a time; a part must not
 * call it. */
void pool_run(struct pool *pool, struct pool_work *work, uint32_t part_count);

/* The pool as the engine wants it; valid as long as the pool. */
struct lp_executor *pool_executor(struct pool *pool);

#endif
