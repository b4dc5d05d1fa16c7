/* Waiting for threads to end, but not for ever: each says so as its last deed. */
#ifndef ENDING_H
#define ENDING_H

#include <pthread.h>
#include <stdbool.h>
#include <stdint.h>

struct ending {
    pthread_mutex_t mutex;
    pthread_cond_t some; /* of the monotonic clock */
    uint32_t count;      /* guarded by mutex: threads that are about to return */
};

void ending_init(struct ending *ending);
void ending_finish(struct ending *ending);
/* The last call of a thread. */
void ending_note(struct ending *ending);
/* Waits until `count` threads have noted their end; false: not by the monotonic time `until_ns`.
 * They may be joined then without waiting. */
bool ending_wait(struct ending *ending, uint32_t count, uint64_t until_ns);

#endif
