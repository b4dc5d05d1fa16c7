/* Building: every voxel arrives, duplicates merge by the rule, coarse colours are what they say. */
#include "engine/build_task.h"
#include "engine/channel.h"
#include "engine/octahedral.h"
#include "engine/srgb.h"
#include "clients/cli/pool.h"
#include "tests/engine/small_scene.h"
#include "tests/harness/test.h"

#include <math.h>
#include <string.h>

/* A scene of 2^4 cells a side as a plain array, to compare with. */
#define SIDE 16
struct grid {
    bool solid[SIDE][SIDE][SIDE]; /* [x][y][z] */
    float rgb[SIDE][SIDE][SIDE][3];
};

static void grid_random(struct grid *grid, struct lp_voxel *voxels, uint32_t *count, uint32_t fill,
                        test_random *r)
{
    memset(grid, 0, sizeof *grid);
    *count = 0;
    for (uint32_t x = 0; x < SIDE; x++)
        for (uint32_t y = 0; y < SIDE; y++)
            for (uint32_t z = 0; z < SIDE; z++) {
                if (test_random_below(r, 100) >= fill)
                    continue;
                struct lp_voxel v = {
                    x,
                    y,
                    z,
                    {(uint8_t)test_random_u64(r), (uint8_t)test_random_u64(r), (uint8_t)x}};
                grid->solid[x][y][z] = true;
                for (int c = 0; c < 3; c++)
                    grid->rgb[x][y][z][c] = lp_srgb_to_linear[v.albedo_srgb[c]];
                voxels[(*count)++] = v;
            }
    for (uint32_t i = *count; i > 1; i--) { /* unsorted */
        uint32_t j = test_random_below(r, i);
        struct lp_voxel v = voxels[i - 1];
        voxels[i - 1] = voxels[j];
        voxels[j] = v;
    }
}

static int faces_open(const struct grid *grid, int x, int y, int z)
{
    static const int step[6][3] = {{1, 0, 0},  {-1, 0, 0}, {0, 1, 0},
                                   {0, -1, 0}, {0, 0, 1},  {0, 0, -1}};
    int open = 0;
    for (int f = 0; f < 6; f++) {
        int nx = x + step[f][0], ny = y + step[f][1], nz = z + step[f][2];
        bool inside = nx >= 0 && ny >= 0 && nz >= 0 && nx < SIDE && ny < SIDE && nz < SIDE;
        open += !inside || !grid->solid[nx][ny][nz];
    }
    return open;
}

/* The value of a node by the header's words, from the plain array and in double. */
struct value {
    bool there;
    double rgb[3], weight;
};

static struct value expect(const struct grid *grid, enum lp_filter filter, uint8_t level, int x,
                           int y, int z)
{
    struct value v = {0};
    if (level == 0) {
        v.there = grid->solid[x][y][z];
        v.weight = filter == LP_FILTER_MEAN ? 1 : faces_open(grid, x, y, z);
        for (int c = 0; c < 3; c++)
            v.rgb[c] = (double)grid->rgb[x][y][z][c];
        return v;
    }
    double plain[3] = {0}, weighted[3] = {0}, count = 0;
    for (int i = 0; i < 8; i++) {
        struct value child = expect(grid, filter, (uint8_t)(level - 1), 2 * x + (i & 1),
                                    2 * y + (i >> 1 & 1), 2 * z + (i >> 2));
        if (!child.there)
            continue;
        for (int c = 0; c < 3; c++) {
            plain[c] += child.rgb[c];
            weighted[c] += child.rgb[c] * child.weight;
        }
        v.weight += child.weight;
        count++;
    }
    v.there = count > 0;
    for (int c = 0; c < 3 && v.there; c++)
        v.rgb[c] = v.weight > 0 ? weighted[c] / v.weight : plain[c] / count;
    if (filter == LP_FILTER_MEAN)
        v.weight = 1;
    return v;
}

static void check_nodes(const struct lp_scene *scene, const struct grid *grid)
{
    for (uint8_t level = 0; level <= 4; level++) {
        int side = SIDE >> level;
        uint32_t there = 0;
        for (int x = 0; x < side; x++)
            for (int y = 0; y < side; y++)
                for (int z = 0; z < side; z++) {
                    uint32_t cell[3] = {(uint32_t)x << level, (uint32_t)y << level,
                                        (uint32_t)z << level};
                    lp_node node;
                    bool found = lp_octree_find(&node, &scene->tree, cell, level);
                    struct value v = expect(grid, scene->filter, level, x, y, z);
                    CHECK_EQ(found, v.there);
                    if (!found || !v.there)
                        continue;
                    there++;
                    float rgb[3];
                    lp_channel_rgb(rgb, &scene->channels[0],
                                   lp_octree_attribute(&scene->tree, node));
                    for (int c = 0; c < 3; c++) /* half a step of the 8-bit code, at its widest */
                        CHECK_NEAR(rgb[c], v.rgb[c], level == 0 ? 0 : 0.0047);
                }
        CHECK_EQ(there, scene->tree.level_count[level]);
    }
}

