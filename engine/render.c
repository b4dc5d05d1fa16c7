/* Plans, tiles, and the colour of a texel in every mode. */
#include "engine/render.h"

#include <fenv.h>
#include <math.h>
#include <string.h>
#include <xmmintrin.h>

_Static_assert(__BYTE_ORDER__ == __ORDER_LITTLE_ENDIAN__, "the film's hash is over its memory");

/* ---- plans -------------------------------------------------------------------------------------
 */

static enum lp_code check_view(const struct lp_render_params *params, struct lp_error *err)
{
    if (params->face_px < 1 || params->face_px > LP_FACE_PX_MAX)
        return lp_fail(err, LP_INVALID, "face_px", "is %u, it must be 1 to %d", params->face_px,
                       LP_FACE_PX_MAX);
    if (params->face_count < 1 || params->face_count > LP_FACE_COUNT)
        return lp_fail(err, LP_INVALID, "faces", "%u faces, it must be 1 to 6", params->face_count);
    unsigned seen = 0;
    for (uint32_t i = 0; i < params->face_count; i++) {
        if ((unsigned)params->faces[i] >= LP_FACE_COUNT || (seen >> params->faces[i] & 1))
            return lp_fail(err, LP_INVALID, "faces", "face %u is unknown or there twice", i);
        seen |= 1u << params->faces[i];
    }
    if (params->mode == LP_MODE_REFERENCE &&
        (params->samples_per_axis < 1 || params->samples_per_axis > LP_SAMPLES_PER_AXIS_MAX))
        return lp_fail(err, LP_INVALID, "samples_per_axis", "is %u, it must be 1 to %d",
                       params->samples_per_axis, LP_SAMPLES_PER_AXIS_MAX);
    for (int c = 0; c < 3; c++)
        if (!(params->environment[c] >= 0 && params->environment[c] <= LP_RADIANCE_MAX))
            return lp_fail(err, LP_INVALID, "environment", "radiance must be 0 to %g",
                           (double)LP_RADIANCE_MAX);
    return LP_OK;
}

static enum lp_code place_probe(double origin_os[3], const struct lp_scene *scene,
                                const struct lp_render_params *params, struct lp_error *err)
{
    lp_scene_to_octree(origin_os, scene, params->position_m);
    for (int a = 0; a < 3; a++)
        if (!(fabs(origin_os[a]) < LP_RAY_ORIGIN_MAX))
            return lp_fail(err, LP_INVALID, "position_m",
                           "the probe lies %.3g m off the scene along axis %c; it must lie within "
                           "%.6g m of the scene's corner",
                           fabs(origin_os[a]) * scene->voxel_size_m, "xyz"[a],
                           LP_RAY_ORIGIN_MAX * scene -> voxel_size_m);
    return LP_OK;
}

enum lp_code lp_render_prepare(struct lp_render_plan *plan, const struct lp_scene *scene,
                               const struct lp_render_params *params, struct lp_error *err)
{
    struct lp_render_plan made = {.params = *params, .scene = scene};
    enum lp_code code = check_view(params, err);
    if (code == LP_OK)
        code = place_probe(made.origin_os, scene, params, err);
    if (code != LP_OK)
        return code;
    made.lighting = lp_scene_lighting(scene, params->lighting);
    if (!made.lighting)
        return lp_fail(err, LP_NOT_FOUND, "lighting", "the scene has no lighting \"%s\"",
                       params->lighting);
    made.tiles_per_axis = (params->face_px + LP_TILE_PX - 1) / LP_TILE_PX;
    made.tile_count = params->face_count * made.tiles_per_axis * made.tiles_per_axis;
    uint32_t samples = params->mode == LP_MODE_REFERENCE ? params->samples_per_axis : 1;
    made.class_rays[0] = samples * samples;
    uint64_t texels = (uint64_t)params->face_count * params->face_px * params->face_px;
    made.rays_max = texels * made.class_rays[0];
    made.film_bytes = (size_t)texels * 3 * sizeof(float);
    *plan = made;
    return LP_OK;
}

void lp_film_init(struct lp_film *film, const struct lp_render_plan *plan, void *memory)
{
    *film = (struct lp_film){
        .face_px = plan->params.face_px, .face_count = plan->params.face_count, .radiance = memory};
}

/* ---- texels ------------------------------------------------------------------------------------
 */

/* What a tile works with. */
struct tile {
    const struct lp_render_plan *plan;
    struct lp_counters counters;
};

