/* GET /v1/jobs/...: state, result and pictures of a job. */
#include "server/api.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

/* The record that the route's {id} means; NULL: the request was answered with why not. */
static struct record *record_of(struct http_request *request)
{
    struct wire_problem problem = {0};
    struct record *record = NULL;
    char id[WIRE_ID_BYTES];
    enum record_verdict verdict = RECORD_UNKNOWN;
    if (http_param(request, 0, id, sizeof id))
        verdict = records_find(request->server->records, id, &record);
    if (verdict == RECORD_FOUND)
        return record;
    if (verdict == RECORD_EXPIRED)
        wire_problem_set(&problem, WIRE_PROBLEM_GONE,
                         "this job's result has expired; ask for the render again");
    else
        wire_problem_set(&problem, WIRE_PROBLEM_UNKNOWN_JOB,
                         "there is no job of this id; results of synchronous renders do not "
                         "outlive the daemon");
    http_problem(request, &problem);
    return NULL;
}

static const char *state_of(const struct server *server, const struct record *record)
{
    if (record->job)
        return queue_phase(server->queue, record->job) == JOB_WAITING ? "queued" : "running";
    return record->outcome == JOB_DONE     ? "done"
           : record->outcome == JOB_FAILED ? "failed"
                                           : "cancelled";
}

/* Why there is no result; NULL for one that is done or on its way. */
static const char *reason_of(const struct record *record)
{
    if (record->job || record->outcome == JOB_DONE)
        return NULL;
    return record->outcome == JOB_FAILED ? record->failure_text
                                         : "the client left, or the service was shutting down";
}

void api_job(struct http_request *request)
{
    const struct record *record = record_of(request);
    if (!record)
        return;
    struct wire_job_status status = {.kind = WIRE_KIND_RENDER,
                                     .state = state_of(request->server, record),
                                     .reason = reason_of(record),
                                     .done = !record->job && record->outcome == JOB_DONE,
                                     .total = 1,
                                     .rays = record->job ? atomic_load(&record->job->rays)
                                                         : record->rays};
    memcpy(status.id, record->id, sizeof status.id);
    http_text(request, 200, "application/json", wire_job_status_write(&status));
}

/* Answers 409 for a job that has no result (yet); true when it did. */
static bool refuse_without_result(struct http_request *request, const struct record *record)
{
    struct wire_problem problem = {0};
    const char *reason = reason_of(record);
    if (!record->job && record->outcome == JOB_DONE)
        return false;
    wire_problem_set(&problem, WIRE_PROBLEM_CONFLICT, "the job is %s%s%s%s",
                     state_of(request->server, record), reason ? ": " : "", reason ? reason : "",
                     record->job ? "; ask again when it is done" : "");
    http_problem(request, &problem);
    return true;
}

static void answer_file(struct http_request *request, const struct job_picture *file,
                        const char *media_type, const char *id)
{
    struct http_reply reply = {.status = 200,
                               .media_type = media_type,
                               .from_fd = true,
                               .etag_sha256 = file->sha256,
                               .job_id = id};
    reply.fd = results_open(request->server->results, file->key, &reply.bytes);
    if (reply.fd < 0) {
        struct wire_problem problem = {0};
        wire_problem_set(&problem, WIRE_PROBLEM_INTERNAL,
                         "the result's file cannot be read; somebody removed it, or no file can be "
                         "opened now");
        http_problem(request, &problem);
        return;
    }
    http_answer(request, &reply);
}

void api_job_result(struct http_request *request)
{
    const struct record *record = record_of(request);
    if (!record || refuse_without_result(request, record))
        return;
    answer_file(request, &record->document, "application/json", record->id);
}

/* ---- pictures ----------------------------------------------------------------------------------
 */

/* Which format a name like "0.png" means. */
static enum wire_problem_code picture_of(enum wire_image *out, struct wire_problem *problem,
                                         const char *name)
{
    static const char *const later[] = {"hdr", "ktx2", "dds"};
    const char *dot = strrchr(name, '.');
    size_t digits = strspn(name, "0123456789");
    if (!dot || digits == 0 || name + digits != dot)
        return wire_problem_set(problem, WIRE_PROBLEM_UNKNOWN_IMAGE,
                                "a picture's name is the probe's number and a format: 0.png or "
                                "0.exr");
    if (digits != 1 || name[0] != '0')
        return wire_problem_set(problem, WIRE_PROBLEM_UNKNOWN_IMAGE,
                                "the job has one probe, number 0");
    for (int i = 0; i < WIRE_IMAGE_KINDS; i++) {
        if (strcmp(dot + 1, job_image_extension((enum wire_image)i)) == 0) {
            *out = (enum wire_image)i;
            return WIRE_PROBLEM_NONE;
        }
    }
    for (size_t i = 0; i < sizeof later / sizeof later[0]; i++)
        if (strcmp(dot + 1, later[i]) == 0)
            return wire_problem_set(problem, WIRE_PROBLEM_UNKNOWN_IMAGE,
                                    "the format %s is not in this version", later[i]);
    return wire_problem_set(problem, WIRE_PROBLEM_UNKNOWN_IMAGE, "the formats are png and exr");
}

/* The views that this version knows: the strip of the radiance. */
static enum wire_problem_code view_check(const struct http_request *request,
                                         struct wire_problem *problem)
{
    const char *layout = http_query(request, "layout"), *aov = http_query(request, "aov");
    if (layout && strcmp(layout, "strip") != 0)
        wire_problem_field(problem, "/layout",
                           "the layout is strip; others are not in this version");
    if (aov && strcmp(aov, "radiance") != 0)
        wire_problem_field(problem, "/aov",
                           "the layer is radiance; others are not in this version");
    if (http_query(request, "face"))
        wire_problem_field(problem, "/face", "single faces are not in this version; cut the strip");
    if (http_query(request, "lighting"))
        wire_problem_field(problem, "/lighting",
                           "a job has the one lighting of its request in this version");
    return problem->code;
}

void api_job_picture(struct http_request *request)
{
    struct wire_problem problem = {0};
    char name[32];
    enum wire_image image = WIRE_IMAGE_PNG;
    const struct record *record = record_of(request);
    if (!record || refuse_without_result(request, record))
        return;
    if (!http_param(request, 1, name, sizeof name))
        name[0] = 0;
    enum wire_problem_code code = picture_of(&image, &problem, name);
    if (!code)
        code = view_check(request, &problem);
    if (!code && !record->pictures[image].key[0])
        code = wire_problem_set(&problem, WIRE_PROBLEM_UNKNOWN_IMAGE,
                                "the job was not asked for %s; name it in \"images\"",
                                job_image_extension(image));
    const char *media_type = job_image_media_type(image);
    if (!code && http_accept(request, &media_type, 1) < 0)
        code = wire_problem_set(&problem, WIRE_PROBLEM_NOT_ACCEPTABLE, "this picture is %s",
                                media_type);
    if (code)
        http_problem(request, &problem);
    else
        answer_file(request, &record->pictures[image], media_type, record->id);
}
