/* POST /v1/render: from a body to an admitted job, and from a finished job to an answer. */
#include "server/api.h"

#include "server/clock.h"
#include "server/log.h"

#include <inttypes.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

/* Reading a body on the loop takes at most 50 microseconds a KiB (measured); longer ones are read
 * on the pool. */
#define BODY_ON_LOOP_BYTES (16u << 10)

/* Media types that can be made, and the picture that each is. */
static const char *const offers[] = {"application/json", "image/png", "image/x-exr"};
static const enum wire_image offer_images[] = {WIRE_IMAGE_KINDS, WIRE_IMAGE_PNG, WIRE_IMAGE_EXR};
#define OFFER_JSON  0
#define OFFER_COUNT (sizeof offers / sizeof offers[0])

static void refuse(struct http_request *request, const struct wire_problem *problem)
{
    request->server->renders.refused++;
    http_problem(request, problem);
}

/* ---- admission ---------------------------------------------------------------------------------
 */

/* Sets space for the results aside; the oldest results make room where they have been readable for
 * long enough, a bounded number at a time. */
static enum wire_problem_code results_admit(struct server *server, struct wire_problem *problem,
                                            uint64_t bytes)
{
    uint64_t limit = server->config->results_limit_mib << 20;
    if (bytes > limit)
        return wire_problem_set(problem, WIRE_PROBLEM_OVER_LIMIT,
                                "its results may take %" PRIu64 " MiB, and all results together "
                                "have %" PRIu64 " MiB here; take fewer pixels or formats",
                                bytes >> 20, limit >> 20);
    uint64_t now = clock_ns();
    int dropped = 0;
    bool more = true, fits;
    while (!(fits = results_reserve(server->results, bytes)) && dropped < RECORDS_EXPIRE_MAX &&
           (more = records_make_room(server->records, now)))
        dropped++;
    if (dropped > 0) /* whether it was enough or not */
        background_sweep(server->background);
    if (fits)
        return WIRE_PROBLEM_NONE;
    if (more)
        return wire_problem_set(problem, WIRE_PROBLEM_BUSY,
                                "old results are being removed to make room; try again soon");
    bool none = records_room_ns(server->records) == UINT64_MAX;
    return wire_problem_set(problem, WIRE_PROBLEM_DISK_FULL,
                            "the %" PRIu64 " MiB for results are taken by results that clients may "
                            "still read%s; try again later",
                            limit >> 20, none ? " or that are being made" : "");
}

static enum wire_problem_code limits_check(const struct server *server,
                                           struct wire_problem *problem,
                                           const struct lp_render_plan *plan, uint64_t bytes)
{
    if (plan->rays_max > JOB_RAYS_MAX)
        return wire_problem_set(problem, WIRE_PROBLEM_OVER_LIMIT,
                                "it may cast %" PRIu64 " rays, and one job may cast %" PRIu64
                                "; take a smaller face_px or fewer samples",
                                plan->rays_max, JOB_RAYS_MAX);
    if (bytes > server->memory_limit_bytes)
        return wire_problem_set(problem, WIRE_PROBLEM_OVER_LIMIT,
                                "it needs %" PRIu64 " MiB of memory, and there are %" PRIu64
                                " MiB here; take a smaller face_px",
                                bytes >> 20, server->memory_limit_bytes >> 20);
    if (bytes > server->memory_limit_bytes - server->memory_used_bytes)
        return wire_problem_set(problem, WIRE_PROBLEM_BUSY,
                                "the memory for renders is taken by others; try again soon");
    return WIRE_PROBLEM_NONE;
}

/* Gives back what was admitted. */
static void job_give_back(struct server *server, struct job *job)
{
    server->memory_used_bytes -= job->memory_bytes;
    results_settle(server->results, job->reserved_bytes);
    scenes_release(server->scenes, &job->scene);
}

