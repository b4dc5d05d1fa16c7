/* A request from its first byte to its handler: gate, route, body. */
#include "server/clock.h"
#include "server/gate.h"
#include "server/http_private.h"

#include <inttypes.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#define BODY_FIRST_BYTES 4096

/* ---- life --------------------------------------------------------------------------------------
 */

void http_on_connection(void *cls, struct MHD_Connection *connection, void **context,
                        enum MHD_ConnectionNotificationCode what)
{
    struct http *http = cls;
    struct http_connection *peer = *context;
    if (what == MHD_CONNECTION_NOTIFY_STARTED) {
        peer = calloc(1, sizeof *peer);
        *context = peer; /* NULL: http_on_target refuses its requests */
        if (!peer)
            return;
        peer->fd =
            MHD_get_connection_info(connection, MHD_CONNECTION_INFO_CONNECTION_FD)->connect_fd;
        peer->since_ns = clock_ns();
        peer->overflow = http->totals.connections >= http->params.connection_limit;
        peer->next = http->connections;
        if (peer->next)
            peer->next->previous = peer;
        http->connections = peer;
        http->totals.connections++;
        http->totals.accepted++;
        return;
    }
    if (!peer)
        return;
    if (peer->next)
        peer->next->previous = peer->previous;
    if (peer->previous)
        peer->previous->next = peer->next;
    else
        http->connections = peer->next;
    http->totals.connections--;
    free(peer);
    *context = NULL;
}

void *http_on_target(void *cls, const char *target, struct MHD_Connection *connection)
{
    struct http *http = cls;
    struct http_connection *peer =
        MHD_get_connection_info(connection, MHD_CONNECTION_INFO_SOCKET_CONTEXT)->socket_context;
    struct http_request *request = peer && target ? calloc(1, sizeof *request) : NULL;
    if (!request)
        return NULL;
    request->http = http;
    request->server = http->params.server;
    request->peer = peer;
    request->connection = connection;
    request->begin_ns = clock_ns();
    request->target = target;
    request->target_bytes = strlen(target);
    request->target_is_odd = strstr(target, "%00") || strchr(target, ' ');
    peer->request = request;
    http->pending++;
    return request;
}

void http_on_completed(void *cls, struct MHD_Connection *connection, void **pointer,
                       enum MHD_RequestTerminationCode why)
{
    struct http *http = cls;
    struct http_request *request = *pointer;
    (void)connection;
    (void)why; /* it says "completed" even of clients that are gone */
    if (!request)
        return;
    http_watch_end(request);
    if (request->phase == HTTP_WAITING || request->job || request->reading)
        http->params.abandon(request);
    request->peer->request = NULL;
    request->peer->since_ns = clock_ns();
    http->bodies_bytes -= request->body_room;
    http->pending--;
    free(request->body);
    free(request);
    *pointer = NULL;
}

/* ---- the head ----------------------------------------------------------------------------------
 */

static enum MHD_Result gate_take(void *cls, enum MHD_ValueKind kind, const char *name,
                                 const char *value)
{
    (void)kind;
    gate_header(cls, name, value);
    return MHD_YES;
}

static bool request_id_ok(const char *text)
{
    size_t n = strlen(text);
    return n >= 1 && n <= 64 &&
           strspn(text, "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789._-") == n;
}

static void request_id_set(struct http_request *request)
{
    struct http *http = request->http;
    const char *given =
        MHD_lookup_connection_value(request->connection, MHD_HEADER_KIND, "X-Request-Id");
    if (given && request_id_ok(given))
        snprintf(request->id, sizeof request->id, "%s", given);
    else
        snprintf(request->id, sizeof request->id, "%08" PRIx32 "-%" PRIx64, (uint32_t)http->run,
                 ++http->request_number);
}

