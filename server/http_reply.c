/* Answers: headers that all of them have, files, problems, conditions. */
#include "server/http_private.h"
#include "server/range.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/socket.h>
#include <unistd.h>

/* The one table of what a problem is in HTTP. */
static const struct {
    int status;
    unsigned retry_after_s;
} problem_table[] = {
    [WIRE_PROBLEM_NONE] = {500, 0},           [WIRE_PROBLEM_BAD_REQUEST] = {400, 0},
    [WIRE_PROBLEM_INVALID_JSON] = {400, 0},   [WIRE_PROBLEM_INVALID_FIELD] = {422, 0},
    [WIRE_PROBLEM_FOREIGN_ORIGIN] = {403, 0}, [WIRE_PROBLEM_UNKNOWN_ROUTE] = {404, 0},
    [WIRE_PROBLEM_UNKNOWN_SCENE] = {404, 0},  [WIRE_PROBLEM_UNKNOWN_JOB] = {404, 0},
    [WIRE_PROBLEM_UNKNOWN_IMAGE] = {404, 0},  [WIRE_PROBLEM_METHOD_NOT_ALLOWED] = {405, 0},
    [WIRE_PROBLEM_NOT_ACCEPTABLE] = {406, 0}, [WIRE_PROBLEM_SCENE_NOT_READY] = {503, 1},
    [WIRE_PROBLEM_SCENE_FAILED] = {409, 0},   [WIRE_PROBLEM_CONFLICT] = {409, 0},
    [WIRE_PROBLEM_GONE] = {410, 0},           [WIRE_PROBLEM_TOO_LARGE] = {413, 0},
    [WIRE_PROBLEM_OVER_LIMIT] = {422, 0},     [WIRE_PROBLEM_BUSY] = {503, 1},
    [WIRE_PROBLEM_DRAINING] = {503, 5},       [WIRE_PROBLEM_DISK_FULL] = {507, 0},
    [WIRE_PROBLEM_INTERNAL] = {500, 0},
};

int http_problem_status(enum wire_problem_code code)
{
    return problem_table[code].status;
}

static void header_add(struct MHD_Response *response, const char *name, const char *value)
{
    if (value)
        (void)MHD_add_response_header(response, name, value);
}

/* Whether a GET's or HEAD's If-None-Match names this strong tag, or anything. Of other methods the
 * condition is not ours to judge: they are done whatever the client knows. */
static bool tag_is_known(const struct http_request *request, const char *tag)
{
    if (strcmp(request->method, "GET") != 0 && strcmp(request->method, "HEAD") != 0)
        return false;
    const char *list =
        MHD_lookup_connection_value(request->connection, MHD_HEADER_KIND, "If-None-Match");
    if (!list)
        return false;
    return strcmp(list, "*") == 0 ||
           strstr(list, tag) != NULL; /* a hash in quotes: no false hits */
}

/* What a reply sends of its representation. */
struct part {
    uint64_t first, total;
    char content_range[72]; /* empty: none */
};

/* Heeds Range on files (GET alone, and with If-Range only while the tag is still the same): makes
 * the reply 206 or 416. */
static void part_choose(struct part *part, const struct http_request *request,
                        struct http_reply *reply, const char *tag)
{
    struct MHD_Connection *connection = request->connection;
    const char *header = MHD_lookup_connection_value(connection, MHD_HEADER_KIND, "Range");
    const char *same = MHD_lookup_connection_value(connection, MHD_HEADER_KIND, "If-Range");
    uint64_t count = 0;
    *part = (struct part){.total = reply->bytes};
    if (reply->status != 200 || !reply->from_fd || strcmp(request->method, "GET") != 0 ||
        (same && strcmp(same, tag)))
        return;
    switch (range_read(&part->first, &count, header, part->total)) {
    case RANGE_WHOLE:
        break;
    case RANGE_PART:
        reply->status = 206;
        reply->bytes = count;
        snprintf(part->content_range, sizeof part->content_range, "bytes %llu-%llu/%llu",
                 (unsigned long long)part->first, (unsigned long long)(part->first + count - 1),
                 (unsigned long long)part->total);
        break;
    case RANGE_UNSATISFIABLE:
        close(reply->fd);
        reply->from_fd = false;
        reply->status = 416;
        reply->bytes = 0;
        reply->media_type = NULL;
        snprintf(part->content_range, sizeof part->content_range, "bytes */%llu",
                 (unsigned long long)part->total);
        break;
    }
}

static struct MHD_Response *response_make(struct http_reply *reply, const struct part *part)
{
    struct MHD_Response *response;
    if (reply->from_fd) {
        response = MHD_create_response_from_fd_at_offset64(reply->bytes, reply->fd, part->first);
        if (!response)
            close(reply->fd);
        reply->from_fd = false;
        return response;
    }
    response = MHD_create_response_from_buffer(reply->text ? (size_t)reply->bytes : 0, reply->text,
                                               reply->text ? MHD_RESPMEM_MUST_FREE
                                                           : MHD_RESPMEM_PERSISTENT);
    if (!response)
        free(reply->text);
    reply->text = NULL;
    return response;
}

