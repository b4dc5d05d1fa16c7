/* Coarse values: every node above the voxels gets the filtered value of its children.
 *
 * mean: the plain average of the children that are there (the thesis). visible: children weighted
 * by the exposed faces of the voxels below them, so that what is buried does not count; where all
 * is buried, the plain average. Sums run in child order and in linear light; values go up
 * unrounded. */
#include "engine/build_task.h"

#include <math.h>

/* A node's children on the way to its own value. */
struct mix {
    float rgb[3], plain[3]; /* weighted and unweighted sums */
    float weight, count;
};

static void mix_add(struct mix *mix, const float rgb[3], float weight)
{
    for (int c = 0; c < 3; c++) {
        mix->rgb[c] += weight * rgb[c];
        mix->plain[c] += rgb[c];
    }
    mix->weight += weight;
    mix->count += 1.0f;
}

static void mix_value(float rgb[3], const struct mix *mix)
{
    const float *sum = mix->weight > 0.0f ? mix->rgb : mix->plain;
    float over = mix->weight > 0.0f ? mix->weight : mix->count;
    for (int c = 0; c < 3; c++)
        rgb[c] = sum[c] / over;
}

/* Weights of the children of one wide node, in mask order. */
static void child_weights(float weights[64], const struct lp_build_task *task, uint32_t node,
                          uint64_t key)
{
    const struct lp_wide_node *wide = &task->scene->tree.wide[task->wide_level][node];
    if (task->scene->filter == LP_FILTER_MEAN) {
        for (int i = 0; i < 64; i++)
            weights[i] = 1.0f;
        return;
    }
    if (task->wide_level > 0) {
        uint32_t child = wide->child_first;
        for (uint64_t left = wide->mask; left; left &= left - 1)
            weights[__builtin_ctzll(left)] = task->weights_in[child++];
        return;
    }
    uint64_t exposed[6];
    uint32_t cell[3];
    for (int a = 0; a < 3; a++)
        cell[a] = lp_morton_gather(key >> a) * 4;
    lp_build_exposed(exposed, &task->scene->tree, wide->mask, cell);
    for (uint64_t left = wide->mask; left; left &= left - 1) {
        int i = __builtin_ctzll(left);
        int faces = 0;
        for (int f = 0; f < 6; f++)
            faces += (int)(exposed[f] >> i & 1);
        weights[i] = (float)faces;
    }
}

/* The value of child `rank` of the wide level's finer side. */
static void child_value(float rgb[3], const struct lp_build_task *task, uint32_t c, uint32_t rank)
{
    const struct lp_channel *channel = &task->scene->channels[c];
    if (task->wide_level > 0) {
        for (int a = 0; a < 3; a++)
            rgb[a] = task->sums_in[c][rank].rgb[a];
        return;
    }
    uint64_t attribute = task->scene->tree.level_first[0] + rank;
    lp_build_load(rgb, channel->encoding, channel->values + attribute * channel->stride_bytes);
}

static void store_value(const struct lp_build_task *task, uint32_t c, uint32_t level, uint64_t rank,
                        const float rgb[3])
{
    const struct lp_channel *channel = &task->scene->channels[c];
    uint8_t *values = (uint8_t *)(uintptr_t)channel->values; /* the builder's own memory */
    uint64_t attribute = task->scene->tree.level_first[level] + rank;
    lp_build_store(values + attribute * channel->stride_bytes, channel->encoding, rgb);
}

/* One channel of one wide node: its octants (level 2k+1), then itself (level 2k+2, which exists
 * unless the root is an octant). */
static void filter_channel(const struct lp_build_task *task, uint32_t c, uint32_t node,
                           const float weights[64])
{
    const struct lp_octree *tree = &task->scene->tree;
    const struct lp_wide_node *wide = &tree->wide[task->wide_level][node];
    uint32_t level = 2 * task->wide_level;
    uint32_t child = wide->child_first, mid = wide->mid_first;
    bool mean = task->scene->filter == LP_FILTER_MEAN;
    struct mix whole = {0};
    for (uint32_t octant = 0; octant < 8; octant++) {
        uint32_t there = (uint32_t)(wide->mask >> (8 * octant)) & 0xff;
        if (!there)
            continue;
        struct mix part = {0};
        for (; there; there &= there - 1) {
            float rgb[3];
            child_value(rgb, task, c, child++);
            mix_add(&part, rgb, weights[8 * octant + (uint32_t)__builtin_ctz(there)]);
        }
        float rgb[3];
        mix_value(rgb, &part);
        store_value(task, c, level + 1, mid++, rgb);
        mix_add(&whole, rgb, mean ? 1.0f : part.weight);
    }
    float rgb[3];
    mix_value(rgb, &whole);
    if (level + 2 <= tree->depth) {
        store_value(task, c, level + 2, node, rgb);
        for (int a = 0; a < 3; a++)
            task->sums_out[c][node].rgb[a] = rgb[a];
        task->weights_out[node] = whole.weight;
    }
}

/* Runs over the wide nodes of level `wide_level`; from.keys holds their Morton keys at level 0. */
void lp_build_filter(struct lp_build_task *task, uint32_t part)
{
    uint64_t begin, end;
    lp_build_range(&begin, &end, task, part);
    for (uint64_t node = begin; node < end; node++) {
        float weights[64];
        child_weights(weights, task, (uint32_t)node, task->from.keys[node]);
        for (uint32_t c = 0; c < task->scene->channel_count; c++)
            filter_channel(task, c, (uint32_t)node, weights);
    }
}
