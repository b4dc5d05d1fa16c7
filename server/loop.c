/* The loop: one thread that owns every connection, drives HTTP, collects finished work, drains. */
#include "server/loop.h"

#include "server/api.h"
#include "server/clock.h"
#include "server/log.h"

#include <errno.h>
#include <signal.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/signalfd.h>
#include <unistd.h>

#define TICK_MS 100

struct loop {
    uv_loop_t uv;
    uv_poll_t http_poll, watch_poll, wake_poll, signal_poll;
    uv_timer_t http_timer, tick_timer;
    struct server *server;
    int wake_fd, signal_fd;
    bool announced;
    uint64_t deadline_ns; /* of the phase */
    unsigned signals;
};

static void pump(struct loop *loop);

/* ---- draining ----------------------------------------------------------------------------------
 */

static void phase_enter(struct loop *loop, enum server_phase phase, unsigned seconds)
{
    static const char *const words[] = {"running", "draining", "cancelling", "closing"};
    struct server *server = loop->server;
    server->phase = phase;
    loop->deadline_ns = clock_ns() + seconds * CLOCK_NS_PER_S;
    log_event(LOG_INFO, "phase", "phase=%s jobs=%zu pending=%zu", words[phase],
              records_live_count(server->records), http_pending(server->http));
}

/* Moves from phase to phase as far as things stand. New connections are taken until the work is
 * done, so that everybody is told 503 instead of being refused. */
static void drain_advance(struct loop *loop)
{
    struct server *server = loop->server;
    bool late = clock_ns() > loop->deadline_ns;
    size_t jobs = records_live_count(server->records);
    if (server->phase == SERVER_DRAINING && jobs > 0 && (late || loop->signals > 1)) {
        records_cancel_all(server->records, server->queue);
        api_render_collect(server);
        http_run(server->http);
        phase_enter(loop, SERVER_CANCELLING, LOOP_CANCEL_S);
        jobs = records_live_count(server->records);
        late = false;
    }
    if ((server->phase == SERVER_DRAINING || server->phase == SERVER_CANCELLING) &&
        (jobs == 0 || late)) {
        http_quiesce(server->http);
        phase_enter(loop, SERVER_CLOSING, LOOP_CLOSE_S);
        late = false;
    }
    if (server->phase == SERVER_CLOSING && (http_pending(server->http) == 0 || late))
        uv_stop(&loop->uv);
}

static void on_signal(uv_poll_t *handle, int status, int events)
{
    struct loop *loop = handle->data;
    struct signalfd_siginfo signal;
    (void)status;
    (void)events;
    if (read(loop->signal_fd, &signal, sizeof signal) != sizeof signal)
        return;
    loop->signals++;
    log_event(LOG_INFO, "signal", "number=%u count=%u", signal.ssi_signo, loop->signals);
    if (loop->server->phase == SERVER_RUNNING) {
        http_close_after_answers(loop->server->http);
        phase_enter(loop, SERVER_DRAINING, LOOP_DRAIN_S);
    }
    pump(loop);
}

/* ---- events ------------------------------------------------------------------------------------
 */

static void announce(struct loop *loop)
{
    struct server *server = loop->server;
    if (loop->announced || server->phase != SERVER_RUNNING || !scenes_scanned(server->scenes))
        return;
    loop->announced = true;
    struct scenes_totals scenes = scenes_totals(server->scenes);
    log_event(LOG_INFO, "ready", "url=%s workers=%llu scenes_ready=%llu scenes_loading=%llu",
              server->address->url, (unsigned long long)server->config->workers,
              (unsigned long long)scenes.ready, (unsigned long long)scenes.loading);
    printf("ready %s\n", server->address->url);
    fflush(stdout);
}

static void on_http_timer(uv_timer_t *handle)
{
    pump(handle->data);
}

/* Lets the library work, and arms its timer anew. */
static void pump(struct loop *loop)
{
    struct server *server = loop->server;
    http_run(server->http);
    if (server->phase != SERVER_RUNNING)
        drain_advance(loop);
    int64_t ms = http_timeout_ms(server->http);
    if (ms < 0)
        uv_timer_stop(&loop->http_timer);
    else
        uv_timer_start(&loop->http_timer, on_http_timer, (uint64_t)ms, 0);
}

static void on_http(uv_poll_t *handle, int status, int events)
{
    (void)status;
    (void)events;
    pump(handle->data);
}

