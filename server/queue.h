/* The render queue: jobs by priority, then arrival; who may render which tile; what is finished.
 *
 *     WAITING --first worker--> RUNNING --last worker leaves--> finishing --> FINISHED --> loop
 *        '------ cancelled before it began ----------------------------------'
 *
 * All workers help on the first job that has unclaimed tiles; a job that comes in with a better
 * place is looked at after the current tile. Invariants, under the mutex:
 *  1. A job is in `jobs`, or in `given_up`, or held by exactly one finishing worker, or in
 *     `finished`, or the loop's.
 *  2. A job without helpers that is in `jobs` has unclaimed tiles and is not cancelled.
 *  3. A job in `given_up` was begun, then cancelled while nobody helped on it: the next worker
 *     finishes it, because its memory may be large and the loop must not wait for that. */
#ifndef QUEUE_H
#define QUEUE_H

#include "server/job.h"

#define QUEUE_PRIORITIES 10 /* 0 is the most urgent */

struct queue; /* owns its jobs; thread-safe */

/* `wake_fd` is an eventfd that is written to whenever a job is finished. NULL: no memory. */
struct queue *queue_create(uint32_t waiting_limit, int wake_fd);
/* Destroys the jobs that are still in it. Accepts NULL and sets it; no worker may be left. */
void queue_destroy(struct queue **queue);

/* Hands a job over; false when too many wait: it stays the caller's. Thread: loop. */
bool queue_push(struct queue *queue, struct job *job);
/* Cancels a job: comes back through queue_take_finished soon. Thread: loop. */
void queue_cancel(struct queue *queue, struct job *job);
/* All jobs that finished since the last call, in order, linked by next; they are the caller's.
 * Thread: loop. */
struct job *queue_take_finished(struct queue *queue);
/* Where a job stands that has not come back yet. Thread: loop. */
enum job_phase queue_phase(struct queue *queue, const struct job *job);
/* Makes queue_begin return NULL from now on. Thread: loop. */
void queue_stop(struct queue *queue);

/* Waits for a job to help on; NULL when the queue stops. `*epoch` is for queue_is_news.
 * Thread: worker. */
struct job *queue_begin(struct queue *queue, unsigned *epoch);
/* Whether something came in since, so that the worker should look for a better job. */
bool queue_is_news(struct queue *queue, unsigned epoch);
/* Ends helping. True: the caller was the last one and the job has to be finished by it, then
 * given to queue_finish. Thread: worker. */
bool queue_end(struct queue *queue, struct job *job);
void queue_finish(struct queue *queue, struct job *job);
/* Counts a rendered tile, or a step of finishing: shows that work goes on. Thread: worker. */
void queue_progress(struct queue *queue, uint64_t rays, uint64_t steps);

struct queue_state {
    uint32_t waiting, running, limit; /* running: started, not yet taken back by the loop */
    uint32_t busy;                    /* workers */
    uint64_t rays, traversal_steps;   /* since the start */
    uint64_t progress;                /* changes while work goes on */
};
struct queue_state queue_state(struct queue *queue);

#endif
