/* lightprobed: wiring and exit codes. The only owner of the long-lived things. */
#include "server/clock.h"
#include "server/loop.h"
#include "server/api.h"
#include "server/log.h"
#include "server/worker.h"

#include <signal.h>
#include <stdlib.h>
#include <string.h>
#include <sys/eventfd.h>
#include <unistd.h>

#define EXIT_DRAINED 0
#define EXIT_FAILED  1 /* while running */
#define EXIT_USAGE   2 /* could not start as configured */

#define JOIN_S 5 /* for threads to end after the last answer */

/* What main owns; released in reverse. */
struct daemon {
    struct config config;
    struct address address;
    struct data_dir dir;
    int listen_fd, wake_fd;
    bool listening; /* the address is ours to forget */
    struct workers *workers;
    struct loop *loop;
    struct background background;
    struct server server;
};

static int complain(const struct lp_error *error)
{
    fprintf(stderr, "lightprobed: %s%s%s\n", error->where, error->where[0] ? ": " : "",
            error->text);
    return EXIT_USAGE;
}

/* Starts everything up to the loop. On failure what was started is ended by daemon_stop. */
static enum lp_code daemon_start(struct daemon *d, struct lp_error *err)
{
    struct server *server = &d->server;
    enum lp_code code;
    *server = (struct server){.config = &d->config,
                              .address = &d->address,
                              .background = &d->background,
                              .begin_ns = clock_ns(),
                              .memory_limit_bytes = d->config.memory_limit_mib << 20};
    if ((code = data_dir_open(&d->dir, d->config.data, err)) ||
        (code = address_listen(&d->address, &d->listen_fd, err)))
        return code;
    d->listening = true;
    if ((code = results_create(&server->results, d->dir.results_fd,
                               d->config.results_limit_mib << 20, err)))
        return code;
    d->wake_fd = eventfd(0, EFD_CLOEXEC | EFD_NONBLOCK);
    server->records = records_create(server->results, d->config.result_retention_s * CLOCK_NS_PER_S,
                                     CONFIG_RETENTION_MIN * CLOCK_NS_PER_S);
    server->queue = queue_create((uint32_t)d->config.queue_limit, d->wake_fd);
    d->loop = loop_create(server, d->wake_fd);
    if (d->wake_fd < 0 || !server->records || !server->queue || !d->loop)
        return lp_fail(err, LP_NO_MEMORY, "start", "no memory or descriptors to start with");
    background_init(&d->background, loop_uv(d->loop), server->results, d->wake_fd);
    struct http_params params = {.listen_fd = d->listen_fd,
                                 .own = &d->address,
                                 .connection_limit = d->config.connection_limit,
                                 .server = server,
                                 .routes = api_routes,
                                 .route_count = api_route_count,
                                 .abandon = api_render_abandon};
    if ((code = workers_start(&d->workers, (uint32_t)d->config.workers, server->queue,
                              server->results, err)) ||
        (code = scenes_start(&server->scenes, &d->dir, d->wake_fd, err)) ||
        (code = http_start(&server->http, &params, err)))
        return code;
    d->listen_fd = -1; /* http's now */
    return LP_OK;
}

/* Ends what runs. A thread that does not end in time (a last encoder, a huge scene being checked)
 * is left to the end of the process. */
static void daemon_stop(struct daemon *d, int status)
{
    struct server *server = &d->server;
    uint64_t until_ns = clock_ns() + JOIN_S * CLOCK_NS_PER_S;
    http_stop(&server->http);
    if (d->listen_fd >= 0)
        close(d->listen_fd);
    if (d->listening)
        address_forget(&d->address);
    if (server->records && server->queue)
        records_cancel_all(server->records, server->queue);
    if (server->queue)
        queue_stop(server->queue);
    if (server->scenes)
        scenes_stop(server->scenes);
    loop_destroy(&d->loop);
    bool ended = workers_join(&d->workers, until_ns);
    /* Jobs that never came back still hold scenes: those go with the queue. */
    ended = scenes_join(&server->scenes, until_ns) && ended;
    if (!ended) {
        log_event(LOG_WARNING, "threads_left", "after_s=%d", JOIN_S);
        fflush(stdout);
        _exit(status);
    }
    queue_destroy(&server->queue);
    records_destroy(&server->records);
    results_destroy(&server->results);
    free(server->stats_text);
    if (d->wake_fd >= 0)
        close(d->wake_fd);
    data_dir_close(&d->dir);
}

static int serve(struct daemon *d)
{
    struct lp_error error = {0};
    struct sigaction ignore = {.sa_handler = SIG_IGN};
    int status;
    sigaction(SIGPIPE, &ignore, NULL);
    if (daemon_start(d, &error)) {
        status = complain(&error);
    } else {
        log_event(LOG_INFO, "start", "version=%s data=%s url=%s", LP_VERSION,
                  log_quote(d->dir.path).text, d->address.url);
        status = loop_run(d->loop) == 0 ? EXIT_DRAINED : EXIT_FAILED;
        log_event(LOG_INFO, "end", "status=%d", status);
    }
    daemon_stop(d, status);
    return status;
}

int main(int argc, char **argv)
{
    struct lp_error error = {0};
    enum config_action action;
    struct daemon *d = calloc(1, sizeof *d);
    if (!d)
        return EXIT_FAILED;
    d->listen_fd = -1;
    d->wake_fd = -1;
    int status = 0;
    if (config_read(&d->config, &action, argc, argv, &error)) {
        status = complain(&error);
        goto out;
    }
    if (action == CONFIG_HELP) {
        config_write_help(stdout);
        goto out;
    }
    if (action == CONFIG_VERSION) {
        printf("lightprobed %s\n", LP_VERSION);
        goto out;
    }
    if (address_parse(&d->address, d->config.listen, &error)) {
        status = complain(&error);
        goto out;
    }
    if (action == CONFIG_CHECK)
        config_write(&d->config, stdout);
    else
        status = serve(d);
out:
    free(d);
    return status;
}