static enum lp_code build(void **bytes, size_t *count, const struct lp_build_params *params,
                          const struct lp_voxel *voxels, const float *const *extra, size_t n,
                          struct lp_error *error)
{
    struct lp_build *b = NULL;
    enum lp_code code = lp_build_create(&b, params, error);
    if (code == LP_OK)
        code = lp_build_push(b, voxels, extra, n, error);
    if (code == LP_OK)
        code = lp_build_finish(bytes, count, b, error);
    lp_build_destroy(&b);
    return code;
}

TEST(build_gives_every_node_its_filtered_colour)
{
    static struct grid grid;
    static struct lp_voxel voxels[SIDE * SIDE * SIDE];
    test_random r = test_random_begin();
    static const uint32_t fills[] = {1, 10, 60, 97};
    for (int i = 0; i < 8; i++) {
        uint32_t count;
        grid_random(&grid, voxels, &count, fills[i / 2], &r);
        struct lp_build_params params = {
            .depth = 4, .voxel_size_m = 0.5, .filter = i & 1 ? LP_FILTER_MEAN : LP_FILTER_VISIBLE};
        struct lp_error error = {0};
        void *bytes = NULL;
        size_t byte_count;
        struct lp_scene scene;
        REQUIRE(build(&bytes, &byte_count, &params, voxels, NULL, count, &error) == LP_OK);
        REQUIRE(lp_scene_view(&scene, bytes, byte_count, LP_TRUST_NOTHING, &error) == LP_OK);
        CHECK_EQ(scene.tree.level_count[0], count);
        check_nodes(&scene, &grid);
        free(bytes);
    }
}

TEST(exposed_faces_are_those_of_a_plain_look)
{
    static struct grid grid;
    static struct lp_voxel voxels[SIDE * SIDE * SIDE];
    test_random r = test_random_begin();
    uint32_t count;
    grid_random(&grid, voxels, &count, 70, &r);
    struct small_scene small;
    small_scene_make(&small, 4, voxels, count);
    for (uint32_t i = 0; i < count; i++) {
        uint32_t cell[3] = {voxels[i].x & ~3u, voxels[i].y & ~3u, voxels[i].z & ~3u};
        uint64_t bit = lp_morton_key(voxels[i].x & 3, voxels[i].y & 3, voxels[i].z & 3);
        lp_node brick;
        REQUIRE(lp_octree_find(&brick, &small.scene.tree, cell, 2));
        uint64_t exposed[6];
        lp_build_exposed(exposed, &small.scene.tree, small.scene.tree.wide[0][brick.index].mask,
                         cell);
        static const int step[6][3] = {{1, 0, 0},  {-1, 0, 0}, {0, 1, 0},
                                       {0, -1, 0}, {0, 0, 1},  {0, 0, -1}};
        for (int f = 0; f < 6; f++) {
            int x = (int)voxels[i].x + step[f][0], y = (int)voxels[i].y + step[f][1],
                z = (int)voxels[i].z + step[f][2];
            bool inside = x >= 0 && y >= 0 && z >= 0 && x < SIDE && y < SIDE && z < SIDE;
            CHECK_EQ(exposed[f] >> bit & 1, !inside || !grid.solid[x][y][z]);
        }
    }
    small_scene_finish(&small);
}

/* Random voxels with many duplicates, three extra channels. */
#define MANY 300000
static void make_many(struct lp_voxel *voxels, float *extra[3], uint8_t depth, test_random *r)
{
    for (uint32_t i = 0; i < MANY; i++) {
        uint32_t side = depth > 6 && i & 1 ? 64 : 1u << depth;
        voxels[i] =
            (struct lp_voxel){test_random_below(r, side),
                              test_random_below(r, side),
                              test_random_below(r, side),
                              {(uint8_t)test_random_u64(r), (uint8_t)test_random_u64(r), 9}};
        for (int c = 0; c < 3; c++)
            for (int a = 0; a < 3; a++)
                extra[c][3 * i + (uint32_t)a] =
                    (float)(test_random_unit(r) * 100 - (c == 2 ? 50 : 0));
    }
}

