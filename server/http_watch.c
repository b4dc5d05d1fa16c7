/* Clients that leave while they wait, and sockets that are read away after an early answer. */
#include "server/clock.h"
#include "server/http_private.h"

#include <errno.h>
#include <fcntl.h>
#include <stdlib.h>
#include <sys/epoll.h>
#include <sys/socket.h>
#include <unistd.h>

#define EVENTS_MAX  64
#define BLOCK_BYTES (64u << 10)

/* The low bit of an event's tag tells a lingering socket from a waiting request. */
#define TAG_LINGER UINT64_C(1)

void http_watch_begin(struct http_request *request)
{
    /* While a connection is suspended the library neither polls nor closes its socket, so that the
     * descriptor stays good until http_watch_end. */
    struct epoll_event event = {.events = EPOLLRDHUP, .data.u64 = (uint64_t)(uintptr_t)request};
    request->watched =
        epoll_ctl(request->http->watch_fd, EPOLL_CTL_ADD, request->peer->fd, &event) == 0;
}

void http_watch_end(struct http_request *request)
{
    if (request->watched)
        (void)epoll_ctl(request->http->watch_fd, EPOLL_CTL_DEL, request->peer->fd, NULL);
    request->watched = false;
}

/* A waiting client hung up, or at least closed its side. */
static void on_hang_up(struct http_request *request)
{
    char byte;
    ssize_t n = recv(request->peer->fd, &byte, 1, MSG_PEEK | MSG_DONTWAIT);
    if (n < 0 && (errno == EAGAIN || errno == EINTR))
        return;
    http_watch_end(request);
    /* Bytes before the end: a pipelining client that closed its side for writing may still read. */
    if (n > 0)
        return;
    request->left = true;
    request->http->params.abandon(request);
    http_resume(request);
}

static void linger_end(struct http *http, struct http_linger *linger)
{
    struct http_linger **at = &http->lingers;
    while (*at != linger)
        at = &(*at)->next;
    *at = linger->next;
    /* An epoll holds the open file, not the descriptor: while the connection that this one is a
     * duplicate of is still open, closing alone would leave the entry, and its events would come
     * with this memory's address. */
    (void)epoll_ctl(http->watch_fd, EPOLL_CTL_DEL, linger->fd, NULL);
    close(linger->fd);
    free(linger);
    http->linger_count--;
}

static void on_linger(struct http *http, struct http_linger *linger)
{
    static const int rounds = 4; /* then others get their turn */
    char block[BLOCK_BYTES];
    for (int i = 0; i < rounds; i++) {
        ssize_t n = recv(linger->fd, block, sizeof block, MSG_DONTWAIT);
        if (n < 0 && (errno == EAGAIN || errno == EINTR))
            return;
        if (n > 0)
            linger->bytes += (size_t)n;
        if (n <= 0 || linger->bytes > HTTP_LINGER_BYTES_MAX) {
            linger_end(http, linger);
            return;
        }
    }
}

void http_run_watches(struct http *http)
{
    struct epoll_event events[EVENTS_MAX];
    int count = epoll_wait(http->watch_fd, events, EVENTS_MAX, 0);
    for (int i = 0; i < count; i++) {
        uint64_t tag = events[i].data.u64;
        if (tag & TAG_LINGER)
            on_linger(http, (struct http_linger *)(uintptr_t)(tag & ~TAG_LINGER));
        else
            on_hang_up((struct http_request *)(uintptr_t)tag);
    }
}

void http_linger(struct http *http, const struct http_connection *connection)
{
    if (http->linger_count >= HTTP_LINGERS_MAX)
        return;
    struct http_linger *linger = calloc(1, sizeof *linger);
    int fd = linger ? fcntl(connection->fd, F_DUPFD_CLOEXEC, 0) : -1;
    if (fd < 0) {
        free(linger);
        return;
    }
    linger->fd = fd;
    linger->until_ns = clock_ns() + HTTP_LINGER_S * CLOCK_NS_PER_S;
    struct epoll_event event = {.events = EPOLLIN,
                                .data.u64 = (uint64_t)(uintptr_t)linger | TAG_LINGER};
    if (epoll_ctl(http->watch_fd, EPOLL_CTL_ADD, fd, &event) < 0) {
        close(fd);
        free(linger);
        return;
    }
    linger->next = http->lingers;
    http->lingers = linger;
    http->linger_count++;
}

void http_linger_tick(struct http *http, uint64_t now_ns)
{
    for (struct http_linger *linger = http->lingers, *next; linger; linger = next) {
        next = linger->next;
        if (now_ns > linger->until_ns)
            linger_end(http, linger);
    }
}

void http_linger_finish(struct http *http)
{
    while (http->lingers)
        linger_end(http, http->lingers);
}
