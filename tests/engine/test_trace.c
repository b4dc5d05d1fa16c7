/* The scalar traversal against a walk over every node of small scenes, bit for bit. */
#include "engine/scene_file.h"
#include "engine/trace.h"
#include "tests/engine/small_scene.h"
#include "tests/harness/test.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#define NODES_MAX 4096

/* Every node of a scene with its lowest voxel, parents before children. */
struct node_list {
    uint32_t count;
    struct listed {
        lp_node node;
        uint32_t cell[3];
        int32_t parent;
    } nodes[NODES_MAX];
};

static void list_nodes(struct node_list *list, const struct lp_octree *tree)
{
    list->count = 1;
    list->nodes[0] = (struct listed){.node = lp_octree_root(tree), .parent = -1};
    for (uint32_t at = 0; at < list->count; at++) {
        struct listed from = list->nodes[at];
        uint32_t mask = from.node.level ? lp_octree_child_mask(tree, from.node) : 0;
        for (uint32_t i = 0; i < 8; i++) {
            if (!(mask >> i & 1))
                continue;
            REQUIRE(list->count < NODES_MAX);
            struct listed *to = &list->nodes[list->count++];
            *to =
                (struct listed){.node = lp_octree_child(tree, from.node, i), .parent = (int32_t)at};
            for (int a = 0; a < 3; a++)
                to->cell[a] = from.cell[a] + ((i >> a & 1) << to->node.level);
        }
    }
}

/* Rules 1, 3 and 4 of trace.h for one cube, written down a second time. */
static bool interval(float *t_in, float *t_out, const struct lp_ray *ray, const struct listed *cube)
{
    *t_in = 0.0f;
    *t_out = INFINITY;
    for (int a = 0; a < 3; a++) {
        int32_t low = (int32_t)cube->cell[a], high = low + (1 << cube->node.level);
        if (ray->parallel >> a & 1) {
            if (ray->cell[a] < low || ray->cell[a] >= high)
                return false;
            continue;
        }
        float to_low = ((float)(low - ray->cell[a]) - ray->fraction[a]) * ray->inverse[a];
        float to_high = ((float)(high - ray->cell[a]) - ray->fraction[a]) * ray->inverse[a];
        bool down = ray->direction[a] < 0;
        *t_in = fmaxf(*t_in, down ? to_high : to_low);
        *t_out = fminf(*t_out, down ? to_low : to_high);
    }
    return *t_in < *t_out;
}

struct expected {
    bool hit;
    float t_in;
    const struct listed *node;
    uint64_t steps;
};

/* Looks at every node: which are accepted below no accepted one, which of these is the nearest,
 * and how many nodes a walk would have entered up to there. */
static struct expected walk(const struct node_list *list, const struct lp_ray *ray,
                            const struct lp_level_cut *cut)
{
    static bool open[NODES_MAX]; /* the ray is in it, and neither it nor one above was accepted */
    static bool entered[NODES_MAX];
    static float t_in[NODES_MAX];
    struct expected e = {.t_in = INFINITY};
    for (uint32_t i = 0; i < list->count; i++) {
        const struct listed *n = &list->nodes[i];
        float t_out;
        bool reached = n->parent < 0 || open[n->parent];
        entered[i] = reached && interval(&t_in[i], &t_out, ray, n);
        bool accepted = n->node.level == 0 || n->node.level <= cut->level ||
                        (float)(1u << n->node.level) <= t_in[i] * cut->cone;
        open[i] = entered[i] && !accepted;
        if (entered[i] && accepted && t_in[i] < e.t_in) {
            e.hit = true;
            e.t_in = t_in[i];
            e.node = n;
        }
    }
    e.steps = !entered[0];
    for (uint32_t i = 0; i < list->count; i++)
        e.steps += entered[i] && t_in[i] <= e.t_in;
    return e;
}

