/* Levels bottom-up: sorted keys of one even level become wide nodes and the keys two levels up. */
#include "engine/build_task.h"

/* Moves a part's borders to where a new wide node begins. */
static void node_range(uint64_t *begin, uint64_t *end, const struct lp_build_task *task,
                       uint32_t part)
{
    const uint64_t *keys = task->from.keys;
    lp_build_range(begin, end, task, part);
    while (*begin > 0 && *begin < task->count && keys[*begin] >> 6 == keys[*begin - 1] >> 6)
        (*begin)++;
    while (*end > 0 && *end < task->count && keys[*end] >> 6 == keys[*end - 1] >> 6)
        (*end)++;
}

/* part_children: wide nodes that begin in the part; part_mids: its octants. */
void lp_build_count_wide(struct lp_build_task *task, uint32_t part)
{
    uint64_t begin, end, nodes = 0, mids = 0;
    node_range(&begin, &end, task, part);
    const uint64_t *keys = task->from.keys;
    for (uint64_t i = begin; i < end; i++) {
        nodes += i == begin || keys[i] >> 6 != keys[i - 1] >> 6;
        mids += i == begin || keys[i] >> 3 != keys[i - 1] >> 3;
    }
    task->part_children[part] = nodes;
    task->part_mids[part] = mids;
}

/* By now part_children and part_mids are the numbers of the part's first node and octant. */
void lp_build_write_wide(struct lp_build_task *task, uint32_t part)
{
    uint64_t begin, end;
    node_range(&begin, &end, task, part);
    const uint64_t *keys = task->from.keys;
    uint64_t node = task->part_children[part], mid = task->part_mids[part];
    for (uint64_t i = begin; i < end; node++) {
        uint64_t key = keys[i] >> 6, mask = 0, first = i;
        for (; i < end && keys[i] >> 6 == key; i++)
            mask |= UINT64_C(1) << (keys[i] & 63);
        task->wide[node] = (struct lp_wide_node){
            .mask = mask, .child_first = (uint32_t)first, .mid_first = (uint32_t)mid};
        mid += (uint64_t)__builtin_popcount(lp_mask_octants(mask));
        task->to.keys[node] = key;
    }
}