static void refuse_route(struct http_request *request)
{
    struct wire_problem problem = {0};
    const struct route_match *match = &request->match;
    if (match->verdict == ROUTE_WRONG_METHOD ||
        (match->verdict == ROUTE_LATER && match->allow[0])) {
        struct http_reply reply = {.allow = match->allow};
        wire_problem_set(&problem, WIRE_PROBLEM_METHOD_NOT_ALLOWED, "%s%s; here there is %s",
                         match->verdict == ROUTE_LATER ? "this method is not in this version"
                                                       : "this address does not know this method",
                         "", match->allow);
        http_problem_with(request, &problem, &reply);
        return;
    }
    if (match->verdict == ROUTE_LATER)
        wire_problem_set(&problem, WIRE_PROBLEM_UNKNOWN_ROUTE, "%s %s is not in this version",
                         match->route->method, match->route->pattern);
    else
        wire_problem_set(&problem, WIRE_PROBLEM_UNKNOWN_ROUTE,
                         "there is nothing here; GET / lists the routes, the main ones are POST "
                         "/v1/render, GET /v1/scenes, GET /v1/stats");
    http_problem(request, &problem);
}

/* Looks at the whole head. True: the request goes on; false: it was answered. */
static bool head_take(struct http_request *request, const char *version)
{
    struct http *http = request->http;
    struct wire_problem problem = {0};
    struct gate gate = {.target_bytes = request->target_bytes,
                        .target_is_odd = request->target_is_odd,
                        .path = request->path,
                        .version = version};
    /* The library reads the target as a C text; its version text stands right behind the target in
     * the same buffer, so a NUL in between shows as a gap. */
    if (version > request->target && *version &&
        (size_t)(version - request->target) != request->target_bytes + 1)
        gate.target_is_odd = true;
    const union MHD_ConnectionInfo *info =
        MHD_get_connection_info(request->connection, MHD_CONNECTION_INFO_REQUEST_HEADER_SIZE);
    gate.header_bytes = info ? info->header_size : 0;
    MHD_get_connection_values(request->connection, MHD_HEADER_KIND, gate_take, &gate);
    request_id_set(request);
    request->has_body = gate_has_body(&gate);
    int status = gate_check(&gate, http->params.own, &problem);
    if (status) {
        struct http_reply reply = {.status = status};
        http_problem_with(request, &problem, &reply);
        return false;
    }
    if (request->peer->overflow) {
        wire_problem_set(&problem, WIRE_PROBLEM_BUSY, "too many connections are open; try later");
        http_problem(request, &problem);
        return false;
    }
    route_find(&request->match, http->params.routes, http->params.route_count, request->method,
               request->path);
    if (request->match.verdict != ROUTE_FOUND && request->has_body) {
        refuse_route(request); /* nobody wants the body */
        return false;
    }
    return true;
}

/* ---- the body ----------------------------------------------------------------------------------
 */

/* Makes room for `more` bytes; false: no memory, or too much is being uploaded at once. */
static bool body_grow(struct http_request *request, size_t more)
{
    struct http *http = request->http;
    size_t need = request->body_bytes + more, room = request->body_room;
    if (need <= room)
        return true;
    if (room == 0)
        room = BODY_FIRST_BYTES;
    while (room < need)
        room *= 2;
    if (http->bodies_bytes + (room - request->body_room) > HTTP_BODIES_BYTES_MAX)
        return false;
    char *body = realloc(request->body, room);
    if (!body)
        return false;
    http->bodies_bytes += room - request->body_room;
    request->body = body;
    request->body_room = room;
    return true;
}

/* Takes a piece in. False: the body is too large, and the connection has been answered past the
 * library. */
static bool body_take(struct http_request *request, const char *piece, size_t bytes)
{
    if (request->body_bytes + bytes > WIRE_BODY_MAX) {
        http_send_too_large(request);
        return false;
    }
    /* Only POST routes read bodies; others' are counted and dropped. */
    bool wanted =
        request->match.verdict == ROUTE_FOUND && strcmp(request->match.route->method, "POST") == 0;
    if (wanted && !request->body_refused) {
        if (body_grow(request, bytes))
            memcpy(request->body + request->body_bytes, piece, bytes);
        else
            request->body_refused = true;
    }
    request->body_bytes += bytes;
    return true;
}

/* ---- the handler -------------------------------------------------------------------------------
 */

