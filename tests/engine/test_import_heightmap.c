/* Tests of the height map importer against a brute-force solid. */
#include "engine/import.h"
#include "engine/scene_file.h"
#include "engine/srgb.h"
#include "tests/harness/png.h"
#include "tests/harness/test.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

struct imported {
    void *bytes;
    size_t byte_count;
    struct lp_scene scene;
};

static void import(struct imported *out, const struct lp_heightmap_params *params)
{
    struct lp_error err = {0};
    if (lp_import_heightmap(&out->bytes, &out->byte_count, params, &err) != LP_OK ||
        lp_scene_view(&out->scene, out->bytes, out->byte_count, LP_TRUST_NOTHING, &err) != LP_OK)
        test_abort(__FILE__, __LINE__, "%s: %s", err.where, err.text);
}

static void finish(struct imported *imported)
{
    free(imported->bytes);
}

/* Whether the voxel is there; its colour in `srgb` unless that is NULL. */
static bool voxel_at(const struct lp_scene *scene, uint32_t x, uint32_t y, uint32_t z,
                     uint8_t srgb[3])
{
    lp_node node;
    if (!lp_octree_find(&node, &scene->tree, (const uint32_t[3]){x, y, z}, 0))
        return false;
    if (srgb)
        memcpy(srgb, scene->channels[0].values + 3 * lp_octree_attribute(&scene->tree, node), 3);
    return true;
}

/* The solid {y <= top} within the map, all of the map's outside being unknown (never empty). */
struct solid {
    int side, columns, offset;
    const int *tops; /* columns * columns, row by row */
};

static bool is_empty(const struct solid *solid, int x, int y, int z)
{
    x -= solid->offset;
    z -= solid->offset;
    return x >= 0 && z >= 0 && x < solid->columns && z < solid->columns &&
           y > solid->tops[z * solid->columns + x];
}

static bool is_solid(const struct solid *solid, int x, int y, int z)
{
    x -= solid->offset;
    z -= solid->offset;
    return y >= 0 && x >= 0 && z >= 0 && x < solid->columns && z < solid->columns &&
           y <= solid->tops[z * solid->columns + x];
}

static bool is_surface(const struct solid *solid, int x, int y, int z)
{
    if (!is_solid(solid, x, y, z))
        return false;
    for (int i = 0; i < 27; i++)
        if (is_empty(solid, x + i % 3 - 1, y + i / 3 % 3 - 1, z + i / 9 - 1))
            return true;
    return false;
}

static void check_against(const struct lp_scene *scene, const struct solid *solid)
{
    size_t wanted = 0;
    for (int z = 0; z < solid->side; z++)
        for (int y = 0; y < solid->side; y++)
            for (int x = 0; x < solid->side; x++) {
                bool surface = is_surface(solid, x, y, z);
                wanted += surface;
                if (voxel_at(scene, (uint32_t)x, (uint32_t)y, (uint32_t)z, NULL) != surface)
                    test_fail(__FILE__, __LINE__, "voxel (%d, %d, %d) is %s", x, y, z,
                              surface ? "missing" : "too many");
            }
    CHECK_EQ(scene->tree.level_count[0], wanted);
}

enum shape { SHAPE_NOISE, SHAPE_EXTREME, SHAPE_SLOPE, SHAPE_FLAT, SHAPE_SPIKE, SHAPES };

static uint16_t shaped_sample(enum shape shape, uint32_t x, uint32_t z, uint32_t n,
                              uint32_t largest, test_random *random)
{
    switch (shape) {
    case SHAPE_NOISE:
        return (uint16_t)test_random_below(random, largest + 1);
    case SHAPE_EXTREME:
        return (uint16_t)(test_random_below(random, 2) * largest);
    case SHAPE_SLOPE:
        return (uint16_t)((x + 2 * z) * largest / (3 * n));
    case SHAPE_SPIKE:
        return (uint16_t)(x == n / 2 && z == n / 3 ? largest : largest / 7);
    default:
        return (uint16_t)(largest / 2);
    }
}

