/* A wire job as the engine's parameters, and the engine's answers as wire structs. */
#include "server/bake.h"

#include "engine/image.h"
#include "engine/sha256.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

static enum lp_mode mode_of(enum wire_mode mode)
{
    return mode == WIRE_MODE_REFERENCE ? LP_MODE_REFERENCE : LP_MODE_LOD;
}

/* The field of a job that a field of lp_render_params came from. */
static const char *pointer_of(const char *field)
{
    static const char *const pairs[][2] = {{"position_m", "/probes/0"},
                                           {"environment", "/environment/constant"},
                                           {"face_px", "/face_px"},
                                           {"faces", "/faces"},
                                           {"samples_per_axis", "/samples_per_axis"},
                                           {"lighting", "/lighting"}};
    for (size_t i = 0; i < sizeof pairs / sizeof pairs[0]; i++)
        if (strcmp(pairs[i][0], field) == 0)
            return pairs[i][1];
    return "";
}

/* "albedo, noon, dusk" into a bounded text. */
static void list_lightings(char *out, size_t room, const struct lp_scene *scene)
{
    size_t used = 0;
    out[0] = 0;
    for (uint32_t i = 0; i < scene->channel_count && used < room; i++) {
        const struct lp_channel *channel = &scene->channels[i];
        if (channel->kind != LP_CHANNEL_ALBEDO && channel->kind != LP_CHANNEL_RADIANCE)
            continue;
        int n = snprintf(out + used, room - used, "%s%s", used ? ", " : "", channel->name);
        used += n > 0 ? (size_t)n : 0;
    }
}

enum wire_problem_code bake_plan(struct lp_render_plan *plan, struct wire_problem *problem,
                                 const struct lp_scene *scene, const struct wire_job *job)
{
    struct lp_error error = {0};
    struct lp_render_params params = {
        .mode = mode_of(job->mode),
        .levels = job->levels == WIRE_LEVELS_FIXED ? LP_LEVELS_FIXED : LP_LEVELS_CONE,
        .face_px = job->face_px,
        .samples_per_axis = job->samples_per_axis,
        .face_count = job->face_count,
        .lighting = job->lighting,
    };
    for (uint32_t i = 0; i < job->face_count && i < LP_FACE_COUNT; i++)
        params.faces[i] = (enum lp_face)job->faces[i];
    for (int a = 0; a < 3; a++) {
        params.position_m[a] = job->position_m[a];
        params.environment[a] = (float)job->environment_constant[a];
    }
    enum lp_code code = lp_render_prepare(plan, scene, &params, &error);
    if (code == LP_OK)
        return WIRE_PROBLEM_NONE;
    if (code == LP_NOT_FOUND) {
        char known[160];
        list_lightings(known, sizeof known, scene);
        wire_problem_field(problem, "/lighting", "the scene has no lighting \"%s\"; it has %s",
                           job->lighting, known);
    } else {
        wire_problem_field(problem, pointer_of(error.where), "%s", error.text);
    }
    return problem->code;
}

static void add_class(struct wire_counters *out, uint32_t rays, uint64_t pixels)
{
    uint32_t i = 0;
    while (i < out->ray_class_count && out->pixels_by_rays[i].key != rays)
        i++;
    if (i == out->ray_class_count)
        out->pixels_by_rays[out->ray_class_count++] = (struct wire_class_count){.key = rays};
    out->pixels_by_rays[i].pixels += pixels;
}

static void copy_counters(struct wire_counters *out, const struct lp_render_plan *plan,
                          const struct lp_counters *counters)
{
    *out = (struct wire_counters){.rays = counters->rays,
                                  .rays_hit = counters->rays_hit,
                                  .rays_discarded = counters->rays_discarded,
                                  .traversal_steps = counters->traversal_steps,
                                  .pixels = counters->pixels,
                                  .pixels_background = counters->pixels_background};
    /* The thesis's three classes always, and the reference's own when it is none of them. */
    static const uint32_t thesis[] = {1, 4, 16};
    for (size_t i = 0; i < sizeof thesis / sizeof thesis[0]; i++)
        add_class(out, thesis[i], 0);
    for (uint32_t i = 0; i < LP_RAY_CLASSES; i++)
        if (plan->class_rays[i] != 0)
            add_class(out, plan->class_rays[i], counters->pixels_by_class[i]);
    for (uint32_t level = 3; level-- > 0;) /* no mode of this version goes beyond 2 */
        out->pixels_by_level[out->level_count++] =
            (struct wire_class_count){.key = level, .pixels = counters->pixels_by_level[level]};
}

