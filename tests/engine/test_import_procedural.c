/* Tests of the room and the sphere. */
#include "engine/import.h"
#include "engine/scene_file.h"
#include "engine/srgb.h"
#include "tests/harness/test.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

struct imported {
    void *bytes;
    size_t byte_count;
    struct lp_scene scene;
};

static void import(struct imported *out, const struct lp_procedural_params *params)
{
    struct lp_error err = {0};
    if (lp_import_procedural(&out->bytes, &out->byte_count, params, &err) != LP_OK ||
        lp_scene_view(&out->scene, out->bytes, out->byte_count, LP_TRUST_NOTHING, &err) != LP_OK)
        test_abort(__FILE__, __LINE__, "%s: %s", err.where, err.text);
}

/* Whether a voxel is there; its attribute's place then. */
static bool voxel_at(uint64_t *attribute, const struct lp_scene *scene, int x, int y, int z)
{
    int side = 1 << scene->tree.depth;
    if (x < 0 || y < 0 || z < 0 || x >= side || y >= side || z >= side)
        return false;
    lp_node node;
    const uint32_t cell[3] = {(uint32_t)x, (uint32_t)y, (uint32_t)z};
    if (!lp_octree_find(&node, &scene->tree, cell, 0))
        return false;
    *attribute = lp_octree_attribute(&scene->tree, node);
    return true;
}

TEST(room_has_six_walls_of_six_colours_and_is_empty)
{
    struct lp_procedural_params params = {.which = LP_PROCEDURAL_ROOM, .depth = 4};
    struct imported room;
    import(&room, &params);
    enum { N = 16 };
    for (int z = 0; z < N; z++)
        for (int y = 0; y < N; y++)
            for (int x = 0; x < N; x++) {
                int inside[3] = {x, y, z}, wall = -1, walls = 0;
                for (int face = 0; face < 6; face++)
                    if (inside[face / 2] == (face % 2 ? 0 : N - 1)) {
                        wall = face;
                        walls++;
                    }
                uint64_t at;
                CHECK_EQ(voxel_at(&at, &room.scene, x, y, z), walls > 0);
                if (walls == 1) /* edges belong to one of their walls */
                    CHECK(memcmp(room.scene.channels[0].values + 3 * at, lp_room_walls_srgb[wall],
                                 3) == 0);
            }
    CHECK_EQ(room.scene.tree.level_count[0], N * N * N - (N - 2) * (N - 2) * (N - 2));
    for (int axis = 0; axis < 3; axis++)
        CHECK(room.scene.origin_m[axis] == -4.0);
    CHECK(room.scene.voxel_size_m == 0.5);
    free(room.bytes);
}

TEST(room_walls_have_the_promised_hues)
{
    const uint8_t(*c)[3] = lp_room_walls_srgb;
    CHECK(c[0][0] > 2 * c[0][1] && c[0][0] > 2 * c[0][2]);  /* red */
    CHECK(c[1][1] > 2 * c[1][0] && c[1][2] > 2 * c[1][0]);  /* cyan */
    CHECK(c[2][0] > 220 && c[2][1] > 220 && c[2][2] > 220); /* white */
    CHECK(c[3][0] > c[3][1] && c[3][1] > 2 * c[3][2] - 10); /* yellow-brown */
    CHECK(c[4][2] > 2 * c[4][0] && c[4][2] > 2 * c[4][1]);  /* blue */
    CHECK(c[5][1] > 2 * c[5][0] && c[5][1] > 2 * c[5][2]);  /* green */
    for (int a = 0; a < 6; a++)
        for (int b = 0; b < a; b++)
            CHECK(memcmp(c[a], c[b], 3) != 0);
}

TEST(room_lamp_is_exactly_fifty_in_the_middle_of_the_ceiling)
{
    struct lp_procedural_params params = {.which = LP_PROCEDURAL_ROOM, .depth = 4, .size_m = 2};
    struct imported room;
    import(&room, &params);
    CHECK_EQ(room.scene.channel_count, 2);
    const struct lp_channel *lamp = lp_scene_lighting(&room.scene, "lamp");
    REQUIRE(lamp);
    CHECK_EQ(lamp->kind, LP_CHANNEL_RADIANCE);
    int lit = 0;
    for (int z = 1; z < 15; z++)
        for (int x = 1; x < 15; x++) {
            uint64_t at;
            float rgb[3];
            REQUIRE(voxel_at(&at, &room.scene, x, 15, z));
            lp_channel_rgb(rgb, lamp, at);
            bool patch = x >= 6 && x < 10 && z >= 6 && z < 10;
            for (int c = 0; c < 3; c++)
                if (patch)
                    CHECK(rgb[c] == 50.0f);
                else
                    CHECK_NEAR(rgb[c], 0.5 * (double)lp_srgb_to_linear[lp_room_walls_srgb[2][c]],
                               1.0 / 1024);
            lit += patch;
        }
    CHECK_EQ(lit, 16);
    uint64_t at;
    float rgb[3];
    REQUIRE(voxel_at(&at, &room.scene, 15, 5, 5));
    lp_channel_rgb(rgb, lamp, at);
    for (int c = 0; c < 3; c++)
        CHECK_NEAR(rgb[c], 0.5 * (double)lp_srgb_to_linear[lp_room_walls_srgb[0][c]], 1.0 / 1024);
    free(room.bytes);
}

static bool in_ball(int n, int x, int y, int z)
{
    double dx = x + 0.5 - n * 0.5, dy = y + 0.5 - n * 0.375, dz = z + 0.5 - n * 0.5;
    return dx * dx + dy * dy + dz * dz <= n * n / 16.0;
}