TEST(surface_equals_the_brute_force_one)
{
    test_random random = test_random_begin();
    uint16_t samples[32 * 32];
    int tops[32 * 32];
    for (int depth = 1; depth <= 5; depth++)
        for (int shape = 0; shape < SHAPES; shape++)
            for (uint32_t bits = 8; bits <= 16; bits += 8) {
                uint32_t n = 1u << depth, largest = (1u << bits) - 1;
                for (uint32_t i = 0; i < n * n; i++) {
                    samples[i] =
                        shaped_sample((enum shape)shape, i % n, i / n, n, largest, &random);
                    /* size = height: in voxels it is sample * n / largest, the full one the top */
                    uint32_t top = samples[i] * n / largest;
                    tops[i] = (int)(top < n ? top : n - 1);
                }
                test_write_png("h.png", samples, n, n, 1, bits);
                struct lp_heightmap_params params = {
                    .height_path = "h.png", .size_m = 8, .height_m = 8, .depth = (uint8_t)depth};
                struct imported imported;
                import(&imported, &params);
                check_against(&imported.scene, &(struct solid){(int)n, (int)n, 0, tops});
                finish(&imported);
            }
}

TEST(fewer_columns_than_the_cube_are_centred)
{
    enum { N = 11, SIDE = 32 };
    uint16_t samples[N * N];
    int tops[N * N];
    test_random random = test_random_begin();
    for (int i = 0; i < N * N; i++) {
        samples[i] = (uint16_t)test_random_below(&random, 256);
        tops[i] = samples[i] * 20 / 255; /* 10 m in voxels of 0.5 m */
    }
    test_write_png("h.png", samples, N, N, 1, 8);
    struct lp_heightmap_params params = {
        .height_path = "h.png", .size_m = 5.5, .height_m = 10, .voxel_m = 0.5, .depth = 5};
    struct imported imported;
    import(&imported, &params);
    check_against(&imported.scene, &(struct solid){SIDE, N, (SIDE - N) / 2, tops});
    CHECK(imported.scene.voxel_size_m == 0.5);
    CHECK(imported.scene.origin_m[1] == 0.0);
    for (int axis = 0; axis < 3; axis += 2) { /* the map, not the cube, is centred on 0 */
        double low = imported.scene.origin_m[axis] + 0.5 * ((SIDE - N) / 2);
        CHECK_NEAR(low, -2.75, 1e-12);
    }
    finish(&imported);
}

TEST(sizes_and_places_follow_the_parameters)
{
    uint16_t samples[4] = {10, 20, 30, 255};
    test_write_png("h.png", samples, 2, 2, 1, 8);
    struct lp_heightmap_params params = {.height_path = "h.png", .size_m = 512, .height_m = 100};
    struct imported imported;
    import(&imported, &params);
    CHECK_EQ(imported.scene.tree.depth, LP_IMPORT_DEPTH_DEFAULT);
    CHECK(imported.scene.voxel_size_m == 0.5);
    CHECK(imported.scene.origin_m[0] == -256.0);
    CHECK(imported.scene.origin_m[1] == 0.0);
    CHECK(imported.scene.origin_m[2] == -256.0);
    CHECK_EQ(imported.scene.filter, LP_FILTER_VISIBLE);
    finish(&imported);
    params.depth = 3;
    params.filter = LP_FILTER_MEAN;
    import(&imported, &params);
    CHECK_EQ(imported.scene.filter, LP_FILTER_MEAN);
    finish(&imported);
}

/* The one voxel of a column in a flat scene. */
static void color_of_column(uint8_t srgb[3], const struct lp_scene *scene, uint32_t x, uint32_t z)
{
    uint32_t side = 1u << scene->tree.depth;
    for (uint32_t y = 0; y < side; y++)
        if (voxel_at(scene, x, y, z, srgb))
            return;
    test_abort(__FILE__, __LINE__, "no voxel in column (%u, %u)", x, z);
}

