/* The index of jobs by id: those at work, and finished ones until they expire. */
#include "server/records.h"

#include "server/queue.h"

#include <inttypes.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/random.h>

#define RECORDS_BUCKETS 16384 /* a power of two; numbers run on, so they spread evenly */

struct records {
    struct results *results;
    uint64_t retention_ns, retention_min_ns;
    uint64_t run; /* the ids' first half */
    uint64_t numbers;
    size_t count, live_count;
    struct record *finished, **finished_tail; /* oldest first */
    struct record *buckets[RECORDS_BUCKETS];
};

struct records *records_create(struct results *results, uint64_t retention_ns,
                               uint64_t retention_min_ns)
{
    struct records *records = calloc(1, sizeof *records);
    if (!records)
        return NULL;
    records->results = results;
    records->retention_ns = retention_ns;
    records->retention_min_ns = retention_min_ns;
    records->finished_tail = &records->finished;
    if (getrandom(&records->run, sizeof records->run, 0) != sizeof records->run) {
        free(records);
        return NULL;
    }
    return records;
}

void records_destroy(struct records **pointer)
{
    struct records *records = *pointer;
    if (!records)
        return;
    for (size_t i = 0; i < RECORDS_BUCKETS; i++) {
        for (struct record *record = records->buckets[i], *next; record; record = next) {
            next = record->bucket_next;
            free(record);
        }
    }
    free(records);
    *pointer = NULL;
}

void records_name(struct records *records, struct job *job)
{
    job->number = records->numbers++;
    snprintf(job->id, sizeof job->id, "%016" PRIx64 "-%" PRIu64, records->run, job->number);
}

static struct record **bucket_of(struct records *records, uint64_t number)
{
    return &records->buckets[number & (RECORDS_BUCKETS - 1)];
}

static struct record *record_find(struct records *records, uint64_t number)
{
    struct record *record = *bucket_of(records, number);
    while (record && record->number != number)
        record = record->bucket_next;
    return record;
}

static void record_unlink(struct records *records, struct record *record)
{
    struct record **at = bucket_of(records, record->number);
    while (*at != record)
        at = &(*at)->bucket_next;
    *at = record->bucket_next;
    records->count--;
    free(record);
}

bool records_add(struct records *records, struct job *job)
{
    if (records->count >= RECORDS_MAX)
        return false;
    struct record *record = calloc(1, sizeof *record);
    if (!record)
        return false;
    record->number = job->number;
    memcpy(record->id, job->id, sizeof record->id);
    record->job = job;
    struct record **bucket = bucket_of(records, job->number);
    record->bucket_next = *bucket;
    *bucket = record;
    records->count++;
    records->live_count++;
    return true;
}

void records_remove(struct records *records, const struct job *job)
{
    struct record *record = record_find(records, job->number);
    if (!record)
        return;
    records->live_count--;
    record_unlink(records, record);
}

void records_finished(struct records *records, const struct job *job, uint64_t now_ns)
{
    struct record *record = record_find(records, job->number);
    if (!record)
        return;
    record->job = NULL;
    record->outcome = job->outcome;
    record->failure = job->failure;
    snprintf(record->failure_text, sizeof record->failure_text, "%.*s",
             (int)sizeof record->failure_text - 1, job->failure_text);
    record->finished_ns = now_ns;
    record->rays = atomic_load(&job->rays);
    memcpy(record->pictures, job->pictures, sizeof record->pictures);
    record->document = job->document;
    record->next = NULL;
    *records->finished_tail = record;
    records->finished_tail = &record->next;
    records->live_count--;
}

enum record_verdict records_find(struct records *records, const char *id, struct record **out)
{
    char again[WIRE_ID_BYTES];
    const char *dash = strchr(id, '-');
    if (!dash || dash - id != 16)
        return RECORD_UNKNOWN;
    /* Whatever strtoull takes beside the id's own form does not print back equal. */
    uint64_t number = strtoull(dash + 1, NULL, 10);
    snprintf(again, sizeof again, "%016" PRIx64 "-%" PRIu64, records->run, number);
    if (strcmp(again, id) != 0 || number >= records->numbers)
        return RECORD_UNKNOWN;
    *out = record_find(records, number);
    return *out ? RECORD_FOUND : RECORD_EXPIRED;
}

/* Drops the oldest finished record; true when files became free. */
static bool record_drop_oldest(struct records *records)
{
    struct record *record = records->finished;
    bool doomed = false;
    records->finished = record->next;
    if (!records->finished)
        records->finished_tail = &records->finished;
    for (int i = 0; i < WIRE_IMAGE_KINDS; i++)
        if (record->pictures[i].key[0])
            doomed |= results_drop(records->results, record->pictures[i].key);
    if (record->document.key[0])
        doomed |= results_drop(records->results, record->document.key);
    record_unlink(records, record);
    return doomed;
}

bool records_expire(struct records *records, uint64_t now_ns)
{
    bool doomed = false;
    for (int i = 0; i < RECORDS_EXPIRE_MAX && records->finished; i++) {
        if (now_ns - records->finished->finished_ns < records->retention_ns)
            break;
        doomed |= record_drop_oldest(records);
    }
    return doomed;
}

uint64_t records_room_ns(const struct records *records)
{
    return records->finished ? records->finished->finished_ns + records->retention_min_ns
                             : UINT64_MAX;
}

bool records_make_room(struct records *records, uint64_t now_ns)
{
    if (!records->finished || now_ns < records_room_ns(records))
        return false;
    (void)record_drop_oldest(records);
    return true;
}

size_t records_live_count(const struct records *records)
{
    return records->live_count;
}

void records_cancel_all(struct records *records, struct queue *queue)
{
    for (size_t i = 0; i < RECORDS_BUCKETS; i++)
        for (struct record *record = records->buckets[i]; record; record = record->bucket_next)
            if (record->job)
                queue_cancel(queue, record->job);
}
