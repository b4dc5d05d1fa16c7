/* Building a scene from an unsorted stream of coloured voxels.
 *
 * Give the voxels in any order and any number of pieces, then finish: the result is the bytes of a
 * scene file. The bytes depend on the set of pushed voxels and the parameters alone, neither on
 * their order nor on the number of threads.
 *
 * Duplicates: voxels of the same cell are merged into the mean of their values, taken in linear
 * light with integer sums (so that the order does not matter) and rounded to the nearest storable
 * value, ties up; normals are summed and normalised, opposite ones that cancel give +Y. */
#ifndef LP_BUILD_H
#define LP_BUILD_H

#include "engine/executor.h"
#include "engine/scene.h"

struct lp_build; /* a tree under construction */

struct lp_build_channel {
    enum lp_channel_kind kind;
    char name[LP_NAME_BYTES];
};

/* All zero is the default, but depth and voxel_size_m must be given. */
struct lp_build_params {
    uint8_t depth;          /* 1..LP_DEPTH_MAX */
    enum lp_filter filter;  /* 0: LP_FILTER_VISIBLE */
    double voxel_size_m;    /* > 0, finite */
    double origin_m[3];     /* world place of the cube's lowest corner */
    uint32_t channel_count; /* channels beside albedo, which is always there and always first */
    const struct lp_build_channel *channels; /* copied */
    uint64_t memory_limit_bytes;             /* 0: none. LP_LIMIT when the voxels need more */
    struct lp_executor *executor;            /* NULL: serial; must outlive the build */
    struct lp_progress *progress;            /* NULL: none; must outlive the build */
};

/* One voxel: its cell (each 0..2^depth - 1) and albedo, sRGB-encoded. */
struct lp_voxel {
    uint32_t x, y, z;
    uint8_t albedo_srgb[3];
};

/* Heap; destroy with lp_build_destroy. LP_INVALID names the field of `params` that is wrong. */
LP_MUST_CHECK enum lp_code
lp_build_create(struct lp_build **out, const struct lp_build_params *params, struct lp_error *err);

/* Adds `count` voxels. `extra_rgb_lin[c]` holds `3 * count` floats for extra channel c (linear
 * radiance >= 0, or a normal vector); the array may be NULL when there are no extra channels.
 * LP_INVALID: a cell outside the cube or a value that is not finite; nothing of this call is kept.
 * Not to be called from two threads at once. Amortised O(count). */
LP_MUST_CHECK enum lp_code lp_build_push(struct lp_build *build, const struct lp_voxel *voxels,
                                         const float *const *extra_rgb_lin, size_t count,
                                         struct lp_error *err);

/* Makes the scene file's bytes. `*out` is a fresh block of `*out_bytes`, 64-byte aligned, to be
 * given to free(). The voxels are used up: the build can only be destroyed afterwards.
 * LP_INVALID: no voxels at all. Blocks for the whole work; uses the executor. */
LP_MUST_CHECK enum lp_code lp_build_finish(void **out, size_t *out_bytes, struct lp_build *build,
                                           struct lp_error *err);

/* Accepts NULL and sets it. */
void lp_build_destroy(struct lp_build **build);

#endif
