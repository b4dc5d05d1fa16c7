/* HTTP: the library's daemon, the loop's side of it, and the deadlines of slow clients. */
#include "server/clock.h"
#include "server/http_private.h"
#include "server/log.h"

#include <poll.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/epoll.h>
#include <sys/random.h>
#include <sys/resource.h>
#include <sys/socket.h>
#include <unistd.h>

#define POOL_BYTES   (32u << 10) /* of a connection: its head, and the buffers of its body */
#define IDLE_TICKS   16          /* between two looks at an idle connection */
#define RUNS_IN_VAIN 4           /* then the backlog is left */
#define FDS_AT_LEAST 256         /* files, scenes, watches, and the like */

__attribute__((format(printf, 2, 0))) static void on_library_log(void *cls, const char *format,
                                                                 va_list list)
{
    char text[256];
    (void)cls;
    vsnprintf(text, sizeof text, format, list);
    text[strcspn(text, "\n")] = 0;
    log_event(LOG_WARNING, "http_library", "text=%s", log_quote(text).text);
}

/* Raises the limit on descriptors as far as it goes, and returns how many connections fit: each
 * needs its socket and, while it answers, perhaps a file. */
static uint64_t connections_that_fit(uint64_t wanted)
{
    struct rlimit limit;
    if (getrlimit(RLIMIT_NOFILE, &limit) < 0)
        return wanted < 256 ? wanted : 256;
    rlim_t needed = 2 * (wanted + HTTP_CONNECTIONS_EXTRA) + HTTP_LINGERS_MAX + FDS_AT_LEAST;
    if (limit.rlim_cur < needed) {
        limit.rlim_cur = limit.rlim_max < needed ? limit.rlim_max : needed;
        (void)setrlimit(RLIMIT_NOFILE, &limit);
        (void)getrlimit(RLIMIT_NOFILE, &limit);
    }
    if (limit.rlim_cur >= needed)
        return wanted;
    rlim_t rest = 2 * HTTP_CONNECTIONS_EXTRA + HTTP_LINGERS_MAX + FDS_AT_LEAST;
    uint64_t fit = limit.rlim_cur > rest + 16 ? (limit.rlim_cur - rest) / 2 : 8;
    log_event(LOG_WARNING, "few_descriptors", "limit=%llu connections=%llu",
              (unsigned long long)limit.rlim_cur, (unsigned long long)fit);
    return fit;
}

enum lp_code http_start(struct http **out, const struct http_params *params, struct lp_error *err)
{
    struct http *http = calloc(1, sizeof *http);
    if (!http)
        return lp_fail(err, LP_NO_MEMORY, "http", "no memory for the HTTP server");
    http->params = *params;
    http->params.connection_limit = connections_that_fit(params->connection_limit);
    if (getrandom(&http->run, sizeof http->run, 0) != sizeof http->run)
        http->run = clock_ns();
    http->watch_fd = epoll_create1(EPOLL_CLOEXEC);
    if (http->watch_fd < 0)
        goto fail;
    http->daemon = MHD_start_daemon(
        MHD_USE_EPOLL | MHD_ALLOW_SUSPEND_RESUME | MHD_USE_ERROR_LOG, 0, NULL, NULL,
        http_on_request, http, MHD_OPTION_EXTERNAL_LOGGER, on_library_log, NULL,
        MHD_OPTION_LISTEN_SOCKET, params->listen_fd, MHD_OPTION_CONNECTION_LIMIT,
        (unsigned)(http->params.connection_limit + HTTP_CONNECTIONS_EXTRA),
        MHD_OPTION_CONNECTION_TIMEOUT, (unsigned)HTTP_IDLE_DEADLINE_S,
        MHD_OPTION_CONNECTION_MEMORY_LIMIT, (size_t)POOL_BYTES, MHD_OPTION_URI_LOG_CALLBACK,
        http_on_target, http, MHD_OPTION_NOTIFY_COMPLETED, http_on_completed, http,
        MHD_OPTION_NOTIFY_CONNECTION, http_on_connection, http, MHD_OPTION_SIGPIPE_HANDLED_BY_APP,
        1, MHD_OPTION_END);
    if (!http->daemon)
        goto fail;
    *out = http;
    return LP_OK;
fail:
    if (http->watch_fd >= 0)
        close(http->watch_fd);
    free(http);
    return lp_fail(err, LP_IO, "http", "the HTTP server cannot be started");
}

/* Whoever is in the backlog was let in by the system already, and would be reset: accepts them. One
 * run of the library accepts a few, and none when there are too many connections or descriptors. */
