/* The loop: one thread that owns every connection, drives HTTP, collects finished work, drains. */
#ifndef LOOP_H
#define LOOP_H

#include "server/server.h"

#define LOOP_DRAIN_S  10 /* running work may finish */
#define LOOP_CANCEL_S 5  /* cancelled work comes back */
#define LOOP_CLOSE_S  2  /* the last answers go out */

struct loop;

/* NULL: no memory or descriptors. `wake_fd` is the eventfd that other threads write to. Blocks
 * SIGTERM and SIGINT in this thread and in those that it starts from now on, until the end of the
 * process: loop_run reads them. */
struct loop *loop_create(struct server *server, int wake_fd);
/* For background_init, before loop_run. */
uv_loop_t *loop_uv(struct loop *loop);
/* Serves until a signal has drained the service. 0, or 1 when the loop itself failed. */
int loop_run(struct loop *loop);
/* Waits for the pool's work; server->http must be stopped. Accepts NULL and sets it. */
void loop_destroy(struct loop **loop);

#endif