static void dispatch(struct http_request *request)
{
    struct wire_problem problem = {0};
    const struct route *route = request->match.route;
    if (request->match.verdict != ROUTE_FOUND) {
        refuse_route(request);
    } else if (request->body_refused) {
        wire_problem_set(&problem, WIRE_PROBLEM_BUSY, "too much is being uploaded; try later");
        http_problem(request, &problem);
    } else if (route->produces && http_accept(request, &route->produces, 1) < 0) {
        wire_problem_set(&problem, WIRE_PROBLEM_NOT_ACCEPTABLE, "this address makes %s",
                         route->produces);
        http_problem(request, &problem);
    } else {
        route->handler(request);
    }
}

static enum MHD_Result verdict(const struct http_request *request)
{
    if (request->phase == HTTP_ANSWERED)
        return request->queued ? MHD_YES : MHD_NO;
    return MHD_YES;
}

enum MHD_Result http_on_request(void *cls, struct MHD_Connection *connection, const char *url,
                                const char *method, const char *version, const char *upload,
                                size_t *upload_bytes, void **pointer)
{
    struct http_request *request = *pointer;
    (void)cls;
    (void)connection;
    if (!request || request->left || request->http->stopping)
        return MHD_NO; /* no memory for it, nobody there, or the end: the connection closes */
    request->method = method;
    request->path = url;
    switch (request->phase) {
    case HTTP_HEAD:
        if (head_take(request, version))
            request->phase = HTTP_BODY;
        return verdict(request);
    case HTTP_BODY:
        if (*upload_bytes > 0) {
            bool fits = body_take(request, upload, *upload_bytes);
            *upload_bytes = 0;
            return fits ? MHD_YES : MHD_NO;
        }
        request->phase = HTTP_READY;
        /* The path stays where it was, but the match must not outlive a moved buffer. */
        route_find(&request->match, request->http->params.routes, request->http->params.route_count,
                   method, url);
        dispatch(request);
        return verdict(request);
    case HTTP_WAITING: /* resumed by the library itself, at its end */
        return MHD_NO;
    case HTTP_RESUMED:
        route_find(&request->match, request->http->params.routes, request->http->params.route_count,
                   method, url);
        request->match.route->handler(request);
        return verdict(request);
    case HTTP_READY:
    case HTTP_ANSWERED:
        *upload_bytes = 0;
        return MHD_YES;
    }
    return MHD_NO;
}

void http_wait(struct http_request *request)
{
    request->phase = HTTP_WAITING;
    MHD_suspend_connection(request->connection);
    http_watch_begin(request);
}

void http_resume(struct http_request *request)
{
    if (request->phase != HTTP_WAITING)
        return;
    http_watch_end(request);
    request->phase = HTTP_RESUMED;
    MHD_resume_connection(request->connection);
}

/* ---- reading -----------------------------------------------------------------------------------
 */

bool http_param(const struct http_request *request, size_t index, char *out, size_t room)
{
    if (index >= request->match.param_count || request->match.params[index].bytes >= room)
        return false;
    memcpy(out, request->match.params[index].text, request->match.params[index].bytes);
    out[request->match.params[index].bytes] = 0;
    return true;
}

const char *http_query(const struct http_request *request, const char *name)
{
    return MHD_lookup_connection_value(request->connection, MHD_GET_ARGUMENT_KIND, name);
}

struct accept_reading {
    struct accept_choice choice;
    const char *const *offers;
    size_t count;
};

static enum MHD_Result accept_take(void *cls, enum MHD_ValueKind kind, const char *name,
                                   const char *value)
{
    struct accept_reading *reading = cls;
    (void)kind;
    if (value && strcasecmp(name, "Accept") == 0)
        accept_header(&reading->choice, value, reading->offers, reading->count);
    return MHD_YES;
}

int http_accept(const struct http_request *request, const char *const *offers, size_t count)
{
    struct accept_reading reading = {.offers = offers, .count = count};
    MHD_get_connection_values(request->connection, MHD_HEADER_KIND, accept_take, &reading);
    return accept_best(&reading.choice, count);
}