TEST(a_pixel_column_grows_along_x_and_a_row_along_z)
{
    enum { N = 8 };
    uint16_t heights[N * N], colors[N * N * 3];
    for (uint32_t i = 0; i < N * N; i++) {
        heights[i] = (uint16_t)(32 * (i % N) + (i / N == 0 ? 5 : 0)); /* up along the columns */
        colors[3 * i] = (uint16_t)(10 + 20 * (i % N));
        colors[3 * i + 1] = (uint16_t)(20 + 20 * (i / N));
        colors[3 * i + 2] = 200;
    }
    test_write_png("h.png", heights, N, N, 1, 8);
    for (uint32_t bits = 8; bits <= 16; bits += 8) {
        uint16_t scaled[N * N * 3];
        for (size_t i = 0; i < N * N * 3; i++)
            scaled[i] = (uint16_t)(bits == 8 ? colors[i] : colors[i] * 257);
        test_write_png("c.png", scaled, N, N, 3, bits);
        struct lp_heightmap_params params = {
            .height_path = "h.png", .color_path = "c.png", .size_m = 8, .height_m = 8, .depth = 3};
        struct imported imported;
        import(&imported, &params);
        for (uint32_t z = 0; z < N; z++)
            for (uint32_t x = 0; x < N; x++) {
                uint8_t srgb[3];
                REQUIRE(voxel_at(&imported.scene, x, x, z, srgb)); /* 32 x / 255 * 8: x */
                CHECK_EQ(srgb[0], 10 + 20 * x);
                CHECK_EQ(srgb[1], 20 + 20 * z);
                CHECK_EQ(srgb[2], 200);
                CHECK(x + 1 == N || !voxel_at(&imported.scene, x, x + 1, z, NULL));
            }
        finish(&imported);
    }
}

TEST(colors_are_filtered_in_linear_light)
{
    uint16_t height = 0, colors[2 * 2 * 3] = {0};
    for (int c = 0; c < 3; c++)
        colors[c] = colors[9 + c] = 255; /* a checkerboard of black and white */
    test_write_png("h.png", &height, 1, 1, 1, 8);
    test_write_png("c.png", colors, 2, 2, 3, 8);
    struct lp_heightmap_params params = {.height_path = "h.png",
                                         .color_path = "c.png",
                                         .size_m = 1,
                                         .height_m = 1,
                                         .voxel_m = 1,
                                         .depth = 1};
    struct imported imported;
    import(&imported, &params); /* one column over all of it */
    uint8_t srgb[3];
    color_of_column(srgb, &imported.scene, 0, 0);
    CHECK_EQ(srgb[0], lp_srgb_from_linear(0.5f)); /* 188; filtered as sRGB it would be 128 */
    CHECK_EQ(srgb[0], 188);
    finish(&imported);
}

TEST(color_maps_of_any_size_and_kind_are_taken)
{
    uint16_t height = 0, colors[64 * 64 * 4];
    test_write_png("h.png", &height, 1, 1, 1, 8);
    static const uint32_t sizes[] = {1, 3, 64};
    for (uint32_t channels = 1; channels <= 4; channels++)
        for (size_t s = 0; s < 3; s++) {
            uint32_t n = sizes[s];
            for (size_t i = 0; i < (size_t)n * n; i++)
                for (uint32_t c = 0; c < channels; c++) /* alpha 128 must not matter */
                    colors[i * channels + c] =
                        (uint16_t)(c + 1 == channels && channels % 2 == 0 ? 128 : 60 * (c + 1));
            test_write_png("c.png", colors, n, n, channels, 8);
            struct lp_heightmap_params params = {.height_path = "h.png",
                                                 .color_path = "c.png",
                                                 .size_m = 1,
                                                 .height_m = 1,
                                                 .depth = 3};
            struct imported imported;
            import(&imported, &params);
            uint8_t srgb[3];
            color_of_column(srgb, &imported.scene, 7, 2);
            CHECK_EQ(srgb[0], 60);
            CHECK_EQ(srgb[1], channels < 3 ? 60 : 120);
            CHECK_EQ(srgb[2], channels < 3 ? 60 : 180);
            finish(&imported);
        }
}

TEST(without_a_color_map_height_makes_the_grey)
{
    uint16_t samples[4] = {0, 0, 255, 255};
    test_write_png("h.png", samples, 2, 2, 1, 8);
    struct lp_heightmap_params params = {
        .height_path = "h.png", .size_m = 1, .height_m = 0.5, .depth = 1};
    struct imported imported;
    import(&imported, &params);
    uint8_t low[3], high[3];
    REQUIRE(voxel_at(&imported.scene, 1, 0, 0, low) && voxel_at(&imported.scene, 0, 1, 1, high));
    CHECK_EQ(low[0], lp_srgb_from_linear(0.2f));
    CHECK_EQ(high[0], lp_srgb_from_linear(0.8f));
    CHECK(low[0] == low[1] && low[1] == low[2] && high[0] == high[1] && high[1] == high[2]);
    finish(&imported);
}

