/* The handlers of all routes, and the table that names them. All on the loop thread. */
#ifndef API_H
#define API_H

#include "server/server.h"

extern const struct route api_routes[];
extern const size_t api_route_count;

/* api_render.c */
void api_render(struct http_request *request);
/* Gives up the work of a waiting request. For http_params.abandon. */
void api_render_abandon(struct http_request *request);
/* Takes back what the workers finished, and lets waiting requests answer. */
void api_render_collect(struct server *server);

/* api_jobs.c */
void api_job(struct http_request *request);
void api_job_result(struct http_request *request);
void api_job_picture(struct http_request *request);

/* api_scenes.c */
void api_scenes(struct http_request *request);
void api_scene(struct http_request *request);

/* api_ops.c */
void api_index(struct http_request *request);
void api_health_live(struct http_request *request);
void api_health_ready(struct http_request *request);
void api_stats(struct http_request *request);

#endif
