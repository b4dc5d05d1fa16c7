/* Rays through the octree: the scalar reference, judge of every faster kernel.
 *
 * Exactness. All of it is float32, so that 16 lanes can do the same later, in an order that is part
 * of the specification; no reciprocal approximations, no fused multiply-add.
 *  1. A ray starts in an integer cell plus a fraction in [0, 1); along each axis it crosses the
 *     integer plane k at t = fl(fl((k - cell) - fraction) * inverse), at every level alike.
 *  2. t is measured in voxels (the direction has unit length; t * voxel_size_m is metres).
 *  3. Cells are half-open: a ray that runs parallel to an axis is inside of [k, k + n) or it is
 * not. Direction components below LP_RAY_PARALLEL in size count as zero.
 *  4. A node covers t_in = max(0, its three near planes) to t_out = min(its three far planes);
 *     it is hit where t_in < t_out. Distinct cells have disjoint intervals, so there are no ties.
 *  5. The face that is hit belongs to the lowest axis whose near plane is crossed at t_in, also at
 *     t_in = 0 by a ray that starts on that plane; where no near plane is (the ray starts further
 *     inside), there is none.
 *  6. Steps: the root's test is one, hit or miss; then every node that is there and is entered
 *     (4) before or at the hit, by the plain top-down walk.
 *
 * A hit is the first node in order that is a voxel or that the level cut accepts. */
#ifndef LP_TRACE_H
#define LP_TRACE_H

#include "engine/octree.h"

#define LP_RAY_PARALLEL   0x1p-60f
#define LP_RAY_ORIGIN_MAX (1 << 21) /* |cell| of a ray's start, in voxels */

enum lp_face { /* cubemap order; also the face of a node that a ray enters through */
               LP_FACE_POS_X,
               LP_FACE_NEG_X,
               LP_FACE_POS_Y,
               LP_FACE_NEG_Y,
               LP_FACE_POS_Z,
               LP_FACE_NEG_Z,
               LP_FACE_NONE /* rule 5: no near plane is crossed at t_in */
};

struct lp_ray {
    int32_t cell[3];    /* voxel that holds the start; may lie outside of the cube */
    float fraction[3];  /* place in that voxel, [0, 1) */
    float direction[3]; /* unit length, octree space = world axes */
    float inverse[3];   /* 1 / direction; unused where parallel */
    uint8_t parallel;   /* bit a: axis a counts as zero */
    uint8_t negative;   /* bit a: runs down axis a */
};

/* Where a ray may stop above the voxels: a node of level l is accepted if l <= level, or if its
 * edge 2^l <= fl(t_in * cone). All zero: voxels only. */
struct lp_level_cut {
    uint8_t level; /* `levels: fixed` */
    float cone;    /* voxels of footprint per voxel of distance: 2 / face_px for one texel */
};

struct lp_hit {
    lp_node node;      /* the node that was hit; its level is node.level */
    enum lp_face face; /* its face, so also the normal */
    float t_in;        /* entry distance in voxels, 0 when the ray starts inside */
    uint32_t cell[3];  /* lowest voxel of the node */
};

/* Sets up a ray. `origin_os` in voxels, |origin| < LP_RAY_ORIGIN_MAX, finite (the caller checked);
 * `direction` of unit length. Thread: any. */
void lp_ray_init(struct lp_ray *ray, const double origin_os[3], lp_vec3 direction);

/* The plane crossing of rule 1. */
static inline float lp_ray_plane(const struct lp_ray *ray, int axis, int32_t k)
{
    return ((float)(k - ray->cell[axis]) - ray->fraction[axis]) * ray->inverse[axis];
}

/* Closest hit. Returns whether there is one and fills `*hit` then (untouched otherwise); adds the
 * steps of rule 6 to `*steps` in both cases. Allocates nothing. Thread: any. */
bool lp_trace_closest(struct lp_hit *hit, uint64_t *steps, const struct lp_octree *tree,
                      const struct lp_ray *ray, const struct lp_level_cut *cut);

#endif