TEST(sixteen_bits_tell_heights_apart_that_eight_do_not)
{
    enum { N = 4, SIDE = 4096 };
    uint16_t samples[N * N];
    for (int i = 0; i < N * N; i++)
        samples[i] = (uint16_t)(32768 + 16 * i); /* a voxel is 16 steps high: 65536 / 4096 */
    test_write_png("h.png", samples, N, N, 1, 16);
    struct lp_heightmap_params params = {
        .height_path = "h.png", .size_m = N, .height_m = 4095.9375, .voxel_m = 1, .depth = 12};
    struct imported imported;
    import(&imported, &params);
    for (uint32_t i = 0; i < N * N; i++) {
        uint32_t x = (SIDE - N) / 2 + i % N, z = (SIDE - N) / 2 + i / N, y = 2048 + i;
        CHECK(voxel_at(&imported.scene, x, y, z, NULL));
        CHECK(!voxel_at(&imported.scene, x, y + 1, z, NULL));
    }
    finish(&imported);
}

TEST(maps_are_resampled_to_more_and_to_fewer_columns)
{
    uint16_t samples[64 * 64];
    static const uint32_t pixels[] = {3, 64, 20};
    for (size_t s = 0; s < 3; s++) {
        uint32_t w = pixels[s];
        for (uint32_t i = 0; i < w * w; i++) /* a plane: any tent keeps it, away from the edge */
            samples[i] = (uint16_t)(65535.0 * (i % w + 0.5) / w);
        test_write_png("h.png", samples, w, w, 1, 16);
        struct lp_heightmap_params params = {
            .height_path = "h.png", .size_m = 16, .height_m = 16, .depth = 4};
        struct imported imported;
        import(&imported, &params);
        uint32_t margin = w < 16 ? 16 / w / 2 + 1 : 1;
        for (uint32_t x = margin; x < 16 - margin; x++) /* the height at x + 0.5 is x + 0.5 */
            for (uint32_t z = 0; z < 16; z++) {
                CHECK(voxel_at(&imported.scene, x, x, z, NULL));
                CHECK(!voxel_at(&imported.scene, x, x + 1, z, NULL));
            }
        finish(&imported);
    }
}

static void fail_to_import(struct lp_error *err, enum lp_code code, const char *where,
                           const struct lp_heightmap_params *params)
{
    void *bytes = NULL;
    size_t byte_count = 77;
    *err = (struct lp_error){0};
    enum lp_code got = lp_import_heightmap(&bytes, &byte_count, params, err);
    if (got != code)
        test_fail(__FILE__, __LINE__, "\"%s\" instead of \"%s\": %s: %s", lp_code_text(got),
                  lp_code_text(code), err->where, err->text);
    CHECK_STR(err->where, where);
    CHECK(!bytes && byte_count == 77);
}

TEST(wrong_parameters_are_refused_by_their_flag)
{
    uint16_t samples[4] = {0, 0, 0, 255};
    test_write_png("h.png", samples, 2, 2, 1, 8);
    const struct lp_heightmap_params good = {
        .height_path = "h.png", .size_m = 8, .height_m = 1, .depth = 3};
    static const double bad[] = {0.0, -1.0, NAN, INFINITY, -INFINITY, 1e-300, 1e300};
    struct lp_heightmap_params params;
    struct lp_error err;
    for (size_t i = 0; i < sizeof bad / sizeof bad[0]; i++) {
        params = good;
        params.size_m = bad[i];
        fail_to_import(&err, LP_INVALID, "--size-m", &params);
        params = good;
        params.height_m = bad[i];
        fail_to_import(&err, LP_INVALID, "--height-m", &params);
        params = good;
        params.voxel_m = bad[i];
        if (i > 0) /* 0 is the default there */
            fail_to_import(&err, LP_INVALID, "--voxel-m", &params);
    }
    params = good;
    params.depth = LP_HEIGHTMAP_DEPTH_MAX + 1;
    fail_to_import(&err, LP_INVALID, "--depth", &params);
    CHECK_HAS(err.text, "1 to 14");
    params = good;
    params.height_path = NULL;
    fail_to_import(&err, LP_INVALID, "SOURCE", &params);
    params = good;
    params.voxel_m = 17;
    fail_to_import(&err, LP_INVALID, "--voxel-m", &params);
    CHECK_HAS(err.text, "larger than the area");
    params.voxel_m = 0.5;
    fail_to_import(&err, LP_LIMIT, "--voxel-m", &params);
    CHECK_HAS(err.text, "--depth 4");
    params.voxel_m = 1e-5;
    fail_to_import(&err, LP_LIMIT, "--voxel-m", &params);
    CHECK_HAS(err.text, "larger voxels");
    CHECK(!strstr(err.text, "--depth"));
}

