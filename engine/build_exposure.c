/* Which faces of the voxels in a 4^3 brick look into empty space, by shifts of its Morton mask.
 *
 * Along one axis the bits of a cell's Morton code that belong to it are b (low) and b + 3 (high);
 * a step from coordinate 0 to 1 and from 2 to 3 adds 2^b to the code, a step from 1 to 2 adds
 * 2^(b+3) - 2^b, and from 3 the step leads to coordinate 0 of the next brick: minus 9 * 2^b. */
#include "engine/build_task.h"

/* Cells whose coordinate along axis a is 0, 1, 2, 3. */
static uint64_t cells_at(int axis, uint32_t coordinate)
{
    uint64_t low[3] = {0xaaaaaaaaaaaaaaaau, 0xccccccccccccccccu, 0xf0f0f0f0f0f0f0f0u};
    uint64_t high[3] = {0xff00ff00ff00ff00u, 0xffff0000ffff0000u, 0xffffffff00000000u};
    return (coordinate & 1 ? low[axis] : ~low[axis]) & (coordinate & 2 ? high[axis] : ~high[axis]);
}

/* For every cell whether the cell at +1 along the axis is solid: `mask` of the brick itself, `next`
 * of the brick beyond its upper side. */
static uint64_t solid_above(uint64_t mask, uint64_t next, int axis)
{
    uint32_t one = 1u << axis, inner = 7u << axis, wrap = 9u << axis;
    uint64_t even = cells_at(axis, 0) | cells_at(axis, 2);
    return ((mask >> one) & even) | ((mask >> inner) & cells_at(axis, 1)) |
           ((next << wrap) & cells_at(axis, 3));
}

static uint64_t solid_below(uint64_t mask, uint64_t previous, int axis)
{
    uint32_t one = 1u << axis, inner = 7u << axis, wrap = 9u << axis;
    uint64_t odd = cells_at(axis, 1) | cells_at(axis, 3);
    return ((mask << one) & odd) | ((mask << inner) & cells_at(axis, 2)) |
           ((previous >> wrap) & cells_at(axis, 0));
}

/* The mask of the brick that holds `cell_vox`, 0 outside of the cube and where nothing is. */
static uint64_t brick_mask(const struct lp_octree *tree, const uint32_t cell_vox[3])
{
    uint32_t side = 1u << tree->depth;
    lp_node node;
    if (cell_vox[0] >= side || cell_vox[1] >= side || cell_vox[2] >= side || tree->depth < 2 ||
        !lp_octree_find(&node, tree, cell_vox, 2))
        return 0;
    return tree->wide[0][node.index].mask;
}

void lp_build_exposed(uint64_t exposed[6], const struct lp_octree *tree, uint64_t mask,
                      const uint32_t cell_vox[3])
{
    for (int axis = 0; axis < 3; axis++) {
        uint32_t above[3] = {cell_vox[0], cell_vox[1], cell_vox[2]};
        uint32_t below[3] = {cell_vox[0], cell_vox[1], cell_vox[2]};
        above[axis] += 4;
        below[axis] -= 4; /* wraps to a huge number at the cube's border: empty */
        exposed[2 * axis] = mask & ~solid_above(mask, brick_mask(tree, above), axis);
        exposed[2 * axis + 1] = mask & ~solid_below(mask, brick_mask(tree, below), axis);
    }
}
