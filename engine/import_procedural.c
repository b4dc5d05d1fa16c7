/* Scenes made by formula: a room of six colours, and a sphere over a checkerboard. */
#include "engine/import.h"

#include "engine/import_batch.h"
#include "engine/srgb.h"

#include <math.h>
#include <string.h>

#define PROCEDURAL_DEPTH_MIN 3
#define PROCEDURAL_DEPTH_MAX 11
#define PROCEDURAL_SIZE_M    8.0
#define SIZE_MIN_M           1e-6
#define SIZE_MAX_M           1e9

#define ROOM_LAMP_RADIANCE  50.0f /* of the patch on the ceiling, in the lighting "lamp" */
#define ROOM_WALL_BRIGHT    0.5f  /* of the walls in that lighting, times their colour */
#define CHECKER_SQUARES     8     /* along an edge of the floor */
#define CHECKER_LIGHT_SRGB  225
#define CHECKER_DARK_SRGB   60
#define SPHERE_COLOR_MIDDLE 0.5 /* linear colour of a normal component of 0 ... */
#define SPHERE_COLOR_SWING  0.4 /* ... and what 1 adds */

const uint8_t lp_room_walls_srgb[6][3] = {
    {205, 45, 40},   /* +X red */
    {45, 190, 195},  /* -X cyan */
    {240, 240, 240}, /* +Y white */
    {165, 125, 60},  /* -Y yellow-brown */
    {50, 75, 205},   /* +Z blue */
    {60, 170, 65},   /* -Z green */
};

bool lp_procedural_named(enum lp_procedural *out, const char *name)
{
    if (name && strcmp(name, "room") == 0)
        *out = LP_PROCEDURAL_ROOM;
    else if (name && strcmp(name, "sphere") == 0)
        *out = LP_PROCEDURAL_SPHERE;
    else
        return false;
    return true;
}

struct scene {
    struct lp_progress *progress;
    struct lp_batch *batch;
    uint32_t side_vox;
};

/* Counts a slice of a scene as done; LP_CANCELLED when the caller wants to stop. */
static enum lp_code end_slice(const struct scene *scene, uint32_t done, struct lp_error *err)
{
    if (scene->progress)
        atomic_store_explicit(&scene->progress->done, done, memory_order_relaxed);
    if (lp_progress_cancelled(scene->progress))
        return lp_fail(err, LP_CANCELLED, "", "the import was cancelled");
    return LP_OK;
}

/* Which wall a cell belongs to, in cubemap order (+X -X +Y -Y +Z -Z); -1: none. Cells of an edge
 * or corner belong to the first of their walls in that order: nobody inside can see them. */
static int wall_of(const struct scene *scene, uint32_t x, uint32_t y, uint32_t z)
{
    const uint32_t cell[3] = {x, y, z};
    for (int axis = 0; axis < 3; axis++) {
        if (cell[axis] == scene->side_vox - 1)
            return 2 * axis;
        if (cell[axis] == 0)
            return 2 * axis + 1;
    }
    return -1;
}

/* The lamp: a square in the middle of the ceiling, a quarter of its edge wide. */
static bool is_lamp(const struct scene *scene, const struct lp_voxel *voxel)
{
    uint32_t from = scene->side_vox / 2 - scene->side_vox / 8;
    uint32_t to = scene->side_vox / 2 + scene->side_vox / 8;
    return voxel->y == scene->side_vox - 1 && voxel->x >= from && voxel->x < to &&
           voxel->z >= from && voxel->z < to;
}

static enum lp_code push_wall_cell(const struct scene *scene, uint32_t x, uint32_t y, uint32_t z,
                                   struct lp_error *err)
{
    int wall = wall_of(scene, x, y, z);
    struct lp_voxel voxel = {.x = x, .y = y, .z = z};
    memcpy(voxel.albedo_srgb, lp_room_walls_srgb[wall], sizeof voxel.albedo_srgb);
    float lamp[3] = {ROOM_LAMP_RADIANCE, ROOM_LAMP_RADIANCE, ROOM_LAMP_RADIANCE};
    if (!is_lamp(scene, &voxel))
        for (int c = 0; c < 3; c++)
            lamp[c] = lp_srgb_to_linear[voxel.albedo_srgb[c]] * ROOM_WALL_BRIGHT;
    return lp_batch_add(scene->batch, &voxel, lamp, err);
}