/* One ray through texel (x, y) of a face of n texels a side: adds its colour to `rgb`. */
static bool shoot(struct tile *tile, float rgb[3], enum lp_face face, uint32_t x, uint32_t y,
                  uint32_t n, const struct lp_level_cut *cut)
{
    const struct lp_render_plan *plan = tile->plan;
    struct lp_ray ray;
    struct lp_hit hit;
    lp_ray_init(&ray, plan->origin_os, lp_cubemap_direction(face, x, y, n));
    tile->counters.rays++;
    bool found =
        lp_trace_closest(&hit, &tile->counters.traversal_steps, &plan->scene->tree, &ray, cut);
    float seen[3] = {plan->params.environment[0], plan->params.environment[1],
                     plan->params.environment[2]};
    if (found) {
        tile->counters.rays_hit++;
        lp_channel_rgb(seen, plan->lighting, lp_octree_attribute(&plan->scene->tree, hit.node));
    }
    for (int c = 0; c < 3; c++)
        rgb[c] += seen[c];
    return found;
}

static void count_pixel(struct tile *tile, bool hit, uint32_t level)
{
    tile->counters.pixels++;
    if (!hit) {
        tile->counters.pixels_background++;
        return;
    }
    tile->counters.pixels_by_class[0]++;
    tile->counters.pixels_by_level[level]++;
}

/* n * n rays at the finest level, at the centres of a regular grid, averaged. */
static void reference_texel(struct tile *tile, float rgb[3], enum lp_face face, uint32_t x,
                            uint32_t y)
{
    static const struct lp_level_cut voxels = {0};
    uint32_t samples = tile->plan->params.samples_per_axis;
    uint32_t n = tile->plan->params.face_px * samples;
    float sum[3] = {0, 0, 0};
    bool hit = false;
    for (uint32_t j = 0; j < samples; j++)
        for (uint32_t i = 0; i < samples; i++)
            hit |= shoot(tile, sum, face, x * samples + i, y * samples + j, n, &voxels);
    for (int c = 0; c < 3; c++)
        rgb[c] = sum[c] / (float)(samples * samples);
    count_pixel(tile, hit, 0);
}

/* One ray at the level of the footprint, or at the third finest level of the tree. */
static void lod_texel(struct tile *tile, float rgb[3], enum lp_face face, uint32_t x, uint32_t y)
{
    uint32_t n = tile->plan->params.face_px;
    bool fixed = tile->plan->params.levels == LP_LEVELS_FIXED;
    struct lp_level_cut cut = {.level = fixed ? 2 : 0, .cone = fixed ? 0.0f : 2.0f / (float)n};
    rgb[0] = rgb[1] = rgb[2] = 0.0f;
    bool hit = shoot(tile, rgb, face, x, y, n, &cut);
    count_pixel(tile, hit, 2);
}

void lp_render_tile(struct lp_film *film, struct lp_counters *counters,
                    const struct lp_render_plan *plan, uint32_t tile_index)
{
    struct tile tile = {.plan = plan};
    uint32_t n = plan->params.face_px;
    uint32_t per_face = plan->tiles_per_axis * plan->tiles_per_axis;
    uint32_t place = tile_index / per_face, rest = tile_index % per_face;
    uint32_t x0 = rest % plan->tiles_per_axis * LP_TILE_PX;
    uint32_t y0 = rest / plan->tiles_per_axis * LP_TILE_PX;
    uint32_t x1 = x0 + LP_TILE_PX < n ? x0 + LP_TILE_PX : n;
    uint32_t y1 = y0 + LP_TILE_PX < n ? y0 + LP_TILE_PX : n;
    enum lp_face face = plan->params.faces[place];
    for (uint32_t y = y0; y < y1; y++)
        for (uint32_t x = x0; x < x1; x++) {
            float *rgb = film->radiance + 3 * (((size_t)place * n + y) * n + x);
            if (plan->params.mode == LP_MODE_REFERENCE)
                reference_texel(&tile, rgb, face, x, y);
            else
                lod_texel(&tile, rgb, face, x, y);
        }
    *counters = tile.counters;
}

void lp_render_thread_begin(void)
{
    fesetround(FE_TONEAREST);
    _mm_setcsr(_mm_getcsr() &
               ~(unsigned)(_MM_FLUSH_ZERO_MASK | 0x40)); /* 0x40: denormals are zero */
}

/* ---- sums --------------------------------------------------------------------------------------
 */

void lp_counters_add(struct lp_counters *sum, const struct lp_counters *part)
{
    sum->rays += part->rays;
    sum->rays_hit += part->rays_hit;
    sum->rays_discarded += part->rays_discarded;
    sum->traversal_steps += part->traversal_steps;
    sum->pixels += part->pixels;
    sum->pixels_background += part->pixels_background;
    for (int i = 0; i < LP_RAY_CLASSES; i++)
        sum->pixels_by_class[i] += part->pixels_by_class[i];
    for (int i = 0; i < LP_LEVEL_CLASSES; i++)
        sum->pixels_by_level[i] += part->pixels_by_level[i];
}

void lp_film_sha256(uint8_t out[LP_SHA256_BYTES], const struct lp_film *film)
{
    size_t floats = (size_t)film->face_count * film->face_px * film->face_px * 3;
    lp_sha256(out, film->radiance, floats * sizeof(float));
}
