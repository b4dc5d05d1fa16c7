/* Merging voxels of one cell, and values to and from their encodings. */
#include "engine/build_task.h"

#include "engine/octahedral.h"
#include "engine/srgb.h"

#include <math.h>
#include <string.h>

/* Wide enough for 2^32 duplicates of the largest value; sums of integers do not mind their order.
 */
typedef __int128 wide_sum;

/* Fixed point: units of 2^-40 hold every entry of the sRGB table, every RGB9E5 value below 2^16 and
 * a unit vector exactly enough to be the same on all machines. */
#define SUM_UNITS 0x1p40

void lp_build_store(uint8_t *value, enum lp_encoding encoding, const float rgb[3])
{
    uint32_t packed;
    uint16_t code;
    switch (encoding) {
    case LP_ENCODING_SRGB8:
        for (int c = 0; c < 3; c++)
            value[c] = lp_srgb_from_linear(rgb[c]);
        break;
    case LP_ENCODING_RGB9E5:
        packed = lp_rgb9e5_encode(rgb);
        memcpy(value, &packed, sizeof packed);
        break;
    case LP_ENCODING_OCT16:
        code = lp_oct16_encode(rgb);
        memcpy(value, &code, sizeof code);
        break;
    }
}

void lp_build_load(float rgb[3], enum lp_encoding encoding, const uint8_t *value)
{
    uint32_t packed;
    uint16_t code;
    switch (encoding) {
    case LP_ENCODING_SRGB8:
        for (int c = 0; c < 3; c++)
            rgb[c] = lp_srgb_to_linear[value[c]];
        break;
    case LP_ENCODING_RGB9E5:
        memcpy(&packed, value, sizeof packed);
        lp_rgb9e5_decode(rgb, packed);
        break;
    case LP_ENCODING_OCT16:
        memcpy(&code, value, sizeof code);
        lp_oct16_decode(rgb, code);
        break;
    }
}

/* The value of voxels places[0..count-1] in channel `c`. */
static void merge_value(uint8_t *out, const struct lp_build_task *task, uint32_t c,
                        const uint32_t *places, uint64_t count)
{
    const struct lp_channel *channel = &task->scene->channels[c];
    wide_sum sums[3] = {0, 0, 0};
    for (uint64_t i = 0; i < count; i++) {
        const struct lp_build_chunk *chunk = task->chunks[places[i] >> LP_BUILD_CHUNK_BITS];
        const uint8_t *value =
            chunk->values[c] + (size_t)(places[i] & (LP_BUILD_CHUNK - 1)) * channel->stride_bytes;
        if (count == 1) {
            memcpy(out, value, channel->stride_bytes);
            return;
        }
        float rgb[3];
        lp_build_load(rgb, channel->encoding, value);
        for (int a = 0; a < 3; a++)
            sums[a] += (int64_t)((double)rgb[a] * SUM_UNITS);
    }
    float mean[3];
    bool unit = channel->encoding == LP_ENCODING_OCT16;
    for (int a = 0; a < 3; a++)
        mean[a] = (float)((double)(int64_t)(sums[a] / (wide_sum)count) / SUM_UNITS);
    if (unit && mean[0] == 0.0f && mean[1] == 0.0f && mean[2] == 0.0f)
        mean[1] = 1.0f;
    lp_build_store(out, channel->encoding, mean);
}

/* A part merges the cells whose first voxel lies in its range; the last one may reach beyond. */
void lp_build_merge(struct lp_build_task *task, uint32_t part)
{
    uint64_t begin, end;
    lp_build_range(&begin, &end, task, part);
    const uint64_t *keys = task->from.keys;
    while (begin > 0 && begin < end && keys[begin] == keys[begin - 1])
        begin++;
    uint64_t rank = task->part_children[part];
    for (uint64_t i = begin; i < end;) {
        uint64_t next = i + 1;
        while (next < task->count && keys[next] == keys[i])
            next++;
        task->to.keys[rank] = keys[i];
        for (uint32_t c = 0; c < task->scene->channel_count; c++) {
            const struct lp_channel *channel = &task->scene->channels[c];
            uint8_t *values = (uint8_t *)(uintptr_t)channel->values; /* the builder's own memory */
            uint64_t attribute = task->scene->tree.level_first[0] + rank;
            merge_value(values + attribute * channel->stride_bytes, task, c, task->from.places + i,
                        next - i);
        }
        rank++;
        i = next;
    }
}
