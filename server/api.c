/* The one table of routes: what there is, and what a later version brings. */
#include "server/api.h"

#define JSON "application/json"
#define HTML "text/html"

const struct route api_routes[] = {
    {"GET", "/", api_index, HTML, "this page"},
    {"GET", "/v1/health/live", api_health_live, JSON, "200 while the process answers"},
    {"GET", "/v1/health/ready", api_health_ready, JSON, "200, or 503 with the reason"},
    {"GET", "/v1/stats", api_stats, JSON, "counters of the service"},
    {"GET", "/v1/scenes", api_scenes, JSON, "all scenes"},
    {"GET", "/v1/scenes/{name}", api_scene, JSON, "one scene"},
    {"POST", "/v1/render", api_render, NULL,
     "one probe, synchronously: JSON, PNG or EXR by Accept"},
    {"GET", "/v1/jobs/{id}", api_job, JSON, "state and progress of a job"},
    {"GET", "/v1/jobs/{id}/result", api_job_result, JSON, "its result document"},
    {"GET", "/v1/jobs/{id}/probes/{picture}", api_job_picture, NULL, "its picture: 0.png or 0.exr"},

    {"GET", "/metrics", NULL, NULL, NULL},
    {"GET", "/v1/openapi.json", NULL, NULL, NULL},
    {"GET", "/v1/tables", NULL, NULL, NULL},
    {"GET", "/v1/tables/{kind}", NULL, NULL, NULL},
    {"PUT", "/v1/scenes/{name}", NULL, NULL, NULL},
    {"DELETE", "/v1/scenes/{name}", NULL, NULL, NULL},
    {"POST", "/v1/jobs", NULL, NULL, NULL},
    {"GET", "/v1/jobs", NULL, NULL, NULL},
    {"GET", "/v1/jobs/{id}/events", NULL, NULL, NULL},
    {"DELETE", "/v1/jobs/{id}", NULL, NULL, NULL},
};
const size_t api_route_count = sizeof api_routes / sizeof api_routes[0];
