/* The sparse voxel octree in memory: layout, and the only way to its nodes.
 *
 * Levels are named as in the thesis: level 0 holds the voxels, level `depth` the root; a node of
 * level l is a cube of 2^l voxels a side. Child i of a node sits at (x, y, z) with
 * i = x + 2y + 4z, and bit i of a child mask says that it is there.
 *
 * Two octree levels share one wide node: 4^3 grandchildren in Morton order as one 64-bit mask, so
 * that byte o of the mask is the child mask of octant o, the node between.
 *
 *     level 2k+2   wide node w          mask: 64 bits          one per node of level 2k+2
 *     level 2k+1   octant o of w        byte o of mask         there where the byte is not 0
 *     level 2k     child (o, i) of w    bit 8o + i of mask     index child_first + bits below it
 *
 *     wide[k] holds the wide nodes whose bits are nodes of level 2k; wide[0] the finest.
 *     With an odd depth the root is octant 0 of the single node of the coarsest wide level.
 *
 * Invariants (lp_octree_check proves them; a tree that passes cannot lead outside its arrays)
 *  1. Nodes of a level are stored in Morton order, so a node's rank is its place in that order.
 *  2. child_first of node n = number of set bits in the masks before n; the bits of wide[k] are the
 *     nodes of wide[k-1] one to one (k > 0), or the voxels (k = 0).
 *  3. mid_first of node n = number of non-zero bytes in the masks before n.
 *  4. No mask is 0. The coarsest wide level has one node; with odd depth only byte 0 of it is used.
 *
 * A node's attributes (colours and the like) stand at lp_octree_attribute: the coarsest level
 * first, within a level by rank. The tree is a view: it owns nothing and is valid while the
 * memory that it was made over is. Everything here is read-only. Thread: any.
 *
 * Sources: Laine and Karras, "Efficient Sparse Voxel Octrees", 2010 (child masks, popcount);
 * 64-way masks as in many current voxel engines. */
#ifndef LP_OCTREE_H
#define LP_OCTREE_H

#include "engine/base.h"

#define LP_DEPTH_MAX       18
#define LP_LEVEL_COUNT_MAX (LP_DEPTH_MAX + 1)
#define LP_WIDE_LEVELS_MAX ((LP_DEPTH_MAX + 1) / 2)
#define LP_NODES_MAX       UINT32_MAX /* of one level */

/* 16 bytes, as in the file (little-endian). */
struct lp_wide_node {
    uint64_t mask;        /* bit 8o + i: grandchild i of octant o is there */
    uint32_t child_first; /* rank of the first grandchild */
    uint32_t mid_first;   /* rank of the first octant */
};

struct lp_octree {
    uint8_t depth;                                       /* 1..LP_DEPTH_MAX */
    uint8_t wide_levels;                                 /* (depth + 1) / 2 */
    const struct lp_wide_node *wide[LP_WIDE_LEVELS_MAX]; /* [0] finest */
    uint32_t wide_count[LP_WIDE_LEVELS_MAX];
    uint32_t level_count[LP_LEVEL_COUNT_MAX]; /* nodes of each level */
    uint64_t level_first[LP_LEVEL_COUNT_MAX]; /* attribute of a level's first node */
    uint64_t node_count;                      /* all levels together */
};

/* Names one node. Odd level: `index` is its wide node and `octant` its place there; even level:
 * `index` is its rank and `octant` 0. */
typedef struct lp_node {
    uint32_t index;
    uint8_t level;
    uint8_t octant;
} lp_node;

/* Bit o of the result says that byte o of the mask is not 0: the octants that are there. */
static inline uint32_t lp_mask_octants(uint64_t mask)
{
    uint64_t low = mask & 0x7f7f7f7f7f7f7f7fu;
    uint64_t top = ((low + 0x7f7f7f7f7f7f7f7fu) | mask) & 0x8080808080808080u;
    return (uint32_t)(((top >> 7) * 0x0102040810204080u) >> 56);
}

static inline lp_node lp_octree_root(const struct lp_octree *tree)
{
    return (lp_node){.index = 0, .level = tree->depth, .octant = 0};
}