TEST(bytes_do_not_depend_on_order_pieces_or_threads)
{
    static const struct lp_build_channel channels[] = {{LP_CHANNEL_RADIANCE, "noon"},
                                                       {LP_CHANNEL_EMISSION, "emission"},
                                                       {LP_CHANNEL_NORMAL, "normal"}};
    test_random r = test_random_begin();
    struct lp_voxel *voxels = malloc(MANY * sizeof *voxels);
    float *extra[3];
    for (int c = 0; c < 3; c++)
        REQUIRE((extra[c] = malloc(MANY * 3 * sizeof(float))) != NULL);
    struct pool *pool = NULL;
    struct lp_error error = {0};
    REQUIRE(pool_create(&pool, 4, &error) == LP_OK);
    for (uint8_t depth = 5; depth <= 18; depth += 13) {
        make_many(voxels, extra, depth, &r);
        struct lp_build_params params = {
            .depth = depth, .voxel_size_m = 1, .channel_count = 3, .channels = channels};
        void *first, *second;
        size_t first_count, second_count;
        REQUIRE(build(&first, &first_count, &params, voxels, (const float *const *)extra, MANY,
                      &error) == LP_OK);
        params.executor = pool_executor(pool);
        for (uint32_t i = MANY; i > 1; i--) {
            uint32_t j = test_random_below(&r, i);
            struct lp_voxel v = voxels[i - 1];
            voxels[i - 1] = voxels[j];
            voxels[j] = v;
            for (int c = 0; c < 3; c++)
                for (uint32_t a = 0; a < 3; a++) {
                    float e = extra[c][3 * (i - 1) + a];
                    extra[c][3 * (i - 1) + a] = extra[c][3 * j + a];
                    extra[c][3 * j + a] = e;
                }
        }
        struct lp_build *b = NULL;
        REQUIRE(lp_build_create(&b, &params, &error) == LP_OK);
        for (uint32_t at = 0; at < MANY;) {
            uint32_t n = test_random_below(&r, 9999) + 1;
            n = n < MANY - at ? n : MANY - at;
            const float *piece[3] = {extra[0] + 3 * at, extra[1] + 3 * at, extra[2] + 3 * at};
            REQUIRE(lp_build_push(b, voxels + at, piece, n, &error) == LP_OK);
            at += n;
        }
        REQUIRE(lp_build_finish(&second, &second_count, b, &error) == LP_OK);
        lp_build_destroy(&b);
        CHECK_EQ(first_count, second_count);
        CHECK(first_count == second_count && memcmp(first, second, first_count) == 0);
        struct lp_scene scene;
        CHECK_EQ(lp_scene_view(&scene, second, second_count, LP_TRUST_NOTHING, &error), LP_OK);
        free(first);
        free(second);
    }
    pool_destroy(&pool);
    for (int c = 0; c < 3; c++)
        free(extra[c]);
    free(voxels);
}

TEST(duplicates_become_their_linear_mean)
{
    static const struct lp_build_channel channels[] = {{LP_CHANNEL_RADIANCE, "noon"},
                                                       {LP_CHANNEL_NORMAL, "normal"}};
    struct lp_voxel voxels[] = {
        {3, 3, 3, {0, 255, 10}}, {3, 3, 3, {255, 255, 10}}, {1, 2, 3, {4, 5, 6}}};
    float noon[] = {50, 0, 0, 0, 100, 0, 7, 8, 9}, normal[] = {0, 0, 1, 0, 0, -1, 1, 0, 0};
    const float *extra[] = {noon, normal};
    struct lp_build_params params = {
        .depth = 3, .voxel_size_m = 1, .channel_count = 2, .channels = channels};
    struct lp_error error = {0};
    void *bytes = NULL;
    size_t count;
    struct lp_scene scene;
    REQUIRE(build(&bytes, &count, &params, voxels, extra, 3, &error) == LP_OK);
    REQUIRE(lp_scene_view(&scene, bytes, count, LP_TRUST_NOTHING, &error) == LP_OK);
    CHECK_EQ(scene.tree.level_count[0], 2);
    lp_node node;
    REQUIRE(lp_octree_find(&node, &scene.tree, (uint32_t[]){3, 3, 3}, 0));
    uint64_t at = lp_octree_attribute(&scene.tree, node);
    const uint8_t *albedo = scene.channels[0].values + 3 * at;
    CHECK_EQ(albedo[0], 188); /* half of linear 1 */
    CHECK_EQ(albedo[1], 255);
    CHECK_EQ(albedo[2], 10);
    float rgb[3];
    lp_channel_rgb(rgb, &scene.channels[1], at);
    CHECK(rgb[0] == 25.0f && rgb[1] == 50.0f && rgb[2] == 0.0f);
    uint16_t code;
    memcpy(&code, scene.channels[2].values + 2 * at, sizeof code);
    lp_oct16_decode(rgb, code);
    CHECK_NEAR(rgb[1], 1, 0); /* opposite normals cancel: +Y */
    free(bytes);
}