TEST(a_relief_taller_than_the_cube_is_refused_with_a_way_out)
{
    uint16_t samples[4] = {0, 0, 0, 255};
    test_write_png("h.png", samples, 2, 2, 1, 8);
    struct lp_heightmap_params params = {
        .height_path = "h.png", .size_m = 8, .height_m = 8.001, .depth = 3};
    struct lp_error err;
    fail_to_import(&err, LP_LIMIT, "--height-m", &params);
    CHECK_HAS(err.text, "--voxel-m");
    params.voxel_m = 1;
    fail_to_import(&err, LP_LIMIT, "--height-m", &params);
    CHECK_HAS(err.text, "--depth 4");
    params.height_m = 8; /* exactly full is the top voxel */
    struct imported imported;
    import(&imported, &params);
    CHECK(voxel_at(&imported.scene, 7, 7, 7, NULL));
    finish(&imported);
    samples[3] = 100; /* what counts is the relief, not what the format could hold */
    test_write_png("h.png", samples, 2, 2, 1, 8);
    params.height_m = 16;
    import(&imported, &params);
    finish(&imported);
}

TEST(maps_that_cannot_be_used_are_refused_by_name)
{
    uint16_t samples[6] = {0};
    struct lp_error err;
    struct lp_heightmap_params params = {
        .height_path = "h.png", .size_m = 8, .height_m = 1, .depth = 3};
    fail_to_import(&err, LP_IO, "h.png", &params);
    test_write_png("h.png", samples, 3, 2, 1, 8);
    fail_to_import(&err, LP_INVALID, "h.png", &params);
    CHECK_HAS(err.text, "3 x 2");
    CHECK_HAS(err.text, "square");
    CHECK_HAS(err.text, "crop or pad");
    test_write_png("h.png", samples, 2, 2, 1, 8);
    params.color_path = "c.png";
    fail_to_import(&err, LP_IO, "c.png", &params);
    test_write_png("c.png", samples, 1, 2, 3, 8);
    fail_to_import(&err, LP_INVALID, "c.png", &params);
    CHECK_HAS(err.text, "colour map must be square");
    /* Floats have no largest value. */
    FILE *stream = fopen("f.hdr", "wb");
    REQUIRE(stream);
    fputs("#?RADIANCE\nFORMAT=32-bit_rle_rgbe\n\n-Y 1 +X 1\n\x80\x80\x80\x80", stream);
    fclose(stream);
    params.color_path = NULL;
    params.height_path = "f.hdr";
    fail_to_import(&err, LP_INVALID, "f.hdr", &params);
    CHECK_HAS(err.text, "floats");
}

TEST(an_import_can_be_cancelled_and_says_how_far_it_is)
{
    uint16_t samples[4] = {0, 0, 0, 255};
    test_write_png("h.png", samples, 2, 2, 1, 8);
    struct lp_progress progress = {.done = 0};
    struct lp_heightmap_params params = {
        .height_path = "h.png", .size_m = 8, .height_m = 1, .depth = 5, .progress = &progress};
    atomic_store(&progress.cancelled, true);
    struct lp_error err;
    fail_to_import(&err, LP_CANCELLED, "h.png", &params);
    CHECK_STR(atomic_load(&progress.phase), "columns");
    CHECK_EQ(atomic_load(&progress.total), 32);
    atomic_store(&progress.cancelled, false);
    struct imported imported;
    import(&imported, &params);
    finish(&imported);
}
