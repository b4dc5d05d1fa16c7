/* Ordering the stream by Morton key: gathering, a stable radix sort, and counting the levels. */
#include "engine/build_task.h"

void lp_build_gather(struct lp_build_task *task, uint32_t part)
{
    uint64_t begin, end;
    lp_build_range(&begin, &end, task, part);
    for (uint64_t i = begin; i < end; i++) {
        task->to.keys[i] = task->chunks[i >> LP_BUILD_CHUNK_BITS]->keys[i & (LP_BUILD_CHUNK - 1)];
        task->to.places[i] = (uint32_t)i;
    }
}

static uint32_t digit_of(const struct lp_build_task *task, uint64_t key)
{
    return (uint32_t)(key >> task->shift) & (LP_BUILD_DIGITS - 1);
}

void lp_build_histogram(struct lp_build_task *task, uint32_t part)
{
    uint64_t begin, end;
    lp_build_range(&begin, &end, task, part);
    uint64_t *counts = task->digit_counts + (size_t)part * LP_BUILD_DIGITS;
    for (uint32_t d = 0; d < LP_BUILD_DIGITS; d++)
        counts[d] = 0;
    for (uint64_t i = begin; i < end; i++)
        counts[digit_of(task, task->from.keys[i])]++;
}

/* The counts have become places by now (build.c sums them up digit by digit, part by part). */
void lp_build_scatter(struct lp_build_task *task, uint32_t part)
{
    uint64_t begin, end;
    lp_build_range(&begin, &end, task, part);
    uint64_t *places = task->digit_counts + (size_t)part * LP_BUILD_DIGITS;
    for (uint64_t i = begin; i < end; i++) {
        uint64_t at = places[digit_of(task, task->from.keys[i])]++;
        task->to.keys[at] = task->from.keys[i];
        task->to.places[at] = task->from.places[i];
    }
}

/* level_starts[t]: how many keys begin a new node on exactly the levels below t (t = 0: none, a
 * duplicate; the very first key begins one on every level and is left to the caller). */
void lp_build_count_levels(struct lp_build_task *task, uint32_t part)
{
    uint64_t begin, end;
    lp_build_range(&begin, &end, task, part);
    uint64_t *starts = task->level_starts[part];
    for (uint32_t t = 0; t <= LP_LEVEL_COUNT_MAX; t++)
        starts[t] = 0;
    for (uint64_t i = begin > 0 ? begin : 1; i < end; i++) {
        uint64_t differ = task->from.keys[i] ^ task->from.keys[i - 1];
        starts[differ ? (63u - (uint32_t)__builtin_clzll(differ)) / 3 + 1 : 0]++;
    }
}
