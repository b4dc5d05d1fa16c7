/* Plans, tiles and counters on scenes whose pictures are known beforehand. */
#include "engine/render.h"
#include "engine/srgb.h"
#include "tests/engine/small_scene.h"
#include "tests/harness/test.h"

#include <fenv.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>
#include <xmmintrin.h>

static struct lp_render_params all_faces(enum lp_mode mode, uint32_t face_px)
{
    struct lp_render_params p = {.mode = mode,
                                 .face_px = face_px,
                                 .samples_per_axis = 4,
                                 .face_count = 6,
                                 .lighting = "albedo"};
    for (int f = 0; f < 6; f++)
        p.faces[f] = (enum lp_face)f;
    return p;
}

static struct lp_counters render(struct lp_film *film, const struct lp_render_plan *plan,
                                 bool backwards)
{
    struct lp_counters sum = {0};
    lp_film_init(film, plan, malloc(plan->film_bytes));
    memset(film->radiance, 0xff, plan->film_bytes); /* NaN: what is not written shows */
    for (uint32_t i = 0; i < plan->tile_count; i++) {
        struct lp_counters tile;
        lp_render_tile(film, &tile, plan, backwards ? plan->tile_count - 1 - i : i);
        lp_counters_add(&sum, &tile);
    }
    return sum;
}

static void check_sums(const struct lp_render_plan *plan, const struct lp_counters *c)
{
    uint64_t classes = c->pixels_background, levels = c->pixels_background;
    for (int i = 0; i < LP_RAY_CLASSES; i++)
        classes += c->pixels_by_class[i];
    for (int i = 0; i < LP_LEVEL_CLASSES; i++)
        levels += c->pixels_by_level[i];
    uint64_t pixels =
        (uint64_t)plan->params.face_count * plan->params.face_px * plan->params.face_px;
    CHECK_EQ(c->pixels, pixels);
    CHECK_EQ(classes, pixels);
    CHECK_EQ(levels, pixels);
    CHECK(c->rays_hit <= c->rays && c->rays <= plan->rays_max && c->traversal_steps >= c->rays);
    CHECK_EQ(c->rays_discarded, 0);
}

TEST(every_texel_is_written_whatever_the_size_and_order)
{
    struct small_scene small;
    test_random r = test_random_begin();
    small_scene_random(&small, 5, 8, 16, 900, &r);
    static const uint32_t sizes[] = {1, 2, 31, 32, 33, 70};
    for (int i = 0; i < 12; i++) {
        struct lp_render_params p =
            all_faces(i & 1 ? LP_MODE_LOD : LP_MODE_REFERENCE, sizes[i / 2]);
        p.samples_per_axis = 1 + (uint32_t)i % 5;
        p.position_m[0] = p.position_m[1] = p.position_m[2] = 4.3;
        p.environment[1] = 0.25f;
        struct lp_render_plan plan;
        struct lp_error error = {0};
        REQUIRE(lp_render_prepare(&plan, &small.scene, &p, &error) == LP_OK);
        struct lp_film a, b;
        struct lp_counters counts = render(&a, &plan, false), again = render(&b, &plan, true);
        check_sums(&plan, &counts);
        CHECK(memcmp(&counts, &again, sizeof counts) == 0);
        CHECK(memcmp(a.radiance, b.radiance, plan.film_bytes) == 0);
        for (size_t k = 0; k < plan.film_bytes / sizeof(float); k++)
            CHECK(isfinite(a.radiance[k]));
        free(a.radiance);
        free(b.radiance);
    }
    small_scene_finish(&small);
}

TEST(an_empty_view_is_the_environment)
{
    struct small_scene small;
    struct lp_voxel voxel = {0, 0, 0, {255, 255, 255}};
    small_scene_make(&small, 4, &voxel, 1);
    struct lp_render_params p = all_faces(LP_MODE_REFERENCE, 8);
    p.face_count = 1; /* +X only; the voxel lies behind */
    p.position_m[0] = 8;
    p.environment[0] = 50, p.environment[1] = 0.1f, p.environment[2] = 3;
    struct lp_render_plan plan;
    struct lp_film film;
    struct lp_error error = {0};
    REQUIRE(lp_render_prepare(&plan, &small.scene, &p, &error) == LP_OK);
    struct lp_counters c = render(&film, &plan, false);
    CHECK_EQ(c.pixels_background, 64);
    CHECK_EQ(c.rays, 64 * 16);
    CHECK_EQ(c.rays_hit, 0);
    for (int i = 0; i < 64; i++) {
        CHECK(film.radiance[3 * i] == 50.0f);
        CHECK_NEAR(film.radiance[3 * i + 1], 0.1, 1e-7);
    }
    free(film.radiance);
    small_scene_finish(&small);
}

