/* Judging the place of a probe, and finding one from which there is something to see. */
#include "engine/render.h"

#include <math.h>
#include <string.h>

#define COLUMNS      7    /* candidate columns a side, spread over the scene's bounds */
#define HEIGHTS      3    /* candidate heights above each surface: 1/128, 1/64, 1/32 of the cube */
#define SURFACES_MAX 8    /* looked at in one column */
#define CLOSED_SHARE 0.1f /* worth of a place without any sky beside one that has some */
#define FACE_PX      8    /* of the small cubemap that scores a candidate */

/* Distance along a direction to the first voxel, INFINITY without one. */
static float distance(const struct lp_scene *scene, const double from_os[3], lp_vec3 direction,
                      float cone)
{
    struct lp_ray ray;
    struct lp_hit hit;
    struct lp_level_cut cut = {.cone = cone};
    uint64_t steps = 0;
    lp_ray_init(&ray, from_os, direction);
    return lp_trace_closest(&hit, &steps, &scene->tree, &ray, &cut) ? hit.t_in : INFINITY;
}

unsigned lp_probe_warnings(const struct lp_scene *scene, const double position_m[3])
{
    double at[3];
    uint32_t cell[3];
    lp_node node;
    lp_scene_to_octree(at, scene, position_m);
    for (int a = 0; a < 3; a++) {
        if (!(at[a] >= 0 && at[a] < (double)(1u << scene->tree.depth)))
            return LP_PROBE_OUTSIDE_SCENE;
        cell[a] = (uint32_t)at[a];
    }
    if (lp_octree_find(&node, &scene->tree, cell, 0))
        return LP_PROBE_INSIDE_MATTER;
    bool roof = distance(scene, at, (lp_vec3){0, 1, 0}, 0) < INFINITY;
    bool floor = distance(scene, at, (lp_vec3){0, -1, 0}, 0) < INFINITY;
    return roof && !floor ? LP_PROBE_BELOW_GROUND : 0;
}

/* How much there is to see from a place: the share of directions that meet matter, times how far
 * the view goes, with nothing for a probe whose nearest matter fills its sight. In 0..1. */
static float score(const struct lp_scene *scene, const double at_os[3])
{
    float side = (float)(1u << scene->tree.depth);
    float seen = 0, far = 0, close = 0;
    for (int face = 0; face < LP_FACE_COUNT; face++)
        for (uint32_t y = 0; y < FACE_PX; y++)
            for (uint32_t x = 0; x < FACE_PX; x++) {
                lp_vec3 d = lp_cubemap_direction((enum lp_face)face, x, y, FACE_PX);
                float t = distance(scene, at_os, d, 2.0f / FACE_PX);
                if (t == INFINITY)
                    continue;
                float part = t / side;
                seen += 1.0f;
                far += part / (part + 0.1f); /* saturates: the far end is no better than far */
                close += t < 3.0f ? 1.0f : 0.0f;
            }
    float rays = LP_FACE_COUNT * FACE_PX * FACE_PX;
    float value = (far / rays) * (0.25f + 0.75f * seen / rays) * (1.0f - close / rays);
    /* All closed in: a room, but also the hollow inside of a solid. Open places first. */
    return seen == rays ? value * CLOSED_SHARE : value;
}

struct best {
    float score;
    double at_os[3];
};

static void consider(struct best *best, const struct lp_scene *scene, const double at_os[3])
{
    float value = score(scene, at_os);
    if (value > best->score) {
        best->score = value;
        memcpy(best->at_os, at_os, sizeof best->at_os);
    }
}

/* The free spaces above every surface that a plumb line through (x, z) meets, from the top down. */
static void consider_column(struct best *best, const struct lp_scene *scene, double x, double z)
{
    double ceiling = (double)(1u << scene->tree.depth);
    double from[3] = {x, ceiling, z};
    for (int surface = 0; surface < SURFACES_MAX; surface++) {
        float fall = distance(scene, from, (lp_vec3){0, -1, 0}, 0);
        if (fall == INFINITY)
            return;
        double ground = from[1] - (double)fall;
        double room = from[1] - ground;
        if (room >= 4) {
            /* Heights as a share of the scene, so that they suit rooms and landscapes; the middle
             * of a closed space. */
            double side = ceiling;
            for (int h = 0; h <= HEIGHTS; h++) {
                bool closed = surface > 0;
                double above = h < HEIGHTS ? side / 128 * (double)(1u << h) : room / 2;
                if (h == HEIGHTS && !closed)
                    continue;
                double at[3] = {x, ground + fmin(above, room / 2), z};
                consider(best, scene, at);
            }
        }
        /* Through the matter, to the next space below. */
        from[1] = ceil(ground) - 0.5;
        uint32_t cell[3] = {(uint32_t)x, 0, (uint32_t)z};
        lp_node node;
        while (from[1] > 0) {
            cell[1] = (uint32_t)from[1];
            if (!lp_octree_find(&node, &scene->tree, cell, 0))
                break;
            from[1] -= 1;
        }
        if (from[1] <= 0)
            return;
    }
}

void lp_probe_suggest(double out_m[3], const struct lp_scene *scene)
{
    double low[3], span[3], middle[3];
    for (int a = 0; a < 3; a++) {
        low[a] = scene->bounds_min_vox[a];
        span[a] = (double)scene->bounds_max_vox[a] - low[a];
        middle[a] = low[a] + span[a] / 2;
    }
    /* Without any free space: above the middle of it all. */
    struct best best = {.score = 0,
                        .at_os = {middle[0], (double)scene->bounds_max_vox[1] + 2, middle[2]}};
    for (int j = 0; j < COLUMNS; j++)
        for (int i = 0; i < COLUMNS; i++) {
            /* Off the grid's planes, so that no ray of the first look runs along an edge. */
            double x = floor(low[0] + span[0] * (i + 1) / (COLUMNS + 1)) + 0.5;
            double z = floor(low[2] + span[2] * (j + 1) / (COLUMNS + 1)) + 0.5;
            consider_column(&best, scene, x, z);
        }
    lp_scene_to_world(out_m, scene, best.at_os);
}
