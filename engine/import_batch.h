/* Collects an importer's voxels and pushes them into a build in pieces; private to importers. */
#ifndef LP_IMPORT_BATCH_H
#define LP_IMPORT_BATCH_H

#include "engine/build.h"

#define LP_BATCH_VOXELS 4096

/* Heap (it is large): lp_batch_create, lp_batch_destroy. */
struct lp_batch {
    struct lp_build *build; /* borrowed */
    size_t count;
    struct lp_voxel voxels[LP_BATCH_VOXELS];
    float extra_rgb_lin[3 * LP_BATCH_VOXELS]; /* of the one extra channel a build may have here */
};

/* An empty batch for a build with at most one extra channel. LP_NO_MEMORY. */
LP_MUST_CHECK enum lp_code lp_batch_create(struct lp_batch **out, struct lp_build *build,
                                           struct lp_error *err);

/* Adds one voxel; `extra_rgb_lin` is its value in the extra channel, NULL without one. Errors are
 * those of lp_build_push. */
LP_MUST_CHECK enum lp_code lp_batch_add(struct lp_batch *batch, const struct lp_voxel *voxel,
                                        const float *extra_rgb_lin, struct lp_error *err);

/* Pushes what is left. */
LP_MUST_CHECK enum lp_code lp_batch_flush(struct lp_batch *batch, struct lp_error *err);

/* Accepts NULL and sets it; what was not flushed is dropped. */
void lp_batch_destroy(struct lp_batch **batch);

#endif
