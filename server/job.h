/* One job in the making: what was asked, what was admitted for it, and what came out. */
#ifndef JOB_H
#define JOB_H

#include "server/bake.h"
#include "server/results.h"

#include <stdatomic.h>

struct scene;
struct http_request;
struct job_list;

#define JOB_RAYS_MAX UINT64_C(100000000000) /* the contract's default limit on one job */

enum job_phase { JOB_WAITING, JOB_RUNNING, JOB_FINISHED };
enum job_outcome { JOB_DONE, JOB_FAILED, JOB_CANCELLED };

/* A picture that was kept. */
struct job_picture {
    char key[RESULTS_KEY_BYTES]; /* empty: not made */
    char sha256[WIRE_SHA256_BYTES];
    uint64_t bytes;
};

/* Written by the loop before it is queued (and read-only then), by the workers while they hold it,
 * by the loop again once it came back finished. Owned by the queue in between. */
struct job {
    struct job *next, *previous; /* guarded by the queue's mutex */
    struct job_list *list;       /* guarded by the queue's mutex: the queue's it is in, or NULL */

    /* Set by the loop before queueing. */
    char id[WIRE_ID_BYTES];
    uint64_t number; /* of the id */
    struct wire_job request;
    bool wanted[WIRE_IMAGE_KINDS]; /* formats to make: the request's and the Accept's */
    struct scene *scene;           /* one reference */
    char scene_sha256[WIRE_SHA256_BYTES];
    struct lp_render_plan plan;
    uint64_t memory_bytes;   /* admitted */
    uint64_t reserved_bytes; /* of results */
    uint64_t accepted_ns;
    struct lp_film film;
    void *film_memory;                 /* plan.film_bytes; NULL once it is given back */
    struct lp_counters *tile_counters; /* one per tile, each written by who rendered it */

    /* Guarded by the queue's mutex. */
    enum job_phase phase;
    uint32_t helpers;    /* workers that render its tiles now */
    uint64_t started_ns; /* first tile */

    /* Any thread. */
    atomic_bool cancelled;
    _Atomic uint32_t tile_next; /* tiles at and beyond it are unclaimed */
    _Atomic uint64_t rays;      /* so far */

    /* Written by the worker that finishes it, before it comes back. */
    enum job_outcome outcome;
    enum wire_problem_code failure; /* FAILED */
    char failure_text[LP_ERROR_TEXT_BYTES];
    struct wire_counters counters;
    double queued_s, render_s, encode_s;
    struct job_picture pictures[WIRE_IMAGE_KINDS];
    struct job_picture document; /* the result document, as a file */
    char *document_text;         /* and in memory, for the answer; owned */

    /* Loop only. */
    struct http_request *waiter; /* NULL: nobody waits any more */
    bool returned;               /* it came back: the waiter owns it */
};

/* Takes memory for film and counters (untouched pages cost nothing yet). NULL: no memory. */
struct job *job_create(const struct wire_job *request, const struct lp_render_plan *plan);
/* The big memory, as soon as the pictures are made. Thread: the one that holds the job. */
void job_film_release(struct job *job);
/* Frees everything but the scene's reference and the files. Accepts NULL and sets it. */
void job_destroy(struct job **job);

/* An upper bound of what its results take on the disk. Thread: any. */
uint64_t job_results_bytes_max(const struct lp_render_plan *plan,
                               const bool wanted[WIRE_IMAGE_KINDS]);

/* "png", "exr". */
const char *job_image_extension(enum wire_image image);
const char *job_image_media_type(enum wire_image image);

#endif
