/* Waiting for threads to end, but not for ever: each says so as its last deed. */
#include "server/ending.h"

#include "server/clock.h"

void ending_init(struct ending *ending)
{
    pthread_condattr_t attributes;
    pthread_mutex_init(&ending->mutex, NULL);
    pthread_condattr_init(&attributes);
    pthread_condattr_setclock(&attributes, CLOCK_MONOTONIC);
    pthread_cond_init(&ending->some, &attributes);
    pthread_condattr_destroy(&attributes);
    ending->count = 0;
}

void ending_finish(struct ending *ending)
{
    pthread_cond_destroy(&ending->some);
    pthread_mutex_destroy(&ending->mutex);
}

void ending_note(struct ending *ending)
{
    pthread_mutex_lock(&ending->mutex);
    ending->count++;
    pthread_cond_broadcast(&ending->some);
    pthread_mutex_unlock(&ending->mutex);
}

bool ending_wait(struct ending *ending, uint32_t count, uint64_t until_ns)
{
    struct timespec until = {.tv_sec = (time_t)(until_ns / CLOCK_NS_PER_S),
                             .tv_nsec = (long)(until_ns % CLOCK_NS_PER_S)};
    int failed = 0;
    pthread_mutex_lock(&ending->mutex);
    while (ending->count < count && !failed)
        failed = pthread_cond_timedwait(&ending->some, &ending->mutex, &until);
    bool all = ending->count >= count;
    pthread_mutex_unlock(&ending->mutex);
    return all;
}