static void check_face(const struct lp_ray *ray, const struct lp_hit *hit,
                       const struct listed *node)
{
    enum lp_face face = LP_FACE_NONE;
    for (int a = 2; a >= 0; a--) { /* the lowest axis wins */
        if (ray->parallel >> a & 1)
            continue;
        bool down = ray->direction[a] < 0;
        int32_t plane = (int32_t)node->cell[a] + (down ? 1 << node->node.level : 0);
        if (((float)(plane - ray->cell[a]) - ray->fraction[a]) * ray->inverse[a] == hit->t_in)
            face = (enum lp_face)(2 * a + !down);
    }
    CHECK_EQ(hit->face, face);
}

static void check_ray(const struct lp_scene *scene, const struct node_list *list,
                      const double origin[3], lp_vec3 direction, const struct lp_level_cut *cut)
{
    struct lp_ray ray;
    struct lp_hit hit;
    uint64_t steps = 0;
    lp_ray_init(&ray, origin, direction);
    bool found = lp_trace_closest(&hit, &steps, &scene->tree, &ray, cut);
    struct expected e = walk(list, &ray, cut);
    bool same = found == e.hit && steps == e.steps;
    if (same && found)
        same = hit.t_in == e.t_in && hit.node.level == e.node->node.level &&
               memcmp(hit.cell, e.node->cell, sizeof hit.cell) == 0 &&
               hit.node.index == e.node->node.index && hit.node.octant == e.node->node.octant;
    if (!same) {
        test_fail(__FILE__, __LINE__,
                  "from (%.17g, %.17g, %.17g) along (%.9g, %.9g, %.9g), cut %u/%g: %s t %.9g steps "
                  "%llu, the walk says %s t %.9g steps %llu",
                  origin[0], origin[1], origin[2], (double)direction.x, (double)direction.y,
                  (double)direction.z, cut->level, (double)cut->cone, found ? "hit" : "miss",
                  found ? (double)hit.t_in : 0.0, (unsigned long long)steps, e.hit ? "hit" : "miss",
                  (double)e.t_in, (unsigned long long)e.steps);
    } else if (found) {
        check_face(&ray, &hit, e.node);
    }
}

/* ---- shaped rays -------------------------------------------------------------------------------
 */

static lp_vec3 unit(double x, double y, double z)
{
    double length = sqrt(x * x + y * y + z * z);
    return (lp_vec3){(float)(x / length), (float)(y / length), (float)(z / length)};
}

static double around(test_random *r, double low, double span)
{
    return low + test_random_unit(r) * span;
}

/* A start in or around the block of `span` voxels at `low`: anywhere, on planes, in cell centres.
 */
static void make_origin(double origin[3], test_random *r, double low, double span)
{
    uint32_t shape = test_random_below(r, 5);
    for (int a = 0; a < 3; a++) {
        double v = around(r, low - span, 3 * span);
        if (shape == 1)
            v = floor(v);
        else if (shape == 2)
            v = floor(v) + 0.5;
        else if (shape == 3)
            v = floor(around(r, low, span)) + test_random_unit(r); /* inside */
        else if (shape == 4)
            v = floor(v) + (test_random_below(r, 2) ? 0x1p-30 : 1 - 0x1p-30);
        origin[a] = v;
    }
}

