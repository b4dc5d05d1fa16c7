/* The result document of a job, and the job's own. */
#include "protocol/tree.h"

#include <inttypes.h>
#include <stdio.h>

/* 0 where there is nothing to divide by: then there is nothing to divide either. */
static double ratio(uint64_t a, uint64_t b)
{
    return b ? (double)a / (double)b : 0.0;
}

static uint32_t at_most(uint32_t count, uint32_t limit)
{
    return count < limit ? count : limit;
}

static void write_classes(struct wire_tree *tree, const char *name,
                          const struct wire_class_count *counts, uint32_t count)
{
    wire_tree_open(tree, name);
    for (uint32_t i = 0; i < count; i++) {
        char key[16];
        snprintf(key, sizeof key, "%" PRIu32, counts[i].key);
        wire_tree_u64(tree, key, counts[i].pixels);
    }
    wire_tree_close(tree);
}

static void write_counters(struct wire_tree *tree, const struct wire_counters *counters)
{
    uint64_t hit = counters->pixels > counters->pixels_background
                       ? counters->pixels - counters->pixels_background
                       : 0;
    wire_tree_open(tree, "counters");
    wire_tree_u64(tree, "rays", counters->rays);
    wire_tree_u64(tree, "rays_hit", counters->rays_hit);
    wire_tree_u64(tree, "rays_discarded", counters->rays_discarded);
    wire_tree_f64(tree, "rays_per_pixel", ratio(counters->rays, counters->pixels));
    wire_tree_f64(tree, "rays_per_hit_pixel", ratio(counters->rays_hit, hit));
    wire_tree_u64(tree, "traversal_steps", counters->traversal_steps);
    wire_tree_u64(tree, "pixels", counters->pixels);
    wire_tree_u64(tree, "pixels_background", counters->pixels_background);
    write_classes(tree, "pixels_by_rays", counters->pixels_by_rays,
                  at_most(counters->ray_class_count, WIRE_CLASSES_MAX));
    write_classes(tree, "pixels_by_level", counters->pixels_by_level,
                  at_most(counters->level_count, WIRE_LEVELS_MAX));
    wire_tree_close(tree);
}

static void write_probe(struct wire_tree *tree, const struct wire_probe *probe)
{
    wire_tree_open(tree, NULL);
    wire_tree_u64(tree, "index", probe->index);
    wire_tree_vec3(tree, "position", probe->position_m);
    wire_tree_open_list(tree, "warnings");
    for (uint32_t i = 0; i < at_most(probe->warning_count, WIRE_WARNINGS_MAX); i++)
        wire_tree_text(tree, NULL, probe->warnings[i]);
    wire_tree_close(tree);
    write_counters(tree, &probe->counters);
    wire_tree_text(tree, "film_sha256", probe->film_sha256);
    wire_tree_open_list(tree, "images");
    for (uint32_t i = 0; i < at_most(probe->image_count, WIRE_IMAGES_MAX); i++) {
        wire_tree_open(tree, NULL);
        wire_tree_text(tree, "href", probe->images[i].href);
        wire_tree_text(tree, "sha256", probe->images[i].sha256);
        wire_tree_u64(tree, "bytes", probe->images[i].bytes);
        wire_tree_close(tree);
    }
    wire_tree_close(tree);
    wire_tree_close(tree);
}

char *wire_result_write(const struct wire_result *result)
{
    const struct wire_job *job = &result->request;
    struct wire_tree tree;
    wire_tree_begin(&tree);
    wire_tree_text(&tree, "id", result->id);
    wire_tree_text(&tree, "kind", wire_kind_text(job->kind));
    wire_tree_text(&tree, "state", "done");
    wire_tree_open(&tree, "scene");
    wire_tree_text(&tree, "name", job->scene);
    wire_tree_text(&tree, "sha256", result->scene_sha256);
    wire_tree_close(&tree);
    wire_tree_open(&tree, "request");
    wire_tree_job(&tree, job);
    wire_tree_close(&tree);
    wire_tree_open_list(&tree, "probes");
    write_probe(&tree, &result->probe);
    wire_tree_close(&tree);
    wire_tree_open(&tree, "totals");
    wire_tree_u64(&tree, "rays", result->probe.counters.rays);
    wire_tree_u64(&tree, "traversal_steps", result->probe.counters.traversal_steps);
    wire_tree_close(&tree);
    wire_tree_open(&tree, "seconds");
    wire_tree_f64(&tree, "queued", result->queued_s);
    wire_tree_f64(&tree, "render", result->render_s);
    wire_tree_f64(&tree, "encode", result->encode_s);
    wire_tree_close(&tree);
    wire_tree_open(&tree, "reproduce");
    wire_tree_text(&tree, "engine", result->engine);
    wire_tree_u64(&tree, "seed", job->seed);
    wire_tree_text(&tree, "kernel", result->kernel);
    wire_tree_close(&tree);
    return wire_tree_end(&tree);
}

char *wire_job_status_write(const struct wire_job_status *status)
{
    struct wire_tree tree;
    wire_tree_begin(&tree);
    wire_tree_text(&tree, "id", status->id);
    wire_tree_text(&tree, "kind", wire_kind_text(status->kind));
    wire_tree_text(&tree, "state", status->state);
    if (status->reason)
        wire_tree_text(&tree, "reason", status->reason);
    wire_tree_open(&tree, "progress");
    wire_tree_u64(&tree, "done", status->done);
    wire_tree_u64(&tree, "total", status->total);
    wire_tree_f64(&tree, "fraction", ratio(status->done, status->total));
    wire_tree_u64(&tree, "rays", status->rays);
    wire_tree_close(&tree);
    return wire_tree_end(&tree);
}
