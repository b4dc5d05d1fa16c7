/* Finishing a job: counters in tile order, hash, pictures, document, files. */
#include "server/worker.h"

#include "server/clock.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#define KERNEL "scalar" /* the one traversal of this version */

static enum wire_problem_code problem_of(enum lp_code code)
{
    return code == LP_NO_SPACE ? WIRE_PROBLEM_DISK_FULL : WIRE_PROBLEM_INTERNAL;
}

static bool job_is_cancelled(struct job *job)
{
    return atomic_load(&job->cancelled);
}

/* Encodes one format and keeps the file. */
static enum lp_code picture_make(struct job *job, struct wire_probe *probe, struct results *results,
                                 enum wire_image image, struct lp_error *err)
{
    struct bake_picture picture = {0};
    struct job_picture *kept = &job->pictures[image];
    enum lp_code code = bake_picture(&picture, &job->film, job->request.layout, image, err);
    if (!code)
        code = results_put(results, kept->key, picture.sha256, job_image_extension(image),
                           picture.data, picture.bytes, err);
    if (!code) {
        memcpy(kept->sha256, picture.sha256, sizeof kept->sha256);
        kept->bytes = picture.bytes;
        struct wire_image_ref *ref = &probe->images[probe->image_count++];
        snprintf(ref->href, sizeof ref->href, "/v1/jobs/%s/probes/0.%s", job->id,
                 job_image_extension(image));
        memcpy(ref->sha256, picture.sha256, sizeof ref->sha256);
        ref->bytes = picture.bytes;
    }
    free(picture.data);
    return code;
}

static enum lp_code document_make(struct job *job, const struct wire_probe *probe,
                                  struct results *results, struct lp_error *err)
{
    struct wire_result *result = calloc(1, sizeof *result);
    if (!result)
        return lp_fail(err, LP_NO_MEMORY, "result", "no memory for the result document");
    memcpy(result->id, job->id, sizeof result->id);
    memcpy(result->scene_sha256, job->scene_sha256, sizeof result->scene_sha256);
    result->request = job->request;
    result->probe = *probe;
    result->queued_s = job->queued_s;
    result->render_s = job->render_s;
    result->encode_s = job->encode_s;
    snprintf(result->engine, sizeof result->engine, "%s", LP_VERSION);
    snprintf(result->kernel, sizeof result->kernel, "%s", KERNEL);
    enum lp_code code = LP_OK;
    char *text = wire_result_write(result);
    if (!text) {
        code = lp_fail(err, LP_NO_MEMORY, "result", "no memory for the result document");
    } else {
        uint8_t sha256[LP_SHA256_BYTES];
        struct job_picture *kept = &job->document;
        kept->bytes = strlen(text);
        lp_sha256(sha256, text, kept->bytes);
        bake_hex(kept->sha256, sha256);
        code = results_put(results, kept->key, kept->sha256, "json", text, kept->bytes, err);
    }
    if (code)
        free(text);
    else
        job->document_text = text;
    free(result);
    return code;
}

/* Lets go of what was kept for a job that is not done after all. */
static void job_forget_files(struct job *job, struct results *results)
{
    bool doomed = false;
    for (int i = 0; i < WIRE_IMAGE_KINDS; i++) {
        if (job->pictures[i].key[0])
            doomed |= results_drop(results, job->pictures[i].key);
        job->pictures[i] = (struct job_picture){0};
    }
    if (job->document.key[0])
        doomed |= results_drop(results, job->document.key);
    job->document = (struct job_picture){0};
    if (doomed)
        results_sweep(results);
}

void worker_finish(struct job *job, struct queue *queue, struct results *results)
{
    struct lp_error error = {0};
    enum lp_code code = LP_OK;
    uint64_t rendered_ns = clock_ns();
    struct lp_counters sum = {0};
    struct wire_probe *probe = calloc(1, sizeof *probe);
    job->queued_s = clock_seconds(job->started_ns - job->accepted_ns);
    job->render_s = clock_seconds(rendered_ns - job->started_ns);
    if (!probe)
        code = lp_fail(&error, LP_NO_MEMORY, "result", "no memory for the result");
    if (!code && !job_is_cancelled(job)) {
        for (uint32_t i = 0; i < job->plan.tile_count; i++)
            lp_counters_add(&sum, &job->tile_counters[i]);
        bake_probe(probe, &job->plan, &sum, &job->film);
        job->counters = probe->counters;
        queue_progress(queue, 0, 0);
    }
    for (int i = 0; i < WIRE_IMAGE_KINDS && !code && !job_is_cancelled(job); i++) {
        if (job->wanted[i])
            code = picture_make(job, probe, results, (enum wire_image)i, &error);
        queue_progress(queue, 0, 0);
    }
    job->encode_s = clock_seconds(clock_ns() - rendered_ns);
    if (!code && !job_is_cancelled(job))
        code = document_make(job, probe, results, &error);
    job->outcome = code ? JOB_FAILED : job->document.key[0] ? JOB_DONE : JOB_CANCELLED;
    if (code) {
        job->failure = problem_of(code);
        snprintf(job->failure_text, sizeof job->failure_text, "%s", error.text);
    }
    if (job->outcome != JOB_DONE)
        job_forget_files(job, results);
    job_film_release(job);
    free(probe);
}