static void backlog_take(struct http *http)
{
    struct pollfd listener = {.fd = http->params.listen_fd, .events = POLLIN};
    const uint64_t enough = http->totals.accepted + ADDRESS_BACKLOG + 1; /* others may come */
    int in_vain = 0;
    while (in_vain < RUNS_IN_VAIN && http->totals.accepted < enough && poll(&listener, 1, 0) > 0) {
        uint64_t before = http->totals.accepted;
        MHD_run(http->daemon);
        in_vain = http->totals.accepted == before ? in_vain + 1 : 0;
    }
    MHD_run(http->daemon); /* what the last ones have sent is read by the run after */
}

void http_quiesce(struct http *http)
{
    if (http->quiesced)
        return;
    backlog_take(http);
    int listen_fd = MHD_quiesce_daemon(http->daemon);
    if (listen_fd >= 0)
        close(listen_fd);
    http->quiesced = true;
}

void http_stop(struct http **pointer)
{
    struct http *http = *pointer;
    if (!http)
        return;
    http_quiesce(http);
    /* The library aborts the process when it is stopped with suspended connections: wake them, and
     * let none of those that come to their handler in the last run fall asleep again. */
    http->stopping = true;
    for (struct http_connection *peer = http->connections; peer; peer = peer->next)
        if (peer->request && peer->request->phase == HTTP_WAITING) {
            peer->request->left = true;
            http->params.abandon(peer->request);
            http_resume(peer->request);
        }
    MHD_run(http->daemon);
    MHD_stop_daemon(http->daemon);
    http_linger_finish(http);
    close(http->watch_fd);
    free(http);
    *pointer = NULL;
}

int http_epoll_fd(const struct http *http)
{
    return MHD_get_daemon_info(http->daemon, MHD_DAEMON_INFO_EPOLL_FD)->epoll_fd;
}

int http_watch_fd(const struct http *http)
{
    return http->watch_fd;
}

void http_run(struct http *http)
{
    MHD_run(http->daemon);
}

int64_t http_timeout_ms(const struct http *http)
{
    MHD_UNSIGNED_LONG_LONG ms = 0;
    if (MHD_get_timeout(http->daemon, &ms) != MHD_YES)
        return -1;
    return ms > 60000 ? 60000 : (int64_t)ms;
}

/* Whether a client has had its time: idle, dawdling over its headers, or over its body. The
 * library's own time-out begins anew with every byte, so that slow clients would live for ever. */
static bool is_too_slow(const struct http_connection *peer, uint64_t now_ns)
{
    const struct http_request *request = peer->request;
    if (!request)
        return now_ns - peer->since_ns > HTTP_IDLE_DEADLINE_S * CLOCK_NS_PER_S;
    uint64_t age_ns = now_ns - request->begin_ns;
    if (request->phase == HTTP_HEAD)
        return age_ns > HTTP_HEAD_DEADLINE_S * CLOCK_NS_PER_S;
    if (request->phase == HTTP_BODY)
        return age_ns > (HTTP_BODY_GRACE_S + request->body_bytes / HTTP_BODY_RATE) * CLOCK_NS_PER_S;
    return false;
}

/* Whether a client left before its request was whole, or between requests. The library does not see
 * it when the end of the stream came together with bytes: its epoll tells of both once, and it
 * reads once. Idle connections, of which there may be many, are looked at less often. */
static bool has_left(const struct http *http, struct http_connection *peer)
{
    const struct http_request *request = peer->request;
    bool coming = request && (request->phase == HTTP_HEAD || request->phase == HTTP_BODY);
    if (request ? !coming : (http->ticks + (unsigned)peer->fd) % IDLE_TICKS != 0)
        return false;
    /* Seen twice: between two ticks the library takes in all that it has read. */
    bool ended = peer->ended;
    char byte;
    peer->ended = recv(peer->fd, &byte, 1, MSG_PEEK | MSG_DONTWAIT) == 0;
    return ended && peer->ended;
}

void http_tick(struct http *http)
{
    uint64_t now_ns = clock_ns();
    http->ticks++;
    for (struct http_connection *peer = http->connections; peer; peer = peer->next) {
        if (peer->cut)
            continue;
        bool slow = is_too_slow(peer, now_ns);
        if (!slow && !has_left(http, peer))
            continue;
        /* The library sees the shutdown and cleans up. */
        peer->cut = true;
        (void)shutdown(peer->fd, SHUT_RDWR);
        http->totals.cut += slow && peer->request;
    }
    http_linger_tick(http, now_ns);
}

void http_close_after_answers(struct http *http)
{
    http->closing = true;
}

size_t http_pending(const struct http *http)
{
    return http->pending;
}

struct http_totals http_totals(const struct http *http)
{
    return http->totals;
}