/* A wall of two colours in a fine checker: `lod` sees its mean from afar, `reference` the mean of
 * what its rays meet. */
TEST(lod_takes_coarse_nodes_where_they_are_small)
{
    enum { SIDE = 64 };
    static struct lp_voxel wall[SIDE * SIDE];
    for (uint32_t y = 0; y < SIDE; y++)
        for (uint32_t z = 0; z < SIDE; z++) {
            uint8_t v = (y ^ z) & 1 ? 255 : 0;
            wall[y * SIDE + z] = (struct lp_voxel){60, y, z, {v, v, v}};
        }
    struct small_scene small;
    small_scene_make(&small, 6, wall, SIDE * SIDE);
    struct lp_render_params p = all_faces(LP_MODE_LOD, 16);
    p.face_count = 1;
    p.position_m[0] = 0.5, p.position_m[1] = p.position_m[2] = 32.2;
    struct lp_render_plan plan;
    struct lp_film film;
    struct lp_error error = {0};
    REQUIRE(lp_render_prepare(&plan, &small.scene, &p, &error) == LP_OK);
    struct lp_counters c = render(&film, &plan, false);
    /* At distance 56 a footprint is 56 * 2/16 = 7 voxels: nodes of 4, all half white. */
    float grey = lp_srgb_to_linear[188];
    for (int y = 7; y < 9; y++)
        for (int x = 7; x < 9; x++)
            CHECK(film.radiance[3 * (16 * y + x)] == grey);
    CHECK_EQ(c.pixels_by_level[2], c.pixels - c.pixels_background);
    free(film.radiance);
    p.levels = LP_LEVELS_FIXED;
    p.position_m[0] = 59; /* right before it: the cone would want voxels, fixed takes level 2 */
    REQUIRE(lp_render_prepare(&plan, &small.scene, &p, &error) == LP_OK);
    render(&film, &plan, false);
    CHECK(film.radiance[3 * (16 * 8 + 8)] == grey);
    free(film.radiance);
    small_scene_finish(&small);
}

static void check_refused(const struct lp_scene *scene, const struct lp_render_params *p,
                          enum lp_code code, const char *where)
{
    struct lp_render_plan plan;
    struct lp_error error = {0};
    CHECK_EQ(lp_render_prepare(&plan, scene, p, &error), code);
    CHECK_STR(error.where, where);
    CHECK(error.text[0] != 0);
}

TEST(bad_parameters_are_refused_by_name)
{
    struct small_scene small;
    struct lp_voxel voxel = {0, 0, 0, {255, 255, 255}};
    small_scene_make(&small, 4, &voxel, 1);
    struct lp_render_params good = all_faces(LP_MODE_REFERENCE, 8), p;
    p = good, p.face_px = 0;
    check_refused(&small.scene, &p, LP_INVALID, "face_px");
    p = good, p.face_px = 4097;
    check_refused(&small.scene, &p, LP_INVALID, "face_px");
    p = good, p.samples_per_axis = 33;
    check_refused(&small.scene, &p, LP_INVALID, "samples_per_axis");
    p = good, p.faces[1] = LP_FACE_POS_X;
    check_refused(&small.scene, &p, LP_INVALID, "faces");
    p = good, p.environment[2] = -1;
    check_refused(&small.scene, &p, LP_INVALID, "environment");
    p = good, p.position_m[1] = 1e9;
    check_refused(&small.scene, &p, LP_INVALID, "position_m");
    p = good, p.position_m[1] = (double)NAN;
    check_refused(&small.scene, &p, LP_INVALID, "position_m");
    p = good, p.lighting = "noon";
    check_refused(&small.scene, &p, LP_NOT_FOUND, "lighting");
    small_scene_finish(&small);
}