static void headers_add(struct MHD_Response *response, const struct http_request *request,
                        const struct http_reply *reply, const char *tag, const struct part *part)
{
    char number[16];
    header_add(response, "Content-Type", reply->media_type);
    header_add(response, "X-Request-Id", request->id);
    header_add(response, "X-Content-Type-Options", "nosniff");
    if (tag[0]) {
        header_add(response, "ETag", tag);
        /* Immutable while it is there, but it expires here: ask again each time. */
        header_add(response, "Cache-Control", "no-cache");
        header_add(response, "Accept-Ranges", reply->is_file ? "bytes" : "none");
    } else {
        header_add(response, "Cache-Control", "no-store");
    }
    header_add(response, "Content-Range", part->content_range[0] ? part->content_range : NULL);
    header_add(response, "Content-Location", reply->content_location);
    header_add(response, "X-Lightprobe-Job", reply->job_id);
    header_add(response, "Server-Timing", reply->server_timing);
    header_add(response, "Allow", reply->allow);
    if (reply->retry_after_s) {
        snprintf(number, sizeof number, "%u", reply->retry_after_s);
        header_add(response, "Retry-After", number);
    }
    if (request->http->closing || request->peer->overflow)
        header_add(response, "Connection", "close");
}

void http_answer(struct http_request *request, struct http_reply *reply)
{
    char tag[WIRE_SHA256_BYTES + 2];
    tag[0] = 0;
    if (reply->etag_sha256)
        snprintf(tag, sizeof tag, "\"%.64s\"", reply->etag_sha256);
    reply->is_file = reply->from_fd;
    if (tag[0] && reply->status == 200 && tag_is_known(request, tag)) {
        /* The body stays: the library sends none with a 304, but takes Content-Length from it,
         * which must be the 200's or be absent. */
        reply->status = 304;
        reply->media_type = NULL;
    }
    struct part part;
    part_choose(&part, request, reply, tag);
    /* Answered before the body was read: the client may be sending still. */
    if (request->has_body && request->phase == HTTP_HEAD)
        http_linger(request->http, request->peer);
    request->phase = HTTP_ANSWERED;
    struct MHD_Response *response = response_make(reply, &part);
    if (!response)
        return; /* no memory: the connection closes */
    headers_add(response, request, reply, tag, &part);
    request->queued =
        MHD_queue_response(request->connection, (unsigned)reply->status, response) == MHD_YES;
    MHD_destroy_response(response);
    request->http->totals.by_class[reply->status / 100 % 6]++;
}

void http_problem_with(struct http_request *request, const struct wire_problem *problem,
                       const struct http_reply *with)
{
    struct http_reply reply = {
        .status = with->status ? with->status : http_problem_status(problem->code),
        .media_type = "application/problem+json",
        .allow = with->allow,
        .retry_after_s =
            with->retry_after_s ? with->retry_after_s : problem_table[problem->code].retry_after_s};
    reply.text = wire_problem_write(problem, reply.status, request->id);
    reply.bytes = reply.text ? strlen(reply.text) : 0;
    http_answer(request, &reply);
}

void http_problem(struct http_request *request, const struct wire_problem *problem)
{
    struct http_reply reply = {0};
    http_problem_with(request, problem, &reply);
}

void http_text(struct http_request *request, int status, const char *media_type, char *text)
{
    if (!text) {
        struct wire_problem problem = {0};
        wire_problem_set(&problem, WIRE_PROBLEM_INTERNAL, "no memory for the answer");
        http_problem(request, &problem);
        return;
    }
    struct http_reply reply = {
        .status = status, .media_type = media_type, .text = text, .bytes = strlen(text)};
    http_answer(request, &reply);
}

void http_send_too_large(struct http_request *request)
{
    struct wire_problem problem = {0};
    char head[512];
    wire_problem_set(&problem, WIRE_PROBLEM_TOO_LARGE, "a body has at most %u bytes",
                     WIRE_BODY_MAX);
    char *text = wire_problem_write(&problem, 413, request->id);
    if (!text)
        return;
    int n = snprintf(head, sizeof head,
                     "HTTP/1.1 413 Content Too Large\r\nContent-Type: application/problem+json\r\n"
                     "X-Request-Id: %s\r\nX-Content-Type-Options: nosniff\r\n"
                     "Cache-Control: no-store\r\nConnection: close\r\nContent-Length: %zu\r\n\r\n",
                     request->id, strlen(text));
    http_linger(request->http, request->peer);
    /* A fresh socket buffer takes these few bytes whole; a client that filled it gets nothing. */
    if (n > 0 && send(request->peer->fd, head, (size_t)n, MSG_NOSIGNAL | MSG_DONTWAIT) == n)
        (void)send(request->peer->fd, text, strlen(text), MSG_NOSIGNAL | MSG_DONTWAIT);
    request->http->totals.by_class[4]++;
    free(text);
}
