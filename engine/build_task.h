/* Private to the builder: the passes of building a tree, as data that an executor can run. */
#ifndef LP_BUILD_TASK_H
#define LP_BUILD_TASK_H

#include "engine/build.h"

#define LP_BUILD_DIGIT_BITS  11
#define LP_BUILD_DIGITS      (1u << LP_BUILD_DIGIT_BITS)
#define LP_BUILD_PARTS_MAX   64
#define LP_BUILD_CHUNK_BITS  16
#define LP_BUILD_CHUNK       (1u << LP_BUILD_CHUNK_BITS) /* voxels in a chunk of the stream */
#define LP_BUILD_VALUE_BYTES 4                           /* the widest encoding */

/* A piece of the pushed stream, in the order of arrival. Values stand as they will be stored. */
struct lp_build_chunk {
    uint64_t keys[LP_BUILD_CHUNK];
    uint8_t *values[LP_CHANNELS_MAX]; /* one array per channel, stride_bytes apiece */
};

/* Voxels in the making of the order: Morton key and place in the stream. */
struct lp_build_order {
    uint64_t *keys;
    uint32_t *places;
};

/* Colour of a node on the way up. */
struct lp_build_sum {
    float rgb[3];
};

enum lp_build_pass {
    LP_BUILD_GATHER,       /* chunks -> order */
    LP_BUILD_HISTOGRAM,    /* digits of `from` */
    LP_BUILD_SCATTER,      /* `from` -> `to` by digit, stable */
    LP_BUILD_COUNT_LEVELS, /* where nodes begin, per level */
    LP_BUILD_MERGE,        /* duplicates -> values of the voxels, unique keys in `to` */
    LP_BUILD_COUNT_WIDE,   /* wide nodes of a level, per part */
    LP_BUILD_WRITE_WIDE,   /* wide nodes and the next level's keys */
    LP_BUILD_FILTER,       /* coarse values of one wide level */
};

/* Everything a pass reads and writes. Parts touch disjoint ranges; `counts` has a row a part. */
struct lp_build_task {
    enum lp_build_pass pass;
    uint32_t part_count;
    uint64_t count; /* entries that the pass runs over, cut into part_count ranges */
    struct lp_build_chunk *const *chunks;
    struct lp_build_order from, to;
    uint32_t shift;                                                    /* of the digit */
    uint64_t *digit_counts;                                            /* [part][digit] */
    uint64_t level_starts[LP_BUILD_PARTS_MAX][LP_LEVEL_COUNT_MAX + 1]; /* [part][t] */
    uint64_t part_children[LP_BUILD_PARTS_MAX]; /* first in: counts, then offsets */
    uint64_t part_mids[LP_BUILD_PARTS_MAX];
    struct lp_scene *scene;    /* the file being filled */
    struct lp_wide_node *wide; /* WRITE_WIDE: of wide level `wide_level` */
    uint32_t wide_level;
    struct lp_build_sum *sums_in[LP_CHANNELS_MAX], *sums_out[LP_CHANNELS_MAX];
    float *weights_in, *weights_out; /* of the nodes of level 2k and 2k+2 */
};

/* Part `part` of the entries: [*begin, *end). */
static inline void lp_build_range(uint64_t *begin, uint64_t *end, const struct lp_build_task *task,
                                  uint32_t part)
{
    *begin = task->count * part / task->part_count;
    *end = task->count * (part + 1) / task->part_count;
}

void lp_build_task_run(struct lp_build_task *task, uint32_t part);

/* The passes, by file. */
void lp_build_gather(struct lp_build_task *task, uint32_t part);       /* build_order.c */
void lp_build_histogram(struct lp_build_task *task, uint32_t part);    /* build_order.c */
void lp_build_scatter(struct lp_build_task *task, uint32_t part);      /* build_order.c */
void lp_build_count_levels(struct lp_build_task *task, uint32_t part); /* build_order.c */
void lp_build_merge(struct lp_build_task *task, uint32_t part);        /* build_merge.c */
void lp_build_count_wide(struct lp_build_task *task, uint32_t part);   /* build_levels.c */
void lp_build_write_wide(struct lp_build_task *task, uint32_t part);   /* build_levels.c */
void lp_build_filter(struct lp_build_task *task, uint32_t part);       /* build_filter.c */

/* Which cells of a brick (bits of a finest wide node's mask) have an empty cell beyond each face,
 * in lp_face order. `cell` is the brick's lowest voxel. (build_exposure.c) */
void lp_build_exposed(uint64_t exposed[6], const struct lp_octree *tree, uint64_t mask,
                      const uint32_t cell_vox[3]);

/* Writes the nearest value of `rgb` (or of a direction) in a channel's encoding. (build_merge.c) */
void lp_build_store(uint8_t *value, enum lp_encoding encoding, const float rgb[3]);
/* Reads it back; a normal comes as a unit vector. (build_merge.c) */
void lp_build_load(float rgb[3], enum lp_encoding encoding, const uint8_t *value);

#endif