/* The outermost layer of the cube's cells; everything inside is empty. */
static enum lp_code push_room(const struct scene *scene, struct lp_error *err)
{
    uint32_t last = scene->side_vox - 1;
    enum lp_code code = LP_OK;
    for (uint32_t z = 0; code == LP_OK && z <= last; z++) {
        for (uint32_t y = 0; code == LP_OK && y <= last; y++) {
            bool whole_row = z == 0 || z == last || y == 0 || y == last;
            for (uint32_t x = 0; code == LP_OK && x <= last; x += whole_row ? 1 : last)
                code = push_wall_cell(scene, x, y, z, err);
        }
        if (code == LP_OK)
            code = end_slice(scene, z + 1, err);
    }
    return code;
}

static enum lp_code push_floor_row(const struct scene *scene, uint32_t z, struct lp_error *err)
{
    uint32_t square = scene->side_vox / CHECKER_SQUARES;
    enum lp_code code = LP_OK;
    for (uint32_t x = 0; code == LP_OK && x < scene->side_vox; x++) {
        uint8_t grey = (x / square + z / square) % 2 ? CHECKER_LIGHT_SRGB : CHECKER_DARK_SRGB;
        struct lp_voxel voxel = {.x = x, .z = z, .albedo_srgb = {grey, grey, grey}};
        code = lp_batch_add(scene->batch, &voxel, NULL, err);
    }
    return code;
}

/* One voxel of the ball, coloured by its normal; `twice` is twice its centre's place from the
 * ball's centre. */
static enum lp_code push_ball_voxel(const struct scene *scene, struct lp_voxel voxel,
                                    const int64_t twice[3], struct lp_error *err)
{
    double length = sqrt((double)(twice[0] * twice[0] + twice[1] * twice[1] + twice[2] * twice[2]));
    for (int c = 0; c < 3; c++)
        voxel.albedo_srgb[c] = lp_srgb_from_linear(
            (float)(SPHERE_COLOR_MIDDLE + SPHERE_COLOR_SWING * (double)twice[c] / length));
    return lp_batch_add(scene->batch, &voxel, NULL, err);
}

/* The ball's shell in slice z. In a cube of n voxels the ball has radius n/4 and its centre at
 * (n/2, 3n/8, n/2): it hovers n/8 above the floor. All places are doubled, so that a voxel's centre
 * is an integer: a solid voxel is at most n/2 from the centre, and has an empty neighbour exactly
 * where the one of its 26 that is farthest out, two further along every axis, is empty. */
static enum lp_code push_ball_slice(const struct scene *scene, uint32_t z, struct lp_error *err)
{
    const int64_t n = scene->side_vox, radius = n / 2, limit = radius * radius;
    const int64_t dz = 2 * (int64_t)z + 1 - n, far_z = (dz < 0 ? -dz : dz) + 2;
    enum lp_code code = LP_OK;
    if (dz * dz > limit)
        return LP_OK;
    for (int64_t x = n / 4; x < 3 * n / 4; x++) {
        const int64_t dx = 2 * x + 1 - n, far_x = (dx < 0 ? -dx : dx) + 2;
        const int64_t solid = limit - dx * dx - dz * dz;             /* dy * dy at most this ... */
        const int64_t shell = limit - far_x * far_x - far_z * far_z; /* ... and beyond this */
        for (int64_t y = n / 8; solid >= 0 && code == LP_OK && y < 5 * n / 8; y++) {
            const int64_t dy = 2 * y + 1 - 3 * n / 4, far_y = (dy < 0 ? -dy : dy) + 2;
            if (dy * dy > solid || far_y * far_y <= shell)
                continue;
            struct lp_voxel voxel = {.x = (uint32_t)x, .y = (uint32_t)y, .z = z};
            code = push_ball_voxel(scene, voxel, (const int64_t[3]){dx, dy, dz}, err);
        }
    }
    return code;
}

