/* Small scenes in memory, for tests: built by the real builder from a few voxels. */
#ifndef LP_TEST_SMALL_SCENE_H
#define LP_TEST_SMALL_SCENE_H

#include "engine/scene_file.h"
#include "engine/build.h"
#include "tests/harness/test.h"

#include <stdlib.h>

struct small_scene {
    void *bytes;
    size_t byte_count;
    struct lp_scene scene;
};

/* A scene of `count` voxels, one metre each, origin 0. */
static inline void small_scene_make(struct small_scene *out, uint8_t depth,
                                    const struct lp_voxel *voxels, size_t count)
{
    struct lp_error error = {0};
    struct lp_build_params params = {.depth = depth, .voxel_size_m = 1};
    struct lp_build *build = NULL;
    if (lp_build_create(&build, &params, &error) != LP_OK ||
        lp_build_push(build, voxels, NULL, count, &error) != LP_OK ||
        lp_build_finish(&out->bytes, &out->byte_count, build, &error) != LP_OK ||
        lp_scene_view(&out->scene, out->bytes, out->byte_count, LP_TRUST_NOTHING, &error) != LP_OK)
        test_abort(__FILE__, __LINE__, "no scene: %s: %s", error.where, error.text);
    lp_build_destroy(&build);
}

/* `count` random voxels (duplicates happen) in the block of `side` cells whose lowest corner is
 * (low, low, low). */
static inline void small_scene_random(struct small_scene *out, uint8_t depth, uint32_t low,
                                      uint32_t side, uint32_t count, test_random *random)
{
    struct lp_voxel *voxels = malloc(count * sizeof *voxels);
    REQUIRE(voxels != NULL);
    for (uint32_t i = 0; i < count; i++)
        voxels[i] = (struct lp_voxel){low + test_random_below(random, side),
                                      low + test_random_below(random, side),
                                      low + test_random_below(random, side),
                                      {(uint8_t)i, (uint8_t)(i >> 8), 7}};
    small_scene_make(out, depth, voxels, count);
    free(voxels);
}

static inline void small_scene_finish(struct small_scene *small)
{
    free(small->bytes);
    *small = (struct small_scene){0};
}

#endif