static lp_vec3 make_direction(test_random *r, const double origin[3], double low, double span)
{
    static const double steps[] = {-2, -1, -0.5, 0, 0, 0.5, 1, 2};
    double d[3];
    switch (test_random_below(r, 6)) {
    case 0: /* any */
        for (int a = 0; a < 3; a++)
            d[a] = around(r, -1, 2);
        break;
    case 1: /* along an axis */
        d[0] = d[1] = d[2] = 0;
        d[test_random_below(r, 3)] = test_random_below(r, 2) ? 1 : -1;
        break;
    case 2: /* diagonals: through edges and corners from grid points and centres */
        for (int a = 0; a < 3; a++)
            d[a] = steps[test_random_below(r, 8)];
        break;
    case 3: /* at a corner of some cell */
        for (int a = 0; a < 3; a++)
            d[a] = floor(around(r, low, span)) - origin[a];
        break;
    case 4: /* at the middle of an edge */
        for (int a = 0; a < 3; a++)
            d[a] = floor(around(r, low, span)) - origin[a];
        d[test_random_below(r, 3)] += 0.5;
        break;
    default: /* grazing: nearly along a plane, some components next to nothing */
        for (int a = 0; a < 3; a++)
            d[a] = around(r, -1, 2);
        d[test_random_below(r, 3)] = ldexp(1, -(int)test_random_below(r, 80));
        d[test_random_below(r, 3)] *= ldexp(1, -(int)test_random_below(r, 30));
        break;
    }
    if (d[0] == 0 && d[1] == 0 && d[2] == 0)
        d[1] = -1;
    return unit(d[0], d[1], d[2]);
}

/* Random voxels in a block of 2^`block` cells at `low` of a tree of `depth`. */
static void check_scene(uint8_t depth, uint32_t block, uint32_t low, uint32_t voxels, uint32_t rays,
                        test_random *r)
{
    static struct node_list list;
    struct small_scene small;
    small_scene_random(&small, depth, low, 1u << block, voxels, r);
    list_nodes(&list, &small.scene.tree);
    for (uint32_t i = 0; i < rays; i++) {
        static const struct lp_level_cut cuts[] = {{0, 0}, {0, 0}, {0, 0.02f}, {0, 0.25f},
                                                   {1, 0}, {2, 0}, {0, 2.0f}};
        double origin[3];
        make_origin(origin, r, low, 1u << block);
        lp_vec3 d = make_direction(r, origin, low, 1u << block);
        check_ray(&small.scene, &list, origin, d, &cuts[test_random_below(r, 7)]);
    }
    small_scene_finish(&small);
}

TEST(trace_equals_a_walk_over_all_nodes_of_small_cubes)
{
    test_random r = test_random_begin();
    for (uint8_t depth = 1; depth <= 4; depth++)
        for (uint32_t voxels = 1; voxels <= 81; voxels *= 3)
            check_scene(depth, depth, 0, voxels, 25000, &r);
}

TEST(trace_equals_a_walk_at_both_ends_of_a_deep_cube)
{
    test_random r = test_random_begin();
    for (uint32_t round = 0; round < 10; round++) {
        check_scene(18, 4, 0, 40, 20000, &r);
        check_scene(18, 4, (1u << 18) - 16, 40, 20000, &r);
        check_scene(17, 3, (1u << 17) - 8, 20, 10000, &r);
        check_scene(11, 4, 1000, 40, 10000, &r);
    }
}

TEST(trace_equals_a_walk_from_far_outside)
{
    test_random r = test_random_begin();
    static struct node_list list;
    struct small_scene small;
    small_scene_random(&small, 5, 0, 32, 200, &r);
    list_nodes(&list, &small.scene.tree);
    for (uint32_t i = 0; i < 100000; i++) {
        double origin[3], target[3];
        for (int a = 0; a < 3; a++) {
            origin[a] = around(&r, -LP_RAY_ORIGIN_MAX + 1, 2.0 * LP_RAY_ORIGIN_MAX - 2);
            target[a] = around(&r, 0, 32);
        }
        lp_vec3 d = unit(target[0] - origin[0], target[1] - origin[1], target[2] - origin[2]);
        struct lp_level_cut cut = {.cone = i & 1 ? 0x1p-18f : 0};
        check_ray(&small.scene, &list, origin, d, &cut);
    }
    small_scene_finish(&small);
}

/* ---- cases with answers known beforehand -------------------------------------------------------
 */