void bake_probe(struct wire_probe *probe, const struct lp_render_plan *plan,
                const struct lp_counters *counters, const struct lp_film *film)
{
    uint8_t sha256[LP_SHA256_BYTES];
    *probe = (struct wire_probe){.index = 0};
    memcpy(probe->position_m, plan->params.position_m, sizeof probe->position_m);
    unsigned warnings = lp_probe_warnings(plan->scene, plan->params.position_m);
    if (warnings & LP_PROBE_INSIDE_MATTER)
        snprintf(probe->warnings[probe->warning_count++], sizeof probe->warnings[0],
                 "the probe lies inside matter: every ray ends in its own voxel; move it, for "
                 "instance up");
    if (warnings & LP_PROBE_OUTSIDE_SCENE)
        snprintf(probe->warnings[probe->warning_count++], sizeof probe->warnings[0],
                 "the probe lies outside of the scene's cube; see bounds_m of the scene");
    if (warnings & LP_PROBE_BELOW_GROUND)
        snprintf(probe->warnings[probe->warning_count++], sizeof probe->warnings[0],
                 "the probe seems to lie below the ground: there is matter straight above it and "
                 "nothing below; move it up");
    copy_counters(&probe->counters, plan, counters);
    lp_film_sha256(sha256, film);
    bake_hex(probe->film_sha256, sha256);
}

void bake_scene_describe(struct bake_scene *out, const struct lp_scene_file *file)
{
    const struct lp_scene *scene = &file->scene;
    memset(out, 0, sizeof *out);
    struct wire_scene *wire = &out->scene;
    wire->state = WIRE_SCENE_READY;
    wire->voxels = scene->tree.level_count[0];
    wire->nodes = scene->tree.node_count;
    wire->bytes = file->bytes;
    wire->depth = scene->tree.depth;
    snprintf(wire->filter, sizeof wire->filter, "%s", lp_filter_text(scene->filter));
    wire->voxel_size_m = scene->voxel_size_m;
    double low[3], high[3];
    for (int a = 0; a < 3; a++) {
        low[a] = scene->bounds_min_vox[a];
        high[a] = scene->bounds_max_vox[a];
    }
    lp_scene_to_world(wire->bounds_min_m, scene, low);
    lp_scene_to_world(wire->bounds_max_m, scene, high);
    memcpy(wire->suggested_probe_m, scene->suggested_probe_m, sizeof wire->suggested_probe_m);
    wire->open_s = -1;
    wire->channel_count = scene->channel_count;
    wire->channels = out->channels;
    for (uint32_t i = 0; i < scene->channel_count; i++) {
        const struct lp_channel *channel = &scene->channels[i];
        static const char *const encodings[] = {"unknown", "srgb8", "rgb9e5", "oct16"};
        snprintf(out->channels[i].name, sizeof out->channels[i].name, "%s", channel->name);
        snprintf(out->channels[i].kind, sizeof out->channels[i].kind, "%s",
                 lp_channel_kind_text(channel->kind));
        snprintf(out->channels[i].encoding, sizeof out->channels[i].encoding, "%s",
                 encodings[channel->encoding]);
    }
}

void bake_hex(char out[WIRE_SHA256_BYTES], const uint8_t sha256[LP_SHA256_BYTES])
{
    static const char digits[] = "0123456789abcdef";
    for (int i = 0; i < LP_SHA256_BYTES; i++) {
        out[2 * i] = digits[sha256[i] >> 4];
        out[2 * i + 1] = digits[sha256[i] & 15];
    }
    out[2 * LP_SHA256_BYTES] = 0;
}

enum lp_code bake_picture(struct bake_picture *out, const struct lp_film *film,
                          enum wire_layout layout, enum wire_image image, struct lp_error *err)
{
    (void)layout; /* strip is the only one so far */
    size_t floats = (size_t)film->face_count * film->face_px * film->face_px * 3;
    float *strip = malloc(floats * sizeof *strip);
    if (!strip)
        return lp_fail(err, LP_NO_MEMORY, "", "no memory for a picture");
    lp_image_strip(strip, film);
    struct lp_pixels pixels = {
        .width_px = film->face_count * film->face_px, .height_px = film->face_px, .rgb_lin = strip};
    struct bake_picture made = {0};
    enum lp_code code =
        lp_image_encode(&made.data, &made.bytes,
                        image == WIRE_IMAGE_PNG ? LP_IMAGE_PNG : LP_IMAGE_EXR, &pixels, err);
    free(strip);
    if (code != LP_OK)
        return code;
    uint8_t sha256[LP_SHA256_BYTES];
    lp_sha256(sha256, made.data, made.bytes);
    bake_hex(made.sha256, sha256);
    *out = made;
    return LP_OK;
}

size_t bake_bytes_max(const struct lp_render_plan *plan, const struct wire_job *job)
{
    /* The film and its strip, what the encoder holds, and every picture as large as raw. */
    size_t formats = 0;
    for (int i = 0; i < WIRE_IMAGE_KINDS; i++)
        formats += job->images[i];
    size_t tiles = (size_t)plan->tile_count * sizeof(struct lp_counters);
    return plan->film_bytes * (4 + formats) + tiles;
}