static void check_refused(const struct lp_build_params *params, const struct lp_voxel *voxel,
                          const char *where, const char *word)
{
    struct lp_error error = {0};
    void *bytes = NULL;
    size_t count;
    CHECK(build(&bytes, &count, params, voxel, NULL, voxel != NULL, &error) != LP_OK);
    CHECK_STR(error.where, where);
    CHECK_HAS(error.text, word);
    CHECK(bytes == NULL);
}

TEST(bad_parameters_and_voxels_are_refused_with_a_sentence)
{
    struct lp_voxel voxel = {1, 1, 1, {1, 1, 1}}, outside = {1, 16, 1, {1, 1, 1}};
    struct lp_build_params good = {.depth = 4, .voxel_size_m = 1}, p;
    p = good, p.depth = 0;
    check_refused(&p, &voxel, "depth", "1 to 18");
    p = good, p.depth = 19;
    check_refused(&p, &voxel, "depth", "1 to 18");
    p = good, p.voxel_size_m = 0;
    check_refused(&p, &voxel, "voxel_size_m", "positive");
    p = good, p.voxel_size_m = (double)NAN;
    check_refused(&p, &voxel, "voxel_size_m", "positive");
    p = good, p.origin_m[1] = (double)INFINITY;
    check_refused(&p, &voxel, "origin_m", "finite");
    check_refused(&good, &outside, "voxel", "(1, 16, 1)");
    check_refused(&good, NULL, "voxels", "empty");
    p = good, p.memory_limit_bytes = 1000;
    check_refused(&p, &voxel, "", "smaller depth");
    static const struct lp_build_channel twice[] = {{LP_CHANNEL_RADIANCE, "a"},
                                                    {LP_CHANNEL_RADIANCE, "a"}};
    p = good, p.channels = twice, p.channel_count = 2;
    check_refused(&p, &voxel, "a", "two channels");
    static const struct lp_build_channel slash[] = {{LP_CHANNEL_RADIANCE, "a/b"}};
    p = good, p.channels = slash, p.channel_count = 1;
    check_refused(&p, &voxel, "channels", "not a name");
}

TEST(a_cancelled_build_says_so)
{
    struct lp_progress progress = {0};
    atomic_store(&progress.cancelled, true);
    struct lp_build_params params = {.depth = 4, .voxel_size_m = 1, .progress = &progress};
    struct lp_voxel voxel = {1, 1, 1, {1, 1, 1}};
    struct lp_error error = {0};
    void *bytes = NULL;
    size_t count;
    CHECK_EQ(build(&bytes, &count, &params, &voxel, NULL, 1, &error), LP_CANCELLED);
}

TEST(octahedral_codes_stay_close_to_the_direction)
{
    test_random r = test_random_begin();
    for (int i = 0; i < 100000; i++) {
        float d[3], back[3];
        float length = 0;
        for (int a = 0; a < 3; a++) {
            d[a] = (float)(test_random_unit(&r) * 2 - 1);
            length += d[a] * d[a];
        }
        length = sqrtf(length);
        if (length < 0.01f)
            continue;
        lp_oct16_decode(back, lp_oct16_encode(d));
        float dot = (d[0] * back[0] + d[1] * back[1] + d[2] * back[2]) / length;
        CHECK(dot > 0.99993f); /* 0.7 degrees: half a step of 1/127 on the octahedron, twice */
    }
}

TEST(octahedral_codes_are_the_nearest_of_all)
{
    test_random r = test_random_begin();
    for (int i = 0; i < 300; i++) {
        float d[3], back[3];
        for (int a = 0; a < 3; a++)
            d[a] = (float)(test_random_unit(&r) * 2 - 1);
        lp_oct16_decode(back, lp_oct16_encode(d));
        float got = d[0] * back[0] + d[1] * back[1] + d[2] * back[2], best = -2;
        for (uint32_t code = 0; code < 65536; code++) {
            if ((code & 0xff) == 0x80 || code >> 8 == 0x80)
                continue; /* -128 is not used */
            lp_oct16_decode(back, (uint16_t)code);
            float dot = d[0] * back[0] + d[1] * back[1] + d[2] * back[2];
            best = dot > best ? dot : best;
        }
        CHECK_NEAR(got, best, 1e-6);
    }
}
