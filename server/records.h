/* The index of jobs by id: those at work, and finished ones until they expire.
 *
 * An id is "<run>-<number>": 16 hex digits that are new with every start, and the job's number of
 * this run. So an id of this run that is not in the index any more is known to have expired,
 * without any memory of it. Everything here belongs to the loop thread. */
#ifndef RECORDS_H
#define RECORDS_H

#include "server/job.h"

struct queue;

#define RECORDS_MAX        262144 /* finished and live together */
#define RECORDS_EXPIRE_MAX 256    /* dropped at a time: keeps the loop quick */

struct record {
    struct record *bucket_next;
    struct record *next; /* finished: in the order of finishing */
    uint64_t number;
    char id[WIRE_ID_BYTES];
    struct job *job; /* at work; NULL once finished */
    enum job_outcome outcome;
    enum wire_problem_code failure;
    char failure_text[192];
    uint64_t finished_ns, rays;
    struct job_picture pictures[WIRE_IMAGE_KINDS];
    struct job_picture document; /* DONE */
};

struct records; /* owns the records and their references to result files */

/* NULL: no memory. `results` must outlive it. Times are of clock_ns. */
struct records *records_create(struct results *results, uint64_t retention_ns,
                               uint64_t retention_min_ns);
void records_destroy(struct records **records);

/* Gives a job its id and number. */
void records_name(struct records *records, struct job *job);
/* Takes a named job in before it is queued. False: no memory, or RECORDS_MAX. */
bool records_add(struct records *records, struct job *job);
/* Takes out a job that could not be queued after all. */
void records_remove(struct records *records, const struct job *job);
/* Takes over what a finished job leaves behind; the job may be destroyed then. */
void records_finished(struct records *records, const struct job *job, uint64_t now_ns);

enum record_verdict { RECORD_FOUND, RECORD_EXPIRED, RECORD_UNKNOWN };
enum record_verdict records_find(struct records *records, const char *id, struct record **out);

/* Drops finished records that are past the retention. Returns whether files became free to be
 * swept. At most RECORDS_EXPIRE_MAX a call. */
bool records_expire(struct records *records, uint64_t now_ns);
/* Drops the oldest finished record that has been readable for the least time the contract asks
 * for. False: there is none. */
bool records_make_room(struct records *records, uint64_t now_ns);
/* When the oldest finished record may make room; UINT64_MAX: there is none. */
uint64_t records_room_ns(const struct records *records);

size_t records_live_count(const struct records *records);
/* Calls queue_cancel for every job at work. */
void records_cancel_all(struct records *records, struct queue *queue);

#endif
