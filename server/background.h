/* Small blocking work beside the loop, on libuv's pool: long bodies, and the unlinking of results.
 *
 * The pool is for milliseconds; renders and scenes have threads of their own. */
#ifndef BACKGROUND_H
#define BACKGROUND_H

#include "protocol/wire.h"
#include "server/results.h"

#include <uv.h>

#define BACKGROUND_READINGS_MAX 64

struct http_request;

/* A job's document being read. */
struct reading {
    uv_work_t work;
    struct background *background;
    char *text; /* owned */
    size_t bytes;
    /* Written by the pool, then the loop's. */
    struct wire_job job;
    struct wire_problem problem;
    enum wire_problem_code code;
    /* Loop only. */
    struct http_request *request; /* NULL: nobody waits any more */
    bool done;
};

struct background {
    uv_loop_t *uv;
    struct results *results;
    int wake_fd; /* the loop's eventfd, borrowed */
    unsigned readings;
    uv_work_t sweep;
    bool sweeping, sweep_again;
};

/* `wake_fd` (borrowed) is written to after a request was resumed, so that the loop goes on with it.
 */
void background_init(struct background *background, uv_loop_t *uv, struct results *results,
                     int wake_fd);

/* Reads `text` (taken over) for a request that waits; http_resume follows, and request->reading
 * holds the outcome. NULL: too many at once or no memory, `text` stays the caller's.
 * Thread: loop. */
struct reading *background_read(struct background *background, struct http_request *request,
                                char *text, size_t bytes);
/* Frees a finished reading, or forgets one that is under way. Accepts NULL and sets it. */
void background_release(struct reading **reading);

/* Has the pool call results_sweep. Thread: loop. */
void background_sweep(struct background *background);

#endif