static bool in_shell(int n, int x, int y, int z)
{
    if (!in_ball(n, x, y, z))
        return false;
    for (int i = 0; i < 27; i++)
        if (!in_ball(n, x + i % 3 - 1, y + i / 3 % 3 - 1, z + i / 9 - 1))
            return true;
    return false;
}

TEST(sphere_is_a_closed_shell_over_a_floor)
{
    for (int depth = 3; depth <= 6; depth++) {
        struct lp_procedural_params params = {
            .which = LP_PROCEDURAL_SPHERE, .depth = (uint8_t)depth, .size_m = 16};
        struct imported sphere;
        import(&sphere, &params);
        int n = 1 << depth;
        for (int z = 0; z < n; z++)
            for (int y = 0; y < n; y++)
                for (int x = 0; x < n; x++) {
                    uint64_t at;
                    bool wanted = y == 0 || in_shell(n, x, y, z);
                    if (voxel_at(&at, &sphere.scene, x, y, z) != wanted)
                        test_fail(__FILE__, __LINE__, "depth %d: voxel (%d, %d, %d)", depth, x, y,
                                  z);
                }
        CHECK(sphere.scene.origin_m[0] == -8.0 && sphere.scene.origin_m[2] == -8.0);
        CHECK(sphere.scene.origin_m[1] == 0.0);
        CHECK_EQ(sphere.scene.channel_count, 1);
        free(sphere.bytes);
    }
}

TEST(sphere_is_coloured_by_normal_and_its_floor_by_squares)
{
    struct lp_procedural_params params = {.which = LP_PROCEDURAL_SPHERE, .depth = 6};
    struct imported sphere;
    import(&sphere, &params);
    const struct lp_scene *scene = &sphere.scene;
    const uint8_t *colors = scene->channels[0].values;
    int dark = 0, light = 0;
    uint64_t at, first, beside;
    for (int z = 0; z < 64; z++)
        for (int x = 0; x < 64; x++) {
            REQUIRE(voxel_at(&at, scene, x, 0, z));
            bool odd = (x / 8 + z / 8) % 2;
            CHECK_EQ(colors[3 * at] > 128, odd);
            dark += !odd;
            light += odd;
        }
    CHECK_EQ(dark, light);
    /* The pole of +X is redder than that of -X, and so on for green along Y and blue along Z. */
    const int poles[3][2][3] = {
        {{47, 24, 32}, {16, 24, 32}}, {{32, 39, 32}, {32, 8, 32}}, {{32, 24, 47}, {32, 24, 16}}};
    for (int axis = 0; axis < 3; axis++) {
        const int *high = poles[axis][0], *low = poles[axis][1];
        REQUIRE(voxel_at(&first, scene, high[0], high[1], high[2]));
        REQUIRE(voxel_at(&beside, scene, low[0], low[1], low[2]));
        CHECK(colors[3 * first + (uint64_t)axis] > 235);
        CHECK(colors[3 * beside + (uint64_t)axis] < 110);
    }
    free(sphere.bytes);
}

static void fail_to_import(struct lp_error *err, enum lp_code code, const char *where,
                           const struct lp_procedural_params *params)
{
    void *bytes = NULL;
    size_t byte_count = 0;
    *err = (struct lp_error){0};
    CHECK_EQ(lp_import_procedural(&bytes, &byte_count, params, err), code);
    CHECK_STR(err->where, where);
    CHECK(!bytes);
}

TEST(wrong_parameters_are_refused_by_their_flag)
{
    struct lp_error err;
    struct lp_procedural_params params = {.which = LP_PROCEDURAL_ROOM, .depth = 2};
    fail_to_import(&err, LP_INVALID, "--depth", &params);
    CHECK_HAS(err.text, "3 to 11");
    params.depth = 12;
    fail_to_import(&err, LP_INVALID, "--depth", &params);
    params.depth = 3;
    const double bad[] = {-1.0, NAN, INFINITY, 1e300, 1e-300};
    for (size_t i = 0; i < sizeof bad / sizeof bad[0]; i++) {
        params.size_m = bad[i];
        fail_to_import(&err, LP_INVALID, "--size-m", &params);
    }
    params.size_m = 0;
    params.which = (enum lp_procedural)9;
    fail_to_import(&err, LP_INVALID, "SOURCE", &params);
    CHECK_HAS(err.text, "room");
}

TEST(procedural_scenes_have_names)
{
    enum lp_procedural which = LP_PROCEDURAL_SPHERE;
    CHECK(lp_procedural_named(&which, "room") && which == LP_PROCEDURAL_ROOM);
    CHECK(lp_procedural_named(&which, "sphere") && which == LP_PROCEDURAL_SPHERE);
    which = LP_PROCEDURAL_ROOM;
    CHECK(!lp_procedural_named(&which, "Room") && !lp_procedural_named(&which, "") &&
          !lp_procedural_named(&which, NULL));
    CHECK_EQ(which, LP_PROCEDURAL_ROOM);
}

TEST(a_procedural_import_can_be_cancelled)
{
    struct lp_progress progress = {.done = 0};
    atomic_store(&progress.cancelled, true);
    for (int which = 0; which < 2; which++) {
        struct lp_procedural_params params = {
            .which = (enum lp_procedural)which, .depth = 5, .progress = &progress};
        struct lp_error err;
        fail_to_import(&err, LP_CANCELLED, "", &params);
    }
}