static struct lp_hit must_hit(const struct lp_scene *scene, double x, double y, double z, lp_vec3 d)
{
    struct lp_ray ray;
    struct lp_hit hit = {0};
    struct lp_level_cut cut = {0};
    uint64_t steps = 0;
    lp_ray_init(&ray, (double[]){x, y, z}, d);
    REQUIRE(lp_trace_closest(&hit, &steps, &scene->tree, &ray, &cut));
    return hit;
}

TEST(trace_gives_distance_and_face_of_one_voxel)
{
    struct small_scene small;
    struct lp_voxel voxel = {5, 6, 7, {1, 2, 3}};
    small_scene_make(&small, 4, &voxel, 1);
    static const lp_vec3 down[] = {{-1, 0, 0}, {1, 0, 0},  {0, -1, 0},
                                   {0, 1, 0},  {0, 0, -1}, {0, 0, 1}};
    for (int face = 0; face < 6; face++) {
        double at[3] = {5.25, 6.5, 7.75}; /* on the voxel's axis, 2.25 before its face */
        int axis = face / 2;
        at[axis] = face & 1 ? voxel.x + (uint32_t)axis - 2.25 : voxel.x + (uint32_t)axis + 3.25;
        struct lp_hit hit = must_hit(&small.scene, at[0], at[1], at[2], down[face]);
        CHECK_EQ(hit.face, face);
        CHECK(hit.t_in == 2.25f);
    }
    struct lp_hit inside = must_hit(&small.scene, 5.5, 6.5, 7.5, down[0]);
    CHECK_EQ(inside.face, LP_FACE_NONE);
    CHECK(inside.t_in == 0.0f);
    /* On a near plane the ray enters through it; on a far one it has left already. */
    struct lp_hit on_plane = must_hit(&small.scene, 5.0, 6.5, 7.5, down[1]);
    CHECK_EQ(on_plane.face, LP_FACE_NEG_X);
    CHECK(on_plane.t_in == 0.0f);
    struct lp_hit on_two = must_hit(&small.scene, 6.0, 7.0, 7.5, (lp_vec3){-0.6f, -0.8f, 0});
    CHECK_EQ(on_two.face, LP_FACE_POS_X); /* the lowest axis */
    small_scene_finish(&small);
}

TEST(trace_counts_the_root_even_when_it_is_missed)
{
    struct small_scene small;
    struct lp_voxel voxel = {0, 0, 0, {1, 2, 3}};
    small_scene_make(&small, 3, &voxel, 1);
    struct lp_ray ray;
    struct lp_hit hit;
    struct lp_level_cut cut = {0};
    uint64_t steps = 0;
    lp_ray_init(&ray, (double[]){20, 20, 20}, (lp_vec3){1, 0, 0});
    CHECK(!lp_trace_closest(&hit, &steps, &small.scene.tree, &ray, &cut));
    CHECK_EQ(steps, 1);
    lp_ray_init(&ray, (double[]){0.5, 0.5, 20}, (lp_vec3){0, 0, -1});
    CHECK(lp_trace_closest(&hit, &steps, &small.scene.tree, &ray, &cut));
    CHECK_EQ(steps, 1 + 4); /* levels 3, 2, 1, 0 */
    small_scene_finish(&small);
}

TEST(trace_survives_a_direction_of_zeros)
{
    struct small_scene small;
    struct lp_voxel voxel = {1, 1, 1, {1, 2, 3}};
    small_scene_make(&small, 3, &voxel, 1);
    struct lp_ray ray;
    struct lp_hit hit;
    struct lp_level_cut cut = {0};
    uint64_t steps = 0;
    lp_ray_init(&ray, (double[]){4.5, 4.5, 4.5}, (lp_vec3){0, 0, 0});
    CHECK(!lp_trace_closest(&hit, &steps, &small.scene.tree, &ray, &cut));
    lp_ray_init(&ray, (double[]){1.5, 1.5, 1.5}, (lp_vec3){0, 0, 0});
    CHECK(lp_trace_closest(&hit, &steps, &small.scene.tree, &ray, &cut));
    small_scene_finish(&small);
}
