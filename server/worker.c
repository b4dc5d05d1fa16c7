/* The render workers: threads that render tiles, and finish jobs. */
#include "server/worker.h"

#include "server/ending.h"

#include <errno.h>
#include <pthread.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/resource.h>
#include <sys/syscall.h>
#include <unistd.h>

#define WORKER_NICE 10 /* under the loop and the scenes thread, so that answers stay quick */

struct worker {
    pthread_t thread;
    uint32_t index;
    struct queue *queue;
    struct results *results;
    struct ending *ending;
};

struct workers {
    struct ending ending;
    uint32_t count;
    struct worker list[];
};

/* Claims and renders tiles until none is left, the job is cancelled, or a better job may wait. */
static void worker_render(struct job *job, struct queue *queue, unsigned epoch)
{
    while (!atomic_load_explicit(&job->cancelled, memory_order_relaxed)) {
        uint32_t tile = atomic_fetch_add(&job->tile_next, 1);
        if (tile >= job->plan.tile_count) {
            /* The counter must not creep towards wrapping round while others still render. */
            atomic_store(&job->tile_next, job->plan.tile_count);
            return;
        }
        struct lp_counters *counters = &job->tile_counters[tile];
        lp_render_tile(&job->film, counters, &job->plan, tile);
        atomic_fetch_add_explicit(&job->rays, counters->rays, memory_order_relaxed);
        queue_progress(queue, counters->rays, counters->traversal_steps);
        if (queue_is_news(queue, epoch))
            return;
    }
}

static void *worker_main(void *argument)
{
    struct worker *worker = argument;
    char name[16];
    snprintf(name, sizeof name, "lp-worker-%u", worker->index % 1000u);
    pthread_setname_np(pthread_self(), name);
    /* On Linux a thread's id stands for the thread alone here. */
    (void)setpriority(PRIO_PROCESS, (id_t)syscall(SYS_gettid), WORKER_NICE);
    lp_render_thread_begin();
    unsigned epoch = 0;
    for (struct job *job; (job = queue_begin(worker->queue, &epoch));) {
        worker_render(job, worker->queue, epoch);
        if (!queue_end(worker->queue, job))
            continue;
        worker_finish(job, worker->queue, worker->results);
        queue_finish(worker->queue, job);
    }
    ending_note(worker->ending);
    return NULL;
}

enum lp_code workers_start(struct workers **out, uint32_t count, struct queue *queue,
                           struct results *results, struct lp_error *err)
{
    size_t bytes;
    if (!lp_size_mul(count, sizeof(struct worker), &bytes) ||
        !lp_size_add(bytes, sizeof(struct workers), &bytes))
        return lp_fail(err, LP_LIMIT, "--workers", "that many workers do not fit into memory");
    struct workers *workers = calloc(1, bytes);
    if (!workers)
        return lp_fail(err, LP_NO_MEMORY, "--workers", "no memory for the workers");
    ending_init(&workers->ending);
    for (uint32_t i = 0; i < count; i++) {
        struct worker *worker = &workers->list[i];
        *worker = (struct worker){
            .index = i, .queue = queue, .results = results, .ending = &workers->ending};
        int failed = pthread_create(&worker->thread, NULL, worker_main, worker);
        if (failed) {
            queue_stop(queue);
            (void)workers_join(&workers, UINT64_MAX / 2);
            return lp_fail(err, LP_NO_MEMORY, "--workers", "worker %u cannot be started: %s", i,
                           strerror(failed));
        }
        workers->count++;
    }
    *out = workers;
    return LP_OK;
}

bool workers_join(struct workers **pointer, uint64_t until_ns)
{
    struct workers *workers = *pointer;
    if (!workers)
        return true;
    if (!ending_wait(&workers->ending, workers->count, until_ns))
        return false;
    for (uint32_t i = 0; i < workers->count; i++)
        pthread_join(workers->list[i].thread, NULL);
    ending_finish(&workers->ending);
    free(workers);
    *pointer = NULL;
    return true;
}
