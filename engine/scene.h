/* A scene that can be rendered: tree, channels and where they stand in the world. */
#ifndef LP_SCENE_H
#define LP_SCENE_H

#include "engine/channel.h"
#include "engine/octree.h"

/* How coarse colours were made. Values are file format: never renumbered. */
enum lp_filter {
    LP_FILTER_VISIBLE = 1, /* children weighted by their exposed faces: what can be seen */
    LP_FILTER_MEAN = 2,    /* plain average of the children that are there (the thesis) */
};

/* "visible", "mean"; "unknown" otherwise. */
const char *lp_filter_text(enum lp_filter filter);

/* Views into one block of memory that somebody else owns (a mapped file, usually). The world is
 * right-handed, Y up, metres; voxel (x, y, z) covers origin_m + voxel_size_m * [x, x + 1) and so
 * on. */
struct lp_scene {
    struct lp_octree tree;
    enum lp_filter filter;
    double voxel_size_m;
    double origin_m[3];
    uint32_t bounds_min_vox[3];  /* the smallest box around all voxels: first cell ... */
    uint32_t bounds_max_vox[3];  /* ... and the first one beyond */
    double suggested_probe_m[3]; /* a place from which a newcomer sees something */
    uint32_t channel_count;      /* >= 1: albedo comes first */
    struct lp_channel channels[LP_CHANNELS_MAX];
};

/* The channel that shades lighting `name` (albedo or radiance); NULL when there is none. */
const struct lp_channel *lp_scene_lighting(const struct lp_scene *scene, const char *name);

/* World metres to octree space (voxels) and back, in double. */
void lp_scene_to_octree(double out_os[3], const struct lp_scene *scene, const double point_ws[3]);
void lp_scene_to_world(double out_ws[3], const struct lp_scene *scene, const double point_os[3]);

#endif
