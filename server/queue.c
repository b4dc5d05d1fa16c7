/* The render queue: jobs by priority, then arrival; who may render which tile; what is finished. */
#include "server/queue.h"

#include "server/clock.h"

#include <pthread.h>
#include <stdlib.h>
#include <unistd.h>

/* Jobs of one priority, by arrival: in and out in constant time, so that the mutex is held
 * shortly however many wait. */
struct job_list {
    struct job *first, *last;
};

static void list_append(struct job_list *list, struct job *job)
{
    job->next = NULL;
    job->previous = list->last;
    if (list->last)
        list->last->next = job;
    else
        list->first = job;
    list->last = job;
    job->list = list;
}

static void list_remove(struct job *job)
{
    struct job_list *list = job->list;
    if (job->previous)
        job->previous->next = job->next;
    else
        list->first = job->next;
    if (job->next)
        job->next->previous = job->previous;
    else
        list->last = job->previous;
    job->next = job->previous = NULL;
    job->list = NULL;
}

struct queue {
    uint32_t waiting_limit;
    int wake_fd;
    pthread_mutex_t mutex;
    pthread_cond_t work;
    struct job_list jobs[QUEUE_PRIORITIES]; /* guarded by mutex */
    struct job_list given_up;   /* guarded by mutex: cancelled, begun, without helpers */
    struct job *finished;       /* guarded by mutex */
    struct job **finished_tail; /* guarded by mutex */
    uint32_t waiting, running;  /* guarded by mutex */
    uint32_t busy;              /* guarded by mutex: workers between begin and end or finish */
    bool stopping;              /* guarded by mutex */
    atomic_uint epoch;          /* grows with every push */
    _Atomic uint64_t rays, traversal_steps, progress;
};

struct queue *queue_create(uint32_t waiting_limit, int wake_fd)
{
    struct queue *queue = calloc(1, sizeof *queue);
    if (!queue)
        return NULL;
    queue->waiting_limit = waiting_limit;
    queue->wake_fd = wake_fd;
    queue->finished_tail = &queue->finished;
    pthread_mutex_init(&queue->mutex, NULL);
    pthread_cond_init(&queue->work, NULL);
    return queue;
}

static void jobs_destroy(struct job *jobs)
{
    for (struct job *job = jobs, *next; job; job = next) {
        next = job->next;
        job_destroy(&job);
    }
}

void queue_destroy(struct queue **pointer)
{
    struct queue *queue = *pointer;
    if (!queue)
        return;
    for (size_t i = 0; i < QUEUE_PRIORITIES; i++)
        jobs_destroy(queue->jobs[i].first);
    jobs_destroy(queue->given_up.first);
    jobs_destroy(queue->finished);
    pthread_cond_destroy(&queue->work);
    pthread_mutex_destroy(&queue->mutex);
    free(queue);
    *pointer = NULL;
}

static void queue_wake_loop(const struct queue *queue)
{
    uint64_t one = 1;
    /* Only a counter at its maximum could refuse this, and that one wakes as well. */
    (void)!write(queue->wake_fd, &one, sizeof one);
}

/* Gives a job back to the loop. With the mutex held. */
static void job_hand_back(struct queue *queue, struct job *job)
{
    if (job->phase == JOB_WAITING)
        queue->waiting--;
    else
        queue->running--;
    job->phase = JOB_FINISHED;
    job->next = NULL;
    *queue->finished_tail = job;
    queue->finished_tail = &job->next;
}

static bool job_has_tiles(struct job *job)
{
    return atomic_load(&job->tile_next) < job->plan.tile_count && !atomic_load(&job->cancelled);
}

bool queue_push(struct queue *queue, struct job *job)
{
    pthread_mutex_lock(&queue->mutex);
    bool room = queue->waiting < queue->waiting_limit && !queue->stopping;
    if (room) {
        uint32_t priority = job->request.priority;
        job->phase = JOB_WAITING;
        list_append(&queue->jobs[priority < QUEUE_PRIORITIES ? priority : QUEUE_PRIORITIES - 1],
                    job);
        queue->waiting++;
        atomic_fetch_add(&queue->epoch, 1);
        pthread_cond_broadcast(&queue->work);
    }
    pthread_mutex_unlock(&queue->mutex);
    return room;
}