/* Makes, admits and queues the job of a planned request. Takes the scene over on success. */
static enum wire_problem_code job_admit(struct http_request *request, struct wire_problem *problem,
                                        const struct wire_job *wanted, struct scene *scene,
                                        const struct lp_render_plan *plan)
{
    struct server *server = request->server;
    struct wire_job counted = *wanted; /* with the picture that the Accept adds */
    bool *formats = counted.images;
    if (request->offer != OFFER_JSON)
        formats[offer_images[request->offer]] = true;
    uint64_t memory_bytes = bake_bytes_max(plan, &counted);
    enum wire_problem_code code = limits_check(server, problem, plan, memory_bytes);
    if (code)
        return code;
    uint64_t reserved_bytes = job_results_bytes_max(plan, formats);
    if ((code = results_admit(server, problem, reserved_bytes)))
        return code;
    struct job *job = job_create(wanted, plan);
    if (job) {
        memcpy(job->wanted, counted.images, sizeof job->wanted);
        job->scene = scene;
        memcpy(job->scene_sha256, scene->about.scene.sha256, sizeof job->scene_sha256);
        job->memory_bytes = memory_bytes;
        job->reserved_bytes = reserved_bytes;
        job->accepted_ns = clock_ns();
        job->waiter = request;
        records_name(server->records, job);
    }
    if (!job || !records_add(server->records, job)) {
        code = wire_problem_set(problem, WIRE_PROBLEM_BUSY, "no memory for another job; try later");
        goto fail;
    }
    if (!queue_push(server->queue, job)) {
        records_remove(server->records, job);
        code = wire_problem_set(problem, WIRE_PROBLEM_BUSY,
                                "%" PRIu64 " jobs wait already; try again soon",
                                server->config->queue_limit);
        goto fail;
    }
    server->memory_used_bytes += memory_bytes;
    request->job = job;
    return WIRE_PROBLEM_NONE;
fail:
    results_settle(server->results, reserved_bytes);
    job_destroy(&job);
    return code;
}

static void render_begin(struct http_request *request, const struct wire_job *wanted)
{
    struct server *server = request->server;
    struct wire_problem problem = {0};
    struct scene *scene = NULL;
    struct lp_render_plan plan;
    enum wire_problem_code code;
    if (server->phase != SERVER_RUNNING)
        code = wire_problem_set(&problem, WIRE_PROBLEM_DRAINING,
                                "the service is shutting down and takes no new work");
    else if (!scenes_scanned(server->scenes))
        code = wire_problem_set(&problem, WIRE_PROBLEM_SCENE_NOT_READY,
                                "the scenes are being opened; try again soon");
    else
        code = scenes_acquire(server->scenes, &scene, &problem, wanted->scene);
    if (!code)
        code = bake_plan(&plan, &problem, &scene->file.scene, wanted);
    if (!code)
        code = job_admit(request, &problem, wanted, scene, &plan);
    if (code) {
        scenes_release(server->scenes, &scene);
        refuse(request, &problem);
        return;
    }
    http_wait(request);
}

/* ---- the answer --------------------------------------------------------------------------------
 */

static void answer_picture(struct http_request *request, const struct job *job,
                           enum wire_image image, const char *timing)
{
    char href[256];
    const struct job_picture *picture = &job->pictures[image];
    struct http_reply reply = {.status = 200,
                               .media_type = job_image_media_type(image),
                               .from_fd = true,
                               .etag_sha256 = picture->sha256,
                               .content_location = href,
                               .job_id = job->id,
                               .server_timing = timing};
    snprintf(href, sizeof href, "/v1/jobs/%s/probes/0.%s", job->id, job_image_extension(image));
    reply.fd = results_open(request->server->results, picture->key, &reply.bytes);
    if (reply.fd < 0) {
        struct wire_problem problem = {0};
        wire_problem_set(&problem, WIRE_PROBLEM_INTERNAL, "the picture cannot be read back");
        http_problem(request, &problem);
        return;
    }
    http_answer(request, &reply);
}

