/* The scalar traversal, in the order of Laine and Karras (2010): INTERSECT, PUSH, ADVANCE, POP. */
#include "engine/trace.h"

#include <math.h>

void lp_ray_init(struct lp_ray *ray, const double origin_os[3], lp_vec3 direction)
{
    const float d[3] = {direction.x, direction.y, direction.z};
    ray->parallel = ray->negative = 0;
    for (int a = 0; a < 3; a++) {
        double cell = floor(origin_os[a]);
        float fraction = (float)(origin_os[a] - cell);
        ray->cell[a] = (int32_t)cell;
        ray->fraction[a] = fraction < 1.0f ? fraction : 0x1.fffffep-1f; /* rounding reached 1 */
        ray->direction[a] = d[a];
        bool parallel = !(d[a] >= LP_RAY_PARALLEL || d[a] <= -LP_RAY_PARALLEL);
        ray->inverse[a] = parallel ? 0.0f : 1.0f / d[a];
        ray->parallel |= (uint8_t)(parallel << a);
        ray->negative |= (uint8_t)((!parallel && d[a] < 0.0f) << a);
    }
}

/* One node on the way down. */
struct frame {
    lp_node node;
    uint32_t cell[3]; /* lowest voxel */
    float t_out;
    float t_mid[3];  /* crossings of the planes through the middle, INFINITY where parallel */
    uint32_t octant; /* the child that the ray is in, as x + 2y + 4z */
};

/* Near and far planes of the root (rules 3 and 4). */
static bool intersect_root(float *t_in, float *t_out, const struct lp_octree *tree,
                           const struct lp_ray *ray)
{
    int32_t side = (int32_t)1 << tree->depth;
    *t_in = 0.0f;
    *t_out = INFINITY;
    for (int a = 0; a < 3; a++) {
        if (ray->parallel >> a & 1) {
            if (ray->cell[a] < 0 || ray->cell[a] >= side)
                return false;
            continue;
        }
        bool negative = ray->negative >> a & 1;
        float near = lp_ray_plane(ray, a, negative ? side : 0);
        float far = lp_ray_plane(ray, a, negative ? 0 : side);
        *t_in = near > *t_in ? near : *t_in;
        *t_out = far < *t_out ? far : *t_out;
    }
    return *t_in < *t_out;
}

/* PUSH: the middle planes of a node and the child that holds the ray at t_in. */
static void enter(struct frame *frame, const struct lp_ray *ray, float t_in)
{
    int32_t half = (int32_t)1 << (frame->node.level - 1);
    frame->octant = 0;
    for (int a = 0; a < 3; a++) {
        int32_t middle = (int32_t)frame->cell[a] + half;
        bool upper;
        if (ray->parallel >> a & 1) {
            frame->t_mid[a] = INFINITY;
            upper = ray->cell[a] >= middle;
        } else {
            frame->t_mid[a] = lp_ray_plane(ray, a, middle);
            bool beyond = frame->t_mid[a] <= t_in; /* the middle is behind the ray */
            upper = beyond != (ray->negative >> a & 1);
            if (beyond)
                frame->t_mid[a] = INFINITY; /* never to be crossed in this node again */
        }
        frame->octant |= (uint32_t)upper << a;
    }
}

/* Where the ray leaves the child it is in. */
static float child_exit(const struct frame *frame)
{
    float t = frame->t_out;
    for (int a = 0; a < 3; a++)
        t = frame->t_mid[a] < t ? frame->t_mid[a] : t;
    return t;
}

/* ADVANCE: into the next child at t, over every middle plane that is crossed there, so that cells
 * with an empty interval are never entered. False: the ray leaves the node (POP). */
static bool advance(struct frame *frame, float t)
{
    if (!(t < frame->t_out))
        return false;
    for (int a = 0; a < 3; a++)
        if (frame->t_mid[a] <= t) {
            frame->octant ^= 1u << a;
            frame->t_mid[a] = INFINITY;
        }
    return true;
}

/* Rule 5: the lowest axis whose near plane was crossed at t_in. */
static enum lp_face entry_face(const struct lp_ray *ray, const uint32_t cell[3], uint8_t level,
                               float t_in)
{
    for (int a = 0; a < 3; a++) {
        if (ray->parallel >> a & 1)
            continue;
        bool negative = ray->negative >> a & 1;
        int32_t plane = (int32_t)cell[a] + (negative ? (int32_t)1 << level : 0);
        if (lp_ray_plane(ray, a, plane) == t_in)
            return (enum lp_face)(2 * a + (negative ? 0 : 1));
    }
    return LP_FACE_NONE;
}

static bool accepted(const struct lp_level_cut *cut, uint8_t level, float t_in)
{
    return level == 0 || level <= cut->level || (float)(1u << level) <= t_in * cut->cone;
}

static void fill_hit(struct lp_hit *hit, const struct lp_ray *ray, lp_node node,
                     const uint32_t cell[3], float t_in)
{
    *hit = (struct lp_hit){.node = node,
                           .face = entry_face(ray, cell, node.level, t_in),
                           .t_in = t_in,
                           .cell = {cell[0], cell[1], cell[2]}};
}

bool lp_trace_closest(struct lp_hit *hit, uint64_t *steps, const struct lp_octree *tree,
                      const struct lp_ray *ray, const struct lp_level_cut *cut)
{
    struct frame stack[LP_DEPTH_MAX];
    float t_in, t_out;
    uint64_t entered = 1;
    bool found = false;
    /* INTERSECT */
    if (!intersect_root(&t_in, &t_out, tree, ray)) {
        *steps += entered;
        return false;
    }
    struct frame *frame = stack;
    *frame = (struct frame){.node = lp_octree_root(tree), .t_out = t_out};
    if (accepted(cut, frame->node.level, t_in)) {
        fill_hit(hit, ray, frame->node, frame->cell, t_in);
        *steps += entered;
        return true;
    }
    enter(frame, ray, t_in);
    for (;;) {
        float t_child = child_exit(frame);
        if (lp_octree_child_mask(tree, frame->node) >> frame->octant & 1) {
            entered++;
            lp_node child = lp_octree_child(tree, frame->node, frame->octant);
            uint32_t cell[3];
            for (int a = 0; a < 3; a++)
                cell[a] = frame->cell[a] + ((frame->octant >> a & 1) << child.level);
            if (accepted(cut, child.level, t_in)) {
                fill_hit(hit, ray, child, cell, t_in);
                found = true;
                break;
            }
            /* PUSH */
            frame++;
            *frame = (struct frame){
                .node = child, .cell = {cell[0], cell[1], cell[2]}, .t_out = t_child};
            enter(frame, ray, t_in);
            continue;
        }
        /* ADVANCE, and POP as long as the ray leaves the node as well */
        while (!advance(frame, t_child)) {
            if (frame == stack)
                goto out;
            frame--;
        }
        t_in = t_child;
    }
out:
    *steps += entered;
    return found;
}