/* The eight bits of a node's children; `node.level` must be above 0. */
static inline uint32_t lp_octree_child_mask(const struct lp_octree *tree, lp_node node)
{
    const struct lp_wide_node *wide = &tree->wide[(node.level - 1) / 2][node.index];
    if (node.level & 1)
        return (uint32_t)(wide->mask >> (8 * node.octant)) & 0xffu;
    return lp_mask_octants(wide->mask);
}

/* Child `i` of a node; it must be there (its bit in lp_octree_child_mask set). */
static inline lp_node lp_octree_child(const struct lp_octree *tree, lp_node node, uint32_t i)
{
    if (!(node.level & 1))
        return (lp_node){
            .index = node.index, .level = (uint8_t)(node.level - 1), .octant = (uint8_t)i};
    const struct lp_wide_node *wide = &tree->wide[(node.level - 1) / 2][node.index];
    uint64_t below = wide->mask & ((UINT64_C(1) << (8 * node.octant + i)) - 1);
    return (lp_node){.index = wide->child_first + (uint32_t)__builtin_popcountll(below),
                     .level = (uint8_t)(node.level - 1)};
}

/* The node's place among the nodes of its level, in Morton order. */
static inline uint32_t lp_octree_rank(const struct lp_octree *tree, lp_node node)
{
    if (!(node.level & 1))
        return node.index;
    if (node.level == tree->depth)
        return 0;
    const struct lp_wide_node *wide = &tree->wide[(node.level - 1) / 2][node.index];
    uint32_t below = lp_mask_octants(wide->mask) & ((1u << node.octant) - 1);
    return wide->mid_first + (uint32_t)__builtin_popcount(below);
}

/* Where the node's values stand in every channel. */
static inline uint64_t lp_octree_attribute(const struct lp_octree *tree, lp_node node)
{
    return tree->level_first[node.level] + lp_octree_rank(tree, node);
}

/* Fills node_count and level_first from depth and level_count. */
void lp_octree_number(struct lp_octree *tree);

/* Proves the invariants above over all nodes, in one pass. Until it passed, a tree from outside
 * must not be walked. LP_CORRUPT names the first wide node that breaks one. */
LP_MUST_CHECK enum lp_code lp_octree_check(const struct lp_octree *tree, struct lp_error *err);

/* Finds the node of `level` that holds voxel (x, y, z), each in 0..2^depth - 1.
 * False where there is none; `*out` is untouched then. */
bool lp_octree_find(lp_node *out, const struct lp_octree *tree, const uint32_t cell_vox[3],
                    uint8_t level);

/* The smallest box around all voxels: first cell and first one beyond, per axis. Walks the tree
 * down to its wide leaves; the tree has at least one voxel. */
void lp_octree_bounds(uint32_t min_vox[3], uint32_t max_vox[3], const struct lp_octree *tree);

/* Morton key of a cell: bit 3b+a of the key is bit b of coordinate a. 18 bits a coordinate. */
static inline uint64_t lp_morton_spread(uint64_t v)
{
    v &= 0x1fffffu;
    v = (v | v << 32) & 0x001f00000000ffffu;
    v = (v | v << 16) & 0x001f0000ff0000ffu;
    v = (v | v << 8) & 0x100f00f00f00f00fu;
    v = (v | v << 4) & 0x10c30c30c30c30c3u;
    v = (v | v << 2) & 0x1249249249249249u;
    return v;
}

static inline uint64_t lp_morton_key(uint32_t x, uint32_t y, uint32_t z)
{
    return lp_morton_spread(x) | lp_morton_spread(y) << 1 | lp_morton_spread(z) << 2;
}

static inline uint32_t lp_morton_gather(uint64_t v)
{
    v &= 0x1249249249249249u;
    v = (v | v >> 2) & 0x10c30c30c30c30c3u;
    v = (v | v >> 4) & 0x100f00f00f00f00fu;
    v = (v | v >> 8) & 0x001f0000ff0000ffu;
    v = (v | v >> 16) & 0x001f00000000ffffu;
    v = (v | v >> 32) & 0x00000000001fffffu;
    return (uint32_t)v;
}

#endif
