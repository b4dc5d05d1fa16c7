/* For operators: the page at /, health, statistics. */
#include "server/api.h"

#include "server/clock.h"

#include <inttypes.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

/* ---- health ------------------------------------------------------------------------------------
 */

void api_health_live(struct http_request *request)
{
    http_text(request, 200, "application/json", strdup("{\"live\":true}\n"));
}

/* NULL: ready. */
static const char *unready_reason(struct server *server)
{
    if (server->phase != SERVER_RUNNING)
        return "draining";
    if (!scenes_scanned(server->scenes))
        return "loading";
    if (clock_ns() - server->progress_ns > SERVER_STALLED_NS)
        return "queue_stalled";
    return NULL;
}

void api_health_ready(struct http_request *request)
{
    const char *reason = unready_reason(request->server);
    char *text = NULL;
    if (!reason) {
        http_text(request, 200, "application/json", strdup("{\"ready\":true}\n"));
        return;
    }
    if (asprintf(&text, "{\"ready\":false,\"reason\":\"%s\"}\n", reason) < 0)
        text = NULL;
    if (!text) {
        http_text(request, 503, "application/json", NULL);
        return;
    }
    struct http_reply reply = {.status = 503,
                               .media_type = "application/json",
                               .text = text,
                               .bytes = strlen(text),
                               .retry_after_s = 1};
    http_answer(request, &reply);
}

/* ---- statistics --------------------------------------------------------------------------------
 */

static void stats_queue(struct wire_doc *doc, const struct server *server)
{
    struct queue_state queue = queue_state(server->queue);
    wire_doc_open(doc, "workers");
    wire_doc_u64(doc, "count", server->config->workers);
    wire_doc_u64(doc, "busy", queue.busy);
    wire_doc_close(doc);
    wire_doc_open(doc, "queue");
    wire_doc_u64(doc, "waiting", queue.waiting);
    wire_doc_u64(doc, "running", queue.running);
    wire_doc_u64(doc, "limit", queue.limit);
    wire_doc_close(doc);
    wire_doc_open(doc, "renders");
    wire_doc_u64(doc, "done", server->renders.done);
    wire_doc_u64(doc, "failed", server->renders.failed);
    wire_doc_u64(doc, "cancelled", server->renders.cancelled);
    wire_doc_u64(doc, "refused", server->renders.refused);
    wire_doc_close(doc);
    wire_doc_u64(doc, "rays", queue.rays);
    wire_doc_u64(doc, "traversal_steps", queue.traversal_steps);
}

static void stats_space(struct wire_doc *doc, const struct server *server)
{
    struct scenes_totals scenes = scenes_totals(server->scenes);
    struct results_usage results = results_usage(server->results);
    wire_doc_open(doc, "scenes");
    wire_doc_u64(doc, "ready", scenes.ready);
    wire_doc_u64(doc, "loading", scenes.loading);
    wire_doc_u64(doc, "failed", scenes.failed);
    wire_doc_u64(doc, "bytes", scenes.bytes);
    wire_doc_close(doc);
    wire_doc_open(doc, "results");
    wire_doc_u64(doc, "count", results.files);
    wire_doc_u64(doc, "bytes", results.used_bytes);
    wire_doc_u64(doc, "reserved_bytes", results.reserved_bytes);
    wire_doc_u64(doc, "limit_bytes", results.limit_bytes);
    wire_doc_close(doc);
    wire_doc_open(doc, "memory");
    wire_doc_u64(doc, "admitted_bytes", server->memory_used_bytes);
    wire_doc_u64(doc, "limit_bytes", server->memory_limit_bytes);
    wire_doc_close(doc);
}

static void stats_http(struct wire_doc *doc, const struct server *server)
{
    static const char *const classes[] = {"1xx", "2xx", "3xx", "4xx", "5xx"};
    struct http_totals http = http_totals(server->http);
    wire_doc_open(doc, "http");
    wire_doc_open(doc, "requests");
    for (size_t i = 1; i < sizeof classes / sizeof classes[0]; i++)
        wire_doc_u64(doc, classes[i], http.by_class[i + 1]);
    wire_doc_close(doc);
    wire_doc_u64(doc, "connections", http.connections);
    wire_doc_u64(doc, "accepted", http.accepted);
    wire_doc_u64(doc, "cut", http.cut);
    wire_doc_close(doc);
}

void api_stats(struct http_request *request)
{
    struct server *server = request->server;
    uint64_t now = clock_ns();
    if (!server->stats_text || now - server->stats_ns > SERVER_STATS_EVERY_NS) {
        struct wire_doc *doc = wire_doc_begin();
        wire_doc_text(doc, "version", LP_VERSION);
        wire_doc_f64(doc, "uptime_s", clock_seconds(now - server->begin_ns));
        stats_queue(doc, server);
        stats_space(doc, server);
        stats_http(doc, server);
        free(server->stats_text);
        server->stats_text = wire_doc_end(doc);
        server->stats_ns = now;
    }
    http_text(request, 200, "application/json",
              server->stats_text ? strdup(server->stats_text) : NULL);
}

/* ---- the page ----------------------------------------------------------------------------------
 */

/* Names of scenes and routes are of plain letters, so nothing here needs escaping. */
static void page_write(FILE *page, struct http_request *request)
{
    struct server *server = request->server;
    const char *url =
        server->address->kind == ADDRESS_TCP ? server->address->url : "http://localhost";
    char names[4096];
    scenes_names(server->scenes, names, sizeof names);
    fprintf(page,
            "<!doctype html><html lang=\"en\"><meta charset=\"utf-8\"><title>lightprobe</title>"
            "<style>body{font:16px/1.5 system-ui,sans-serif;max-width:50em;margin:2em auto;"
            "padding:0 1em}code,pre{background:#eee;padding:.1em .3em}td{padding-right:1.5em}"
            "</style><h1>lightprobe %s</h1><p>Bakes light probes from sparse voxel octrees.</p>"
            "<h2>Scenes</h2><p>%s</p><h2>Routes</h2><table>",
            LP_VERSION, names[0] ? names : "none yet: put a .lps file into the scenes folder");
    for (size_t i = 0; i < api_route_count; i++)
        if (api_routes[i].handler)
            fprintf(page, "<tr><td><code>%s %s</code><td>%s", api_routes[i].method,
                    api_routes[i].pattern, api_routes[i].doc);
    names[strcspn(names, ",")] = 0;
    double probe[3] = {0, 10, 0};
    struct scene *scene = NULL;
    struct wire_problem none = {0};
    if (scenes_acquire(server->scenes, &scene, &none, names) == WIRE_PROBLEM_NONE) {
        memcpy(probe, scene->about.scene.suggested_probe_m, sizeof probe);
        scenes_release(server->scenes, &scene);
    }
    fprintf(page,
            "</table><h2>Try it</h2><pre>curl -s %s/v1/scenes\n"
            "curl -s -X POST %s/v1/render -H 'Accept: image/png' -o probe.png \\\n"
            "  -d '{\"scene\":\"%s\",\"mode\":\"lod\",\"face_px\":64,"
            "\"probes\":[[%.9g,%.9g,%.9g]]}'</pre></html>\n",
            url, url, names[0] ? names : "NAME", probe[0], probe[1], probe[2]);
}

void api_index(struct http_request *request)
{
    char *text = NULL;
    size_t bytes = 0;
    FILE *page = open_memstream(&text, &bytes);
    if (page) {
        page_write(page, request);
        if (fclose(page) != 0) {
            free(text);
            text = NULL;
        }
    }
    http_text(request, 200, "text/html; charset=utf-8", text);
}
