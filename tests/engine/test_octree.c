/* Node names, ranks and searching, against a plain list of cells. */
#include "engine/octree.h"
#include "tests/engine/small_scene.h"
#include "tests/harness/test.h"

#include <stdlib.h>
#include <string.h>

TEST(octants_of_a_mask_are_its_bytes)
{
    test_random r = test_random_begin();
    for (int i = 0; i < 100000; i++) {
        uint64_t mask = test_random_u64(&r) & test_random_u64(&r) & test_random_u64(&r);
        mask &= i & 1 ? test_random_u64(&r) & test_random_u64(&r) : ~UINT64_C(0);
        uint32_t plain = 0;
        for (int o = 0; o < 8; o++)
            plain |= (uint32_t)((mask >> (8 * o) & 0xff) != 0) << o;
        CHECK_EQ(lp_mask_octants(mask), plain);
    }
    CHECK_EQ(lp_mask_octants(0), 0);
    CHECK_EQ(lp_mask_octants(~UINT64_C(0)), 255);
}

TEST(morton_keys_and_coordinates_are_inverse)
{
    test_random r = test_random_begin();
    for (int i = 0; i < 100000; i++) {
        uint32_t c[3];
        for (int a = 0; a < 3; a++)
            c[a] = test_random_below(&r, 1u << 18);
        uint64_t key = lp_morton_key(c[0], c[1], c[2]), plain = 0;
        for (int b = 0; b < 18; b++)
            for (int a = 0; a < 3; a++)
                plain |= (uint64_t)(c[a] >> b & 1) << (3 * b + a);
        CHECK(key == plain);
        for (int a = 0; a < 3; a++)
            CHECK_EQ(lp_morton_gather(key >> a), c[a]);
    }
}

static int compare_keys(const void *a, const void *b)
{
    uint64_t x = *(const uint64_t *)a, y = *(const uint64_t *)b;
    return x < y ? -1 : x > y;
}

/* Ranks are places in Morton order, on every level, and only cells that were given are there. */
TEST(ranks_are_places_in_morton_order)
{
    test_random r = test_random_begin();
    for (uint8_t depth = 1; depth <= 18; depth++) {
        enum { COUNT = 400 };
        struct lp_voxel voxels[COUNT];
        uint64_t keys[COUNT];
        uint32_t side = 1u << depth;
        for (int i = 0; i < COUNT; i++)
            voxels[i] = (struct lp_voxel){test_random_below(&r, side),
                                          test_random_below(&r, side),
                                          test_random_below(&r, side),
                                          {0, 0, 0}};
        struct small_scene small;
        small_scene_make(&small, depth, voxels, COUNT);
        const struct lp_octree *tree = &small.scene.tree;
        for (uint8_t level = 0; level <= depth; level++) {
            for (int i = 0; i < COUNT; i++)
                keys[i] = lp_morton_key(voxels[i].x, voxels[i].y, voxels[i].z) >> (3 * level);
            qsort(keys, COUNT, sizeof keys[0], compare_keys);
            uint32_t rank = 0;
            for (int i = 0; i < COUNT; i++) {
                if (i > 0 && keys[i] == keys[i - 1])
                    continue;
                uint32_t cell[3];
                for (int a = 0; a < 3; a++)
                    cell[a] = lp_morton_gather(keys[i] >> a) << level;
                lp_node node;
                REQUIRE(lp_octree_find(&node, tree, cell, level));
                CHECK_EQ(node.level, level);
                CHECK_EQ(lp_octree_rank(tree, node), rank);
                CHECK_EQ(lp_octree_attribute(tree, node), tree->level_first[level] + rank);
                rank++;
            }
            CHECK_EQ(tree->level_count[level], rank);
        }
        for (int i = 0; i < COUNT; i++) { /* and nothing else is there */
            uint32_t cell[3] = {test_random_below(&r, side), test_random_below(&r, side),
                                test_random_below(&r, side)};
            bool given = false;
            for (int j = 0; j < COUNT; j++)
                given |= voxels[j].x == cell[0] && voxels[j].y == cell[1] && voxels[j].z == cell[2];
            lp_node node;
            CHECK_EQ(lp_octree_find(&node, tree, cell, 0), given);
        }
        small_scene_finish(&small);
    }
}

TEST(bounds_are_those_of_the_voxels)
{
    test_random r = test_random_begin();
    for (int round = 0; round < 300; round++) {
        uint8_t depth = (uint8_t)(1 + test_random_below(&r, 18));
        uint32_t count = 1 + test_random_below(&r, 20), side = 1u << depth;
        struct lp_voxel voxels[20];
        uint32_t low[3] = {side, side, side}, high[3] = {0, 0, 0}, got_low[3], got_high[3];
        for (uint32_t i = 0; i < count; i++) {
            uint32_t c[3];
            for (int a = 0; a < 3; a++) {
                c[a] = test_random_below(&r, side);
                low[a] = c[a] < low[a] ? c[a] : low[a];
                high[a] = c[a] + 1 > high[a] ? c[a] + 1 : high[a];
            }
            voxels[i] = (struct lp_voxel){c[0], c[1], c[2], {0, 0, 0}};
        }
        struct small_scene small;
        small_scene_make(&small, depth, voxels, count);
        lp_octree_bounds(got_low, got_high, &small.scene.tree);
        CHECK(memcmp(low, got_low, sizeof low) == 0 && memcmp(high, got_high, sizeof high) == 0);
        small_scene_finish(&small);
    }
}
