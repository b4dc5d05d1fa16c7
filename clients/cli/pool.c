/* A pool of threads that works off numbered parts.
 *
 * pool_run raises `round` under the lock and wakes everybody; each thread takes parts from the
 * atomic `next` until there are none and then counts itself as idle; the caller does the same and
 * waits until all are idle. A thread that wakes late finds no parts left, but still has to count:
 * that is why `work` may be forgotten when pool_run returns. */
#include "clients/cli/pool.h"

#include <pthread.h>
#include <sched.h>
#include <signal.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

struct pool {
    struct lp_executor executor; /* first: pool_executor gives it away */
    uint32_t width;
    uint32_t thread_count; /* width - 1 */
    pthread_t *threads;
    pthread_mutex_t lock;
    pthread_cond_t wake, idle;
    uint64_t round;         /* guarded by lock: how many pool_run began */
    uint32_t idle_count;    /* guarded by lock: threads done with this round */
    bool ending;            /* guarded by lock */
    struct pool_work *work; /* written under lock before a round, constant during it */
    uint32_t part_count;    /* likewise */
    _Atomic uint32_t next;  /* the first part nobody has taken */
};

/* An engine's task as parts for the pool. */
struct executor_work {
    struct pool_work work;
    const struct lp_task *task;
};

static void run_task_part(struct pool_work *self, uint32_t part)
{
    lp_task_run(((struct executor_work *)self)->task, part);
}

static void executor_run(struct lp_executor *self, const struct lp_task *task, uint32_t part_count)
{
    struct executor_work work = {.work.run = run_task_part, .task = task};
    pool_run((struct pool *)self, &work.work, part_count);
}

static void take_parts(struct pool *pool)
{
    uint32_t part_count = pool->part_count;
    for (;;) {
        uint32_t part = atomic_fetch_add_explicit(&pool->next, 1, memory_order_relaxed);
        if (part >= part_count)
            return;
        pool->work->run(pool->work, part);
    }
}

static void *thread_main(void *user)
{
    struct pool *pool = user;
    uint64_t seen = 0;
    pthread_mutex_lock(&pool->lock);
    for (;;) {
        while (pool->round == seen && !pool->ending)
            pthread_cond_wait(&pool->wake, &pool->lock);
        if (pool->ending)
            break;
        seen = pool->round;
        pthread_mutex_unlock(&pool->lock);
        take_parts(pool);
        pthread_mutex_lock(&pool->lock);
        if (++pool->idle_count == pool->thread_count)
            pthread_cond_signal(&pool->idle);
    }
    pthread_mutex_unlock(&pool->lock);
    return NULL;
}

void pool_run(struct pool *pool, struct pool_work *work, uint32_t part_count)
{
    pthread_mutex_lock(&pool->lock);
    pool->work = work;
    pool->part_count = part_count;
    /* Threads add to `next` even past the end: far below its range, part_count + width at most. */
    atomic_store_explicit(&pool->next, 0, memory_order_relaxed);
    pool->idle_count = 0;
    pool->round++;
    pthread_cond_broadcast(&pool->wake);
    pthread_mutex_unlock(&pool->lock);
    take_parts(pool);
    pthread_mutex_lock(&pool->lock);
    while (pool->idle_count < pool->thread_count)
        pthread_cond_wait(&pool->idle, &pool->lock);
    pool->work = NULL;
    pthread_mutex_unlock(&pool->lock);
}

static uint32_t processors(void)
{
    cpu_set_t set;
    CPU_ZERO(&set);
    int count = sched_getaffinity(0, sizeof set, &set) == 0 ? CPU_COUNT(&set) : 1;
    return count < 1 ? 1 : count > POOL_WIDTH_MAX ? POOL_WIDTH_MAX : (uint32_t)count;
}

enum lp_code pool_create(struct pool **out, uint32_t width, struct lp_error *err)
{
    if (width == 0)
        width = processors();
    if (width > POOL_WIDTH_MAX)
        return lp_fail(err, LP_INVALID, "--threads", "%u threads are more than %d", width,
                       POOL_WIDTH_MAX);
    struct pool *pool = calloc(1, sizeof *pool);
    if (pool)
        pool->threads = calloc(width, sizeof *pool->threads);
    if (!pool || !pool->threads) {
        free(pool);
        return lp_fail(err, LP_NO_MEMORY, "threads", "out of memory for %u threads", width);
    }
    pool->executor = (struct lp_executor){.run = executor_run, .width = width};
    pool->width = width;
    pthread_mutex_init(&pool->lock, NULL);
    pthread_cond_init(&pool->wake, NULL);
    pthread_cond_init(&pool->idle, NULL);

    sigset_t all, before;
    sigfillset(&all);
    pthread_sigmask(SIG_SETMASK, &all, &before);
    int refused = 0;
    while (pool->thread_count < width - 1 && refused == 0) {
        pthread_t *thread = &pool->threads[pool->thread_count];
        refused = pthread_create(thread, NULL, thread_main, pool);
        if (refused)
            break;
        char name[16];
        snprintf(name, sizeof name, "pool-%u", pool->thread_count + 1);
        pthread_setname_np(*thread, name);
        pool->thread_count++;
    }
    pthread_sigmask(SIG_SETMASK, &before, NULL);
    if (refused) {
        uint32_t started = pool->thread_count + 1;
        pool_destroy(&pool);
        return lp_fail(err, LP_NO_MEMORY, "--threads",
                       "the system gives only %u threads (%s): ask for fewer", started,
                       strerror(refused));
    }
    *out = pool;
    return LP_OK;
}

void pool_destroy(struct pool **pool)
{
    if (!pool || !*pool)
        return;
    struct pool *old = *pool;
    pthread_mutex_lock(&old->lock);
    old->ending = true;
    pthread_cond_broadcast(&old->wake);
    pthread_mutex_unlock(&old->lock);
    for (uint32_t i = 0; i < old->thread_count; i++)
        pthread_join(old->threads[i], NULL);
    pthread_cond_destroy(&old->idle);
    pthread_cond_destroy(&old->wake);
    pthread_mutex_destroy(&old->lock);
    free(old->threads);
    free(old);
    *pool = NULL;
}

uint32_t pool_width(const struct pool *pool)
{
    return pool->width;
}

struct lp_executor *pool_executor(struct pool *pool)
{
    return &pool->executor;
}