/* With the mutex held; true when the job was handed back at once. */
static bool job_cancel(struct queue *queue, struct job *job)
{
    atomic_store(&job->cancelled, true);
    /* With helpers, finishing, or given up before: whoever holds it sees the flag and hands it
     * back. */
    if (!job->list || job->list == &queue->given_up || job->helpers > 0)
        return false;
    list_remove(job);
    if (job->phase == JOB_RUNNING) { /* its film is touched: unmapping it is a worker's work */
        list_append(&queue->given_up, job);
        atomic_fetch_add(&queue->epoch, 1);
        pthread_cond_signal(&queue->work);
        return false;
    }
    job->outcome = JOB_CANCELLED;
    job_hand_back(queue, job);
    return true;
}

void queue_cancel(struct queue *queue, struct job *job)
{
    pthread_mutex_lock(&queue->mutex);
    bool back = job->phase != JOB_FINISHED && job_cancel(queue, job);
    pthread_mutex_unlock(&queue->mutex);
    if (back)
        queue_wake_loop(queue);
}

struct job *queue_take_finished(struct queue *queue)
{
    pthread_mutex_lock(&queue->mutex);
    struct job *jobs = queue->finished;
    queue->finished = NULL;
    queue->finished_tail = &queue->finished;
    pthread_mutex_unlock(&queue->mutex);
    return jobs;
}

enum job_phase queue_phase(struct queue *queue, const struct job *job)
{
    pthread_mutex_lock(&queue->mutex);
    enum job_phase phase = job->phase;
    pthread_mutex_unlock(&queue->mutex);
    return phase;
}

void queue_stop(struct queue *queue)
{
    pthread_mutex_lock(&queue->mutex);
    queue->stopping = true;
    atomic_fetch_add(&queue->epoch, 1);
    pthread_cond_broadcast(&queue->work);
    pthread_mutex_unlock(&queue->mutex);
}

/* What a worker should turn to: freeing memory first, then tiles. With the mutex held. */
static struct job *job_to_help(struct queue *queue)
{
    struct job *job = queue->given_up.first;
    if (job) {
        list_remove(job);
        return job;
    }
    for (size_t i = 0; i < QUEUE_PRIORITIES; i++)
        for (job = queue->jobs[i].first; job; job = job->next)
            if (job_has_tiles(job))
                return job;
    return NULL;
}

struct job *queue_begin(struct queue *queue, unsigned *epoch)
{
    struct job *job = NULL;
    pthread_mutex_lock(&queue->mutex);
    while (!queue->stopping) {
        *epoch = atomic_load(&queue->epoch);
        if ((job = job_to_help(queue)))
            break;
        pthread_cond_wait(&queue->work, &queue->mutex);
    }
    if (queue->stopping)
        job = NULL;
    if (job) {
        if (job->phase == JOB_WAITING) {
            job->phase = JOB_RUNNING;
            job->started_ns = clock_ns();
            queue->waiting--;
            queue->running++;
        }
        job->helpers++;
        queue->busy++;
    }
    pthread_mutex_unlock(&queue->mutex);
    return job;
}

bool queue_is_news(struct queue *queue, unsigned epoch)
{
    return atomic_load_explicit(&queue->epoch, memory_order_relaxed) != epoch;
}

bool queue_end(struct queue *queue, struct job *job)
{
    pthread_mutex_lock(&queue->mutex);
    job->helpers--;
    bool last = job->helpers == 0 && !job_has_tiles(job);
    if (last && job->list)
        list_remove(job);
    if (!last)
        queue->busy--;
    pthread_mutex_unlock(&queue->mutex);
    return last;
}

void queue_finish(struct queue *queue, struct job *job)
{
    pthread_mutex_lock(&queue->mutex);
    queue->busy--;
    job_hand_back(queue, job);
    pthread_mutex_unlock(&queue->mutex);
    queue_wake_loop(queue);
}

void queue_progress(struct queue *queue, uint64_t rays, uint64_t steps)
{
    atomic_fetch_add_explicit(&queue->rays, rays, memory_order_relaxed);
    atomic_fetch_add_explicit(&queue->traversal_steps, steps, memory_order_relaxed);
    atomic_fetch_add_explicit(&queue->progress, 1, memory_order_relaxed);
}

struct queue_state queue_state(struct queue *queue)
{
    pthread_mutex_lock(&queue->mutex);
    struct queue_state state = {.waiting = queue->waiting,
                                .running = queue->running,
                                .limit = queue->waiting_limit,
                                .busy = queue->busy};
    pthread_mutex_unlock(&queue->mutex);
    state.rays = atomic_load_explicit(&queue->rays, memory_order_relaxed);
    state.traversal_steps = atomic_load_explicit(&queue->traversal_steps, memory_order_relaxed);
    state.progress = atomic_load_explicit(&queue->progress, memory_order_relaxed);
    return state;
}