static void on_watch(uv_poll_t *handle, int status, int events)
{
    struct loop *loop = handle->data;
    (void)status;
    (void)events;
    http_run_watches(loop->server->http);
    pump(loop);
}

static void on_wake(uv_poll_t *handle, int status, int events)
{
    struct loop *loop = handle->data;
    uint64_t count;
    (void)status;
    (void)events;
    (void)!read(loop->wake_fd, &count, sizeof count);
    api_render_collect(loop->server);
    announce(loop);
    pump(loop);
}

/* Whether the queue moves: health says so when it does not. */
static void progress_note(struct server *server, uint64_t now_ns)
{
    struct queue_state queue = queue_state(server->queue);
    if (queue.waiting + queue.running > 0 && queue.progress == server->progress)
        return;
    server->progress = queue.progress;
    server->progress_ns = now_ns;
}

static void on_tick(uv_timer_t *handle)
{
    struct loop *loop = handle->data;
    struct server *server = loop->server;
    uint64_t now_ns = clock_ns();
    http_tick(server->http);
    if (records_expire(server->records, now_ns))
        background_sweep(server->background);
    progress_note(server, now_ns);
    pump(loop);
}

/* ---- life --------------------------------------------------------------------------------------
 */

struct loop *loop_create(struct server *server, int wake_fd)
{
    struct loop *loop = calloc(1, sizeof *loop);
    if (!loop)
        return NULL;
    loop->server = server;
    loop->wake_fd = wake_fd;
    sigset_t signals;
    sigemptyset(&signals);
    sigaddset(&signals, SIGTERM);
    sigaddset(&signals, SIGINT);
    /* For good: handlers end with the loop, and a signal that comes later would end the process. */
    if (pthread_sigmask(SIG_BLOCK, &signals, NULL) != 0)
        goto fail;
    loop->signal_fd = signalfd(-1, &signals, SFD_CLOEXEC | SFD_NONBLOCK);
    if (loop->signal_fd < 0)
        goto fail;
    if (uv_loop_init(&loop->uv) != 0) {
        close(loop->signal_fd);
        goto fail;
    }
    return loop;
fail:
    free(loop);
    return NULL;
}

uv_loop_t *loop_uv(struct loop *loop)
{
    return &loop->uv;
}

static int poll_begin(struct loop *loop, uv_poll_t *poll, int fd, uv_poll_cb callback)
{
    int failed = uv_poll_init(&loop->uv, poll, fd);
    poll->data = loop;
    return failed ? failed : uv_poll_start(poll, UV_READABLE, callback);
}

int loop_run(struct loop *loop)
{
    struct server *server = loop->server;
    int failed;
    server->progress_ns = clock_ns();
    (void)uv_timer_init(&loop->uv, &loop->http_timer);
    (void)uv_timer_init(&loop->uv, &loop->tick_timer);
    loop->http_timer.data = loop;
    loop->tick_timer.data = loop;
    if ((failed = poll_begin(loop, &loop->signal_poll, loop->signal_fd, on_signal)) ||
        (failed = poll_begin(loop, &loop->http_poll, http_epoll_fd(server->http), on_http)) ||
        (failed = poll_begin(loop, &loop->watch_poll, http_watch_fd(server->http), on_watch)) ||
        (failed = poll_begin(loop, &loop->wake_poll, loop->wake_fd, on_wake)) ||
        (failed = uv_timer_start(&loop->tick_timer, on_tick, TICK_MS, TICK_MS))) {
        log_event(LOG_ERROR, "loop_failed", "error=%s", uv_strerror(failed));
        return 1;
    }
    announce(loop);
    pump(loop);
    uv_run(&loop->uv, UV_RUN_DEFAULT);
    return 0;
}

static void close_handle(uv_handle_t *handle, void *unused)
{
    (void)unused;
    if (!uv_is_closing(handle))
        uv_close(handle, NULL);
}

void loop_destroy(struct loop **pointer)
{
    struct loop *loop = *pointer;
    if (!loop)
        return;
    uv_walk(&loop->uv, close_handle, NULL);
    uv_run(&loop->uv, UV_RUN_DEFAULT); /* closes the handles, and waits for the pool */
    (void)uv_loop_close(&loop->uv);
    close(loop->signal_fd);
    free(loop);
    *pointer = NULL;
}
