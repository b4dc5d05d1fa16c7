/* The render workers: threads that render tiles, and finish jobs. */
#ifndef WORKER_H
#define WORKER_H

#include "server/queue.h"

struct workers; /* owns the threads */

/* Starts `count` threads named lp-worker-N at lower priority than the loop. LP_NO_MEMORY. */
LP_MUST_CHECK enum lp_code workers_start(struct workers **out, uint32_t count, struct queue *queue,
                                         struct results *results, struct lp_error *err);
/* Waits for the threads to end after queue_stop, at most until the monotonic time `until_ns`.
 * True: all ended and `*workers` is freed and NULL. False: some still compute; the process must
 * end without freeing what they use. */
bool workers_join(struct workers **workers, uint64_t until_ns);

/* Makes pictures, hash and document of a rendered job, keeps them, and sets its outcome; sees
 * `cancelled`. Nothing is kept unless the outcome is JOB_DONE. Thread: worker. */
void worker_finish(struct job *job, struct queue *queue, struct results *results);

#endif