static enum lp_code push_sphere(const struct scene *scene, struct lp_error *err)
{
    enum lp_code code = LP_OK;
    for (uint32_t z = 0; code == LP_OK && z < scene->side_vox; z++) {
        code = push_floor_row(scene, z, err);
        if (code == LP_OK)
            code = push_ball_slice(scene, z, err);
        if (code == LP_OK)
            code = end_slice(scene, z + 1, err);
    }
    return code;
}

static enum lp_code check_params(const struct lp_procedural_params *params, struct lp_error *err)
{
    if (params->which != LP_PROCEDURAL_ROOM && params->which != LP_PROCEDURAL_SPHERE)
        return lp_fail(err, LP_INVALID, "SOURCE",
                       "there is no such procedural scene; room and "
                       "sphere are known");
    if (params->size_m != 0.0 && !(params->size_m >= SIZE_MIN_M && params->size_m <= SIZE_MAX_M))
        return lp_fail(err, LP_INVALID, "--size-m", "%g is not a length: give metres from %g to %g",
                       params->size_m, SIZE_MIN_M, SIZE_MAX_M);
    if (params->depth != 0 &&
        (params->depth < PROCEDURAL_DEPTH_MIN || params->depth > PROCEDURAL_DEPTH_MAX))
        return lp_fail(err, LP_INVALID, "--depth",
                       "%d is not a depth of procedural scenes: give %d to %d", params->depth,
                       PROCEDURAL_DEPTH_MIN, PROCEDURAL_DEPTH_MAX);
    return LP_OK;
}

/* The room's centre is the world's origin; the sphere's floor lies on y = 0, below the origin. */
static enum lp_code create_build(struct lp_build **out, const struct lp_procedural_params *params,
                                 uint8_t depth, struct lp_error *err)
{
    const struct lp_build_channel lamp = {.kind = LP_CHANNEL_RADIANCE, .name = "lamp"};
    bool is_room = params->which == LP_PROCEDURAL_ROOM;
    double size_m = params->size_m != 0.0 ? params->size_m : PROCEDURAL_SIZE_M;
    struct lp_build_params build = {
        .depth = depth,
        .filter = params->filter,
        .voxel_size_m = size_m / (UINT32_C(1) << depth),
        .origin_m = {-size_m / 2.0, is_room ? -size_m / 2.0 : 0.0, -size_m / 2.0},
        .channel_count = is_room ? 1 : 0,
        .channels = is_room ? &lamp : NULL,
        .executor = params->executor,
        .progress = params->progress};
    return lp_build_create(out, &build, err);
}

enum lp_code lp_import_procedural(void **out, size_t *out_bytes,
                                  const struct lp_procedural_params *params, struct lp_error *err)
{
    struct lp_build *build = NULL;
    struct scene scene = {.progress = params->progress};
    uint8_t depth = params->depth ? params->depth : LP_IMPORT_DEPTH_DEFAULT;
    enum lp_code code = check_params(params, err);
    if (code == LP_OK)
        code = create_build(&build, params, depth, err);
    if (code == LP_OK)
        code = lp_batch_create(&scene.batch, build, err);
    if (code != LP_OK)
        goto out;
    scene.side_vox = UINT32_C(1) << depth;
    lp_progress_phase(params->progress, "voxels", scene.side_vox);
    code = params->which == LP_PROCEDURAL_ROOM ? push_room(&scene, err) : push_sphere(&scene, err);
    if (code == LP_OK)
        code = lp_batch_flush(scene.batch, err);
    if (code == LP_OK)
        code = lp_build_finish(out, out_bytes, build, err);
out:
    lp_batch_destroy(&scene.batch);
    lp_build_destroy(&build);
    return code;
}