/* The answer of a job that came back. */
static void render_answer(struct http_request *request)
{
    struct job *job = request->job;
    struct wire_problem problem = {0};
    char timing[160];
    request->job = NULL;
    if (job->outcome == JOB_DONE) {
        snprintf(timing, sizeof timing, "queued;dur=%.3f, render;dur=%.3f, encode;dur=%.3f",
                 1e3 * job->queued_s, 1e3 * job->render_s, 1e3 * job->encode_s);
        if (request->offer == OFFER_JSON) {
            struct http_reply reply = {.status = 200,
                                       .media_type = offers[OFFER_JSON],
                                       .text = job->document_text,
                                       .bytes = job->document.bytes,
                                       .job_id = job->id,
                                       .server_timing = timing};
            job->document_text = NULL;
            http_answer(request, &reply);
        } else {
            answer_picture(request, job, offer_images[request->offer], timing);
        }
    } else {
        if (job->outcome == JOB_CANCELLED)
            wire_problem_set(&problem, WIRE_PROBLEM_DRAINING,
                             "the service is shutting down and gave the render up");
        else
            wire_problem_set(&problem, job->failure, "%s", job->failure_text);
        http_problem(request, &problem);
    }
    job_destroy(&job);
}

/* ---- the handler -------------------------------------------------------------------------------
 */

/* Reads the body here or elsewhere. */
static void render_read(struct http_request *request)
{
    struct wire_problem problem = {0};
    struct wire_job wanted;
    size_t bytes = request->body ? request->body_bytes : 0;
    if (bytes <= BODY_ON_LOOP_BYTES) {
        if (wire_job_read(&wanted, &problem, bytes ? request->body : "", bytes))
            refuse(request, &problem);
        else
            render_begin(request, &wanted);
        return;
    }
    request->reading = background_read(request->server->background, request, request->body, bytes);
    if (!request->reading) {
        wire_problem_set(&problem, WIRE_PROBLEM_BUSY, "too many long bodies at once; try later");
        refuse(request, &problem);
        return;
    }
    request->body = NULL; /* the reading's now */
    http_wait(request);
}

void api_render(struct http_request *request)
{
    struct wire_problem problem = {0};
    if (request->phase == HTTP_RESUMED && request->job) {
        render_answer(request);
        return;
    }
    if (request->phase == HTTP_RESUMED) {
        struct reading *reading = request->reading;
        request->reading = NULL;
        if (reading->code)
            refuse(request, &reading->problem);
        else
            render_begin(request, &reading->job);
        background_release(&reading);
        return;
    }
    request->offer = http_accept(request, offers, OFFER_COUNT);
    if (request->offer < 0) {
        wire_problem_set(&problem, WIRE_PROBLEM_NOT_ACCEPTABLE,
                         "a render can be application/json, image/png or image/x-exr; "
                         "image/vnd.radiance, image/ktx2 and image/vnd-ms.dds are not in this "
                         "version");
        refuse(request, &problem);
        return;
    }
    render_read(request);
}

void api_render_abandon(struct http_request *request)
{
    struct job *job = request->job;
    background_release(&request->reading);
    request->job = NULL;
    if (!job)
        return;
    job->waiter = NULL;
    if (job->returned)
        job_destroy(&job);
    else
        queue_cancel(request->server->queue, job);
}

/* ---- coming back -------------------------------------------------------------------------------
 */

static void job_log(const struct job *job)
{
    static const char *const words[] = {"done", "failed", "cancelled"};
    const struct wire_job *request = &job->request;
    log_event(job->outcome == JOB_FAILED ? LOG_ERROR : LOG_INFO, "render",
              "job=%s state=%s scene=%s face_px=%u rays=%" PRIu64
              " queued_s=%.4f render_s=%.4f encode_s=%.4f%s%s",
              job->id, words[job->outcome], request->scene, request->face_px,
              (uint64_t)atomic_load(&job->rays), job->queued_s, job->render_s, job->encode_s,
              job->failure_text[0] ? " reason=" : "",
              job->failure_text[0] ? log_quote(job->failure_text).text : "");
}

void api_render_collect(struct server *server)
{
    for (struct job *job = queue_take_finished(server->queue), *next; job; job = next) {
        next = job->next;
        job->returned = true;
        server->renders.done += job->outcome == JOB_DONE;
        server->renders.failed += job->outcome == JOB_FAILED;
        server->renders.cancelled += job->outcome == JOB_CANCELLED;
        job_log(job);
        records_finished(server->records, job, clock_ns());
        job_give_back(server, job);
        if (job->waiter)
            http_resume(job->waiter); /* owns it now, as request->job */
        else
            job_destroy(&job);
    }
}