TEST(probes_in_bad_places_are_noticed)
{
    struct small_scene small;
    struct lp_voxel voxel = {3, 4, 5, {255, 255, 255}};
    small_scene_make(&small, 4, &voxel, 1);
    CHECK_EQ(lp_probe_warnings(&small.scene, (double[]){3.5, 4.5, 5.5}), LP_PROBE_INSIDE_MATTER);
    CHECK_EQ(lp_probe_warnings(&small.scene, (double[]){3.5, 5.5, 5.5}), 0);
    CHECK_EQ(lp_probe_warnings(&small.scene, (double[]){3.5, 2.5, 5.5}), LP_PROBE_BELOW_GROUND);
    CHECK_EQ(lp_probe_warnings(&small.scene, (double[]){4.5, 2.5, 5.5}), 0);
    CHECK_EQ(lp_probe_warnings(&small.scene, (double[]){3.5, -0.5, 5.5}), LP_PROBE_OUTSIDE_SCENE);
    CHECK_EQ(lp_probe_warnings(&small.scene, (double[]){16, 5.5, 5.5}), LP_PROBE_OUTSIDE_SCENE);
    small_scene_finish(&small);
}

TEST(the_films_hash_is_over_all_of_its_floats)
{
    float values[6 * 4 * 3] = {0};
    struct lp_film film = {.face_px = 2, .face_count = 6, .radiance = values};
    uint8_t first[LP_SHA256_BYTES], other[LP_SHA256_BYTES];
    /* SHA-256 of 288 zero bytes (any calculator). */
    static const uint8_t zeros[4] = {0x2d, 0x55, 0x65, 0xfb};
    lp_film_sha256(first, &film);
    CHECK(memcmp(first, zeros, sizeof zeros) == 0);
    for (int i = 0; i < 72; i++) {
        values[i] = 1.0f;
        lp_film_sha256(other, &film);
        CHECK(memcmp(first, other, sizeof first) != 0);
        values[i] = 0.0f;
    }
}

TEST(a_render_thread_begins_with_its_own_arithmetic)
{
    volatile float tiny = 0x1p-126f, one = 1.0f, third = 3.0f;
    fesetround(FE_UPWARD);
    _mm_setcsr(_mm_getcsr() | 0x8040u); /* denormals flushed, and taken for zero */
    CHECK(tiny / 2 == 0.0f && one / third > 0x1.555554p-2f);
    lp_render_thread_begin();
    CHECK(tiny / 2 == 0x1p-127f);
    CHECK(one / third == 0x1.555556p-2f);
    CHECK_EQ(fegetround(), FE_TONEAREST);
    fesetround(FE_DOWNWARD);
    CHECK(one / third == 0x1.555554p-2f); /* that the mode makes a difference here */
    lp_render_thread_begin();
    CHECK(one / third == 0x1.555556p-2f);
}

static struct lp_counters look(const struct lp_scene *scene, const double at[3])
{
    struct lp_render_params p = all_faces(LP_MODE_LOD, 16);
    struct lp_render_plan plan;
    struct lp_film film;
    struct lp_error error = {0};
    memcpy(p.position_m, at, sizeof p.position_m);
    REQUIRE(lp_render_prepare(&plan, scene, &p, &error) == LP_OK);
    struct lp_counters counts = render(&film, &plan, false);
    free(film.radiance);
    return counts;
}

/* A floor, a closed room, a hollow ball above a floor: the suggested place is in the open, or else
 * inside, never in matter, and matter and (in the open) sky are in view. */
TEST(suggested_probes_see_something)
{
    enum { SIDE = 64 };
    static struct lp_voxel voxels[3 * SIDE * SIDE * 6];
    for (int kind = 0; kind < 3; kind++) {
        uint32_t n = 0;
        for (uint32_t x = 0; x < SIDE; x++)
            for (uint32_t y = 0; y < SIDE; y++)
                for (uint32_t z = 0; z < SIDE; z++) {
                    int dx = (int)x - 32, dy = (int)y - 36, dz = (int)z - 32;
                    int r2 = dx * dx + dy * dy + dz * dz;
                    bool floor = y == (kind == 0 ? (x / 8 + z / 16) % 5 : 0);
                    bool wall = x == 0 || z == 0 || y == 63 || x == 63 || z == 63;
                    bool ball = r2 <= 400 && r2 > 324;
                    if (floor || (kind == 1 && wall) || (kind == 2 && ball))
                        voxels[n++] = (struct lp_voxel){x, y, z, {200, 100, 50}};
                }
        struct small_scene small;
        small_scene_make(&small, 6, voxels, n);
        const double *at = small.scene.suggested_probe_m;
        CHECK_EQ(lp_probe_warnings(&small.scene, at), 0);
        struct lp_counters counts = look(&small.scene, at);
        double seen = (double)counts.rays_hit / (double)counts.rays;
        if (kind == 1)
            CHECK(seen == 1.0);
        else
            CHECK(seen > 0.3 && seen < 1.0);
        small_scene_finish(&small);
    }
}
