/* Numbering, checking and searching of the sparse voxel octree. */
#include "engine/octree.h"

void lp_octree_number(struct lp_octree *tree)
{
    uint64_t first = 0;
    for (int level = tree->depth; level >= 0; level--) {
        tree->level_first[level] = first;
        first += tree->level_count[level];
    }
    tree->node_count = first;
}

/* One wide level against the sizes of the levels that its masks describe (invariants 2 to 4). */
static enum lp_code check_wide_level(const struct lp_octree *tree, int k, struct lp_error *err)
{
    const struct lp_wide_node *nodes = tree->wide[k];
    uint64_t children = 0, mids = 0;
    for (uint32_t i = 0; i < tree->wide_count[k]; i++) {
        uint64_t mask = nodes[i].mask;
        if (mask == 0)
            return lp_fail(err, LP_CORRUPT, "nodes", "wide node %u of wide level %d has no child",
                           i, k);
        if (nodes[i].child_first != children || nodes[i].mid_first != mids)
            return lp_fail(err, LP_CORRUPT, "nodes",
                           "wide node %u of wide level %d points to children %u and %u where %llu "
                           "and %llu are due",
                           i, k, nodes[i].child_first, nodes[i].mid_first,
                           (unsigned long long)children, (unsigned long long)mids);
        children += (uint64_t)__builtin_popcountll(mask);
        mids += (uint64_t)__builtin_popcount(lp_mask_octants(mask));
    }
    if (children != tree->level_count[2 * k])
        return lp_fail(err, LP_CORRUPT, "nodes",
                       "wide level %d describes %llu nodes of level %d, "
                       "the header counts %u",
                       k, (unsigned long long)children, 2 * k, tree->level_count[2 * k]);
    if (mids != tree->level_count[2 * k + 1])
        return lp_fail(err, LP_CORRUPT, "nodes",
                       "wide level %d describes %llu nodes of level %d, "
                       "the header counts %u",
                       k, (unsigned long long)mids, 2 * k + 1, tree->level_count[2 * k + 1]);
    return LP_OK;
}

enum lp_code lp_octree_check(const struct lp_octree *tree, struct lp_error *err)
{
    int coarsest = tree->wide_levels - 1;
    if (tree->wide_count[coarsest] != 1)
        return lp_fail(err, LP_CORRUPT, "nodes", "the coarsest wide level has %u nodes, not one",
                       tree->wide_count[coarsest]);
    for (int k = 0; k <= coarsest; k++) {
        if (k < coarsest && tree->wide_count[k] != tree->level_count[2 * k + 2])
            return lp_fail(err, LP_CORRUPT, "nodes",
                           "wide level %d has %u nodes, the header counts %u of level %d", k,
                           tree->wide_count[k], tree->level_count[2 * k + 2], 2 * k + 2);
        enum lp_code code = check_wide_level(tree, k, err);
        if (code != LP_OK)
            return code;
    }
    if ((tree->depth & 1) && (tree->wide[coarsest][0].mask >> 8) != 0)
        return lp_fail(err, LP_CORRUPT, "nodes", "the root has voxels outside of the cube");
    if (tree->level_count[tree->depth] != 1)
        return lp_fail(err, LP_CORRUPT, "nodes", "level %u has %u nodes, the root's has one",
                       tree->depth, tree->level_count[tree->depth]);
    return LP_OK;
}

bool lp_octree_find(lp_node *out, const struct lp_octree *tree, const uint32_t cell_vox[3],
                    uint8_t level)
{
    lp_node node = lp_octree_root(tree);
    while (node.level > level) {
        uint32_t shift = node.level - 1u;
        uint32_t child = ((cell_vox[0] >> shift) & 1) | ((cell_vox[1] >> shift) & 1) << 1 |
                         ((cell_vox[2] >> shift) & 1) << 2;
        if (!(lp_octree_child_mask(tree, node) >> child & 1))
            return false;
        node = lp_octree_child(tree, node, child);
    }
    *out = node;
    return true;
}

/* The extreme cell on one side of one axis: at every node only children that can beat `best`. */
static uint32_t extreme(const struct lp_octree *tree, lp_node node, int axis, bool high,
                        uint32_t base, uint32_t best)
{
    if (node.level == 0)
        return high ? base + 1 : base;
    uint32_t half = 1u << (node.level - 1);
    uint32_t mask = lp_octree_child_mask(tree, node);
    for (int pass = 0; pass < 2; pass++) {
        uint32_t side = high ? 1u - (uint32_t)pass : (uint32_t)pass; /* the promising half first */
        uint32_t from = base + side * half, beyond = from + half;
        for (uint32_t i = 0; i < 8; i++) {
            bool there = (mask >> i & 1) && (i >> axis & 1) == side;
            if (there && (high ? beyond > best : from < best))
                best = extreme(tree, lp_octree_child(tree, node, i), axis, high, from, best);
        }
    }
    return best;
}

void lp_octree_bounds(uint32_t min_vox[3], uint32_t max_vox[3], const struct lp_octree *tree)
{
    lp_node root = lp_octree_root(tree);
    for (int axis = 0; axis < 3; axis++) {
        min_vox[axis] = extreme(tree, root, axis, false, 0, 1u << tree->depth);
        max_vox[axis] = extreme(tree, root, axis, true, 0, 0);
    }
}
