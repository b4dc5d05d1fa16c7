/* A buffer of voxels between an importer and a build. */
#include "engine/import_batch.h"

#include <stdlib.h>
#include <string.h>

enum lp_code lp_batch_create(struct lp_batch **out, struct lp_build *build, struct lp_error *err)
{
    struct lp_batch *batch = malloc(sizeof *batch);
    if (!batch)
        return lp_fail(err, LP_NO_MEMORY, "", "no memory for a buffer of voxels");
    batch->build = build;
    batch->count = 0;
    *out = batch;
    return LP_OK;
}

enum lp_code lp_batch_add(struct lp_batch *batch, const struct lp_voxel *voxel,
                          const float *extra_rgb_lin, struct lp_error *err)
{
    batch->voxels[batch->count] = *voxel;
    if (extra_rgb_lin)
        memcpy(batch->extra_rgb_lin + 3 * batch->count, extra_rgb_lin, 3 * sizeof *extra_rgb_lin);
    batch->count++;
    return batch->count == LP_BATCH_VOXELS ? lp_batch_flush(batch, err) : LP_OK;
}

enum lp_code lp_batch_flush(struct lp_batch *batch, struct lp_error *err)
{
    const float *extra[] = {batch->extra_rgb_lin};
    size_t count = batch->count;
    batch->count = 0;
    return count == 0 ? LP_OK : lp_build_push(batch->build, batch->voxels, extra, count, err);
}

void lp_batch_destroy(struct lp_batch **batch)
{
    if (!batch)
        return;
    free(*batch);
    *batch = NULL;
}
