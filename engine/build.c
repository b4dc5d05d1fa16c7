/* From a stream of voxels to the bytes of a scene file: keeps the stream, then runs the passes. */
#include "engine/build.h"

#include "engine/build_task.h"
#include "engine/render.h"
#include "engine/scene_file.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#define PART_VOXELS_MIN 16384 /* smaller parts are not worth a thread */

struct lp_build {
    struct lp_build_params params;
    uint32_t channel_count; /* albedo and the extra ones */
    struct lp_channel channels[LP_CHANNELS_MAX];
    uint64_t count; /* voxels pushed */
    struct lp_build_chunk **chunks;
    size_t chunk_count, chunk_room;
    uint64_t stream_bytes; /* taken by the chunks */
    bool used_up;
};

/* ---- the stream --------------------------------------------------------------------------------
 */

static enum lp_code check_params(const struct lp_build_params *params, struct lp_error *err)
{
    if (params->depth < 1 || params->depth > LP_DEPTH_MAX)
        return lp_fail(err, LP_INVALID, "depth", "is %u, it must be 1 to %d", params->depth,
                       LP_DEPTH_MAX);
    if (params->filter != 0 && params->filter != LP_FILTER_VISIBLE &&
        params->filter != LP_FILTER_MEAN)
        return lp_fail(err, LP_INVALID, "filter", "%d is unknown", (int)params->filter);
    if (!isfinite(params->voxel_size_m) || params->voxel_size_m <= 0)
        return lp_fail(err, LP_INVALID, "voxel_size_m", "must be a positive number");
    for (int a = 0; a < 3; a++)
        if (!isfinite(params->origin_m[a]))
            return lp_fail(err, LP_INVALID, "origin_m", "must be finite");
    if (params->channel_count >= LP_CHANNELS_MAX)
        return lp_fail(err, LP_LIMIT, "channels", "%u channels beside albedo, at most %d",
                       params->channel_count, LP_CHANNELS_MAX - 1);
    return LP_OK;
}

static void set_channel(struct lp_channel *channel, enum lp_channel_kind kind, const char *name)
{
    *channel = (struct lp_channel){.kind = kind, .encoding = lp_channel_encoding(kind)};
    channel->stride_bytes = lp_encoding_stride_bytes(channel->encoding);
    memcpy(channel->name, name, strlen(name));
}

static enum lp_code add_channel(struct lp_build *build, const struct lp_build_channel *wanted,
                                struct lp_error *err)
{
    bool ended = memchr(wanted->name, 0, sizeof wanted->name) != NULL;
    if (!ended || !lp_name_ok(wanted->name))
        return lp_fail(err, LP_INVALID, "channels", "\"%.100s\" is not a name", wanted->name);
    if (wanted->kind == LP_CHANNEL_ALBEDO || lp_channel_encoding(wanted->kind) == 0)
        return lp_fail(err, LP_INVALID, wanted->name, "kind %d cannot be added", (int)wanted->kind);
    if (wanted->kind != LP_CHANNEL_RADIANCE &&
        strcmp(wanted->name, lp_channel_kind_text(wanted->kind)) != 0)
        return lp_fail(err, LP_INVALID, wanted->name, "a channel of kind %s bears that name",
                       lp_channel_kind_text(wanted->kind));
    for (uint32_t i = 0; i < build->channel_count; i++)
        if (strcmp(build->channels[i].name, wanted->name) == 0)
            return lp_fail(err, LP_INVALID, wanted->name, "two channels of this name");
    set_channel(&build->channels[build->channel_count++], wanted->kind, wanted->name);
    return LP_OK;
}

enum lp_code lp_build_create(struct lp_build **out, const struct lp_build_params *params,
                             struct lp_error *err)
{
    enum lp_code code = check_params(params, err);
    if (code != LP_OK)
        return code;
    struct lp_build *build = calloc(1, sizeof *build);
    if (!build)
        return lp_fail(err, LP_NO_MEMORY, "", "no memory for a build");
    build->params = *params;
    build->params.channels = NULL; /* copied below */
    if (build->params.filter == 0)
        build->params.filter = LP_FILTER_VISIBLE;
    if (!build->params.executor)
        build->params.executor = lp_executor_serial();
    set_channel(&build->channels[build->channel_count++], LP_CHANNEL_ALBEDO, "albedo");
    for (uint32_t i = 0; i < params->channel_count && code == LP_OK; i++)
        code = add_channel(build, &params->channels[i], err);
    if (code != LP_OK) {
        lp_build_destroy(&build);
        return code;
    }
    *out = build;
    return LP_OK;
}

static void drop_chunks(struct lp_build *build)
{
    for (size_t i = 0; i < build->chunk_count; i++)
        free(build->chunks[i]);
    free(build->chunks);
    build->chunks = NULL;
    build->chunk_count = build->chunk_room = 0;
}

void lp_build_destroy(struct lp_build **build)
{
    if (!*build)
        return;
    drop_chunks(*build);
    free(*build);
    *build = NULL;
}

/* A chunk and its value arrays in one block; `intended` voxels are to be held in the end. */
static enum lp_code add_chunk(struct lp_build *build, uint64_t intended, struct lp_error *err)
{
    size_t bytes = sizeof(struct lp_build_chunk);
    for (uint32_t c = 0; c < build->channel_count; c++)
        bytes += (size_t)build->channels[c].stride_bytes * LP_BUILD_CHUNK;
    /* Ordering takes two more keys and places a voxel. */
    uint64_t all = build->stream_bytes + bytes + intended * 24;
    if (build->params.memory_limit_bytes && all > build->params.memory_limit_bytes)
        return lp_fail(err, LP_LIMIT, "",
                       "more than %llu voxels need over %llu MiB of memory: "
                       "choose a smaller depth",
                       (unsigned long long)build->count,
                       (unsigned long long)(build->params.memory_limit_bytes >> 20));
    if (build->chunk_count == build->chunk_room) {
        size_t room = build->chunk_room ? 2 * build->chunk_room : 64;
        struct lp_build_chunk **chunks = realloc(build->chunks, room * sizeof *chunks);
        if (!chunks)
            return lp_fail(err, LP_NO_MEMORY, "", "no memory for more than %llu voxels",
                           (unsigned long long)build->count);
        build->chunks = chunks;
        build->chunk_room = room;
    }
    struct lp_build_chunk *chunk = malloc(bytes);
    if (!chunk)
        return lp_fail(err, LP_NO_MEMORY, "", "no memory for more than %llu voxels",
                       (unsigned long long)build->count);
    uint8_t *values = (uint8_t *)(chunk + 1);
    for (uint32_t c = 0; c < build->channel_count; c++) {
        chunk->values[c] = values;
        values += (size_t)build->channels[c].stride_bytes * LP_BUILD_CHUNK;
    }
    build->chunks[build->chunk_count++] = chunk;
    build->stream_bytes += bytes;
    return LP_OK;
}

static enum lp_code check_voxels(const struct lp_build *build, const struct lp_voxel *voxels,
                                 const float *const *extra, size_t count, struct lp_error *err)
{
    uint32_t side = 1u << build->params.depth;
    for (size_t i = 0; i < count; i++)
        if (voxels[i].x >= side || voxels[i].y >= side || voxels[i].z >= side)
            return lp_fail(err, LP_INVALID, "voxel",
                           "(%u, %u, %u) lies outside of the cube of %u voxels a side", voxels[i].x,
                           voxels[i].y, voxels[i].z, side);
    for (uint32_t c = 1; c < build->channel_count; c++) {
        bool signs = build->channels[c].kind == LP_CHANNEL_NORMAL;
        for (size_t i = 0; i < 3 * count; i++)
            if (!isfinite(extra[c - 1][i]) || (!signs && extra[c - 1][i] < 0))
                return lp_fail(err, LP_INVALID, build->channels[c].name,
                               "value %zu of voxel (%u, %u, %u) is %g", i % 3, voxels[i / 3].x,
                               voxels[i / 3].y, voxels[i / 3].z, (double)extra[c - 1][i]);
    }
    return LP_OK;
}

enum lp_code lp_build_push(struct lp_build *build, const struct lp_voxel *voxels,
                           const float *const *extra_rgb_lin, size_t count, struct lp_error *err)
{
    if (build->used_up)
        return lp_fail(err, LP_INVALID, "", "the build is finished");
    if (count > LP_NODES_MAX - build->count)
        return lp_fail(err, LP_LIMIT, "", "more than %u voxels", LP_NODES_MAX);
    enum lp_code code = check_voxels(build, voxels, extra_rgb_lin, count, err);
    while (code == LP_OK &&
           (build->count + count + LP_BUILD_CHUNK - 1) / LP_BUILD_CHUNK > build->chunk_count)
        code = add_chunk(build, build->count + count, err);
    if (code != LP_OK)
        return code;
    for (size_t i = 0; i < count; i++) {
        uint64_t place = build->count + i;
        struct lp_build_chunk *chunk = build->chunks[place >> LP_BUILD_CHUNK_BITS];
        size_t at = place & (LP_BUILD_CHUNK - 1);
        chunk->keys[at] = lp_morton_key(voxels[i].x, voxels[i].y, voxels[i].z);
        memcpy(chunk->values[0] + 3 * at, voxels[i].albedo_srgb, 3);
        for (uint32_t c = 1; c < build->channel_count; c++)
            lp_build_store(chunk->values[c] + at * build->channels[c].stride_bytes,
                           build->channels[c].encoding, extra_rgb_lin[c - 1] + 3 * i);
    }
    build->count += count;
    return LP_OK;
}

/* ---- the passes --------------------------------------------------------------------------------
 */

void lp_build_task_run(struct lp_build_task *task, uint32_t part)
{
    static void (*const passes[])(struct lp_build_task *, uint32_t) = {
        [LP_BUILD_GATHER] = lp_build_gather,
        [LP_BUILD_HISTOGRAM] = lp_build_histogram,
        [LP_BUILD_SCATTER] = lp_build_scatter,
        [LP_BUILD_COUNT_LEVELS] = lp_build_count_levels,
        [LP_BUILD_MERGE] = lp_build_merge,
        [LP_BUILD_COUNT_WIDE] = lp_build_count_wide,
        [LP_BUILD_WRITE_WIDE] = lp_build_write_wide,
        [LP_BUILD_FILTER] = lp_build_filter,
    };
    passes[task->pass](task, part);
}

/* What finish works with; `task` is shared by all passes. */
struct finish {
    struct lp_build *build;
    struct lp_build_task task;
    struct lp_build_order orders[2];
    struct lp_scene scene; /* over `bytes` */
    void *bytes;
    size_t byte_count;
    struct lp_error *err;
};

static void run_pass(struct finish *f, enum lp_build_pass pass, uint64_t count)
{
    struct lp_executor *executor = f->build->params.executor;
    uint64_t parts = count / PART_VOXELS_MIN;
    uint64_t most = executor->width == 1 ? 1 : 4u * executor->width;
    parts = parts > most ? most : parts;
    parts = parts > LP_BUILD_PARTS_MAX ? LP_BUILD_PARTS_MAX : parts < 1 ? 1 : parts;
    f->task.pass = pass;
    f->task.count = count;
    f->task.part_count = (uint32_t)parts;
    struct lp_task task = {.kind = LP_TASK_BUILD, .of.build = &f->task};
    executor->run(executor, &task, f->task.part_count);
}

static enum lp_code step(struct finish *f, const char *phase, uint64_t total)
{
    struct lp_progress *progress = f->build->params.progress;
    if (lp_progress_cancelled(progress))
        return lp_fail(f->err, LP_CANCELLED, "", "cancelled");
    lp_progress_phase(progress, phase, total);
    return LP_OK;
}

static void advance(struct finish *f)
{
    struct lp_progress *progress = f->build->params.progress;
    if (progress)
        atomic_fetch_add_explicit(&progress->done, 1, memory_order_relaxed);
}

static enum lp_code take_orders(struct finish *f)
{
    size_t n = (size_t)f->build->count;
    for (int i = 0; i < 2; i++) {
        f->orders[i].keys = malloc(n * sizeof *f->orders[i].keys);
        f->orders[i].places = malloc(n * sizeof *f->orders[i].places);
        if (!f->orders[i].keys || !f->orders[i].places)
            return lp_fail(f->err, LP_NO_MEMORY, "", "no memory to order %zu voxels", n);
    }
    f->task.digit_counts =
        malloc(LP_BUILD_PARTS_MAX * LP_BUILD_DIGITS * sizeof *f->task.digit_counts);
    if (!f->task.digit_counts)
        return lp_fail(f->err, LP_NO_MEMORY, "", "no memory to order voxels");
    return LP_OK;
}

/* Counts to places: digit by digit and, within a digit, part by part, which keeps it stable.
 * Returns whether there is more than one digit, so that scattering changes anything. */
static bool place_digits(struct lp_build_task *task)
{
    uint64_t at = 0, largest = 0;
    for (uint32_t d = 0; d < LP_BUILD_DIGITS; d++) {
        uint64_t of_digit = 0;
        for (uint32_t part = 0; part < task->part_count; part++) {
            uint64_t *count = &task->digit_counts[(size_t)part * LP_BUILD_DIGITS + d];
            uint64_t n = *count;
            *count = at;
            at += n;
            of_digit += n;
        }
        largest = of_digit > largest ? of_digit : largest;
    }
    return largest < task->count;
}

static enum lp_code sort_stream(struct finish *f)
{
    uint32_t bits = 3u * f->build->params.depth;
    uint64_t n = f->build->count;
    enum lp_code code =
        step(f, "sorting voxels", (bits + LP_BUILD_DIGIT_BITS - 1) / LP_BUILD_DIGIT_BITS);
    f->task.chunks = f->build->chunks;
    f->task.to = f->orders[0];
    if (code == LP_OK)
        run_pass(f, LP_BUILD_GATHER, n);
    f->task.from = f->orders[0];
    f->task.to = f->orders[1];
    for (uint32_t shift = 0; shift < bits && code == LP_OK; shift += LP_BUILD_DIGIT_BITS) {
        if (lp_progress_cancelled(f->build->params.progress))
            return lp_fail(f->err, LP_CANCELLED, "", "cancelled");
        f->task.shift = shift;
        run_pass(f, LP_BUILD_HISTOGRAM, n);
        if (place_digits(&f->task)) {
            run_pass(f, LP_BUILD_SCATTER, n);
            struct lp_build_order done = f->task.to;
            f->task.to = f->task.from;
            f->task.from = done;
        }
        advance(f);
    }
    return code;
}

/* Sizes of all levels from the sorted keys, and memory of just the file's size. */
static enum lp_code lay_out(struct finish *f)
{
    const struct lp_build *build = f->build;
    struct lp_scene_layout layout = {.depth = build->params.depth,
                                     .channel_count = build->channel_count};
    memcpy(layout.channels, build->channels, sizeof layout.channels);
    run_pass(f, LP_BUILD_COUNT_LEVELS, build->count);
    uint64_t children = 0; /* unique keys before each part, for the merge */
    for (uint32_t part = 0; part < f->task.part_count; part++) {
        f->task.part_children[part] = children;
        children += part == 0;
        for (uint32_t t = 1; t <= LP_LEVEL_COUNT_MAX; t++)
            children += f->task.level_starts[part][t];
    }
    for (uint32_t level = 0; level <= build->params.depth; level++) {
        layout.level_count[level] = 1; /* the very first key */
        for (uint32_t part = 0; part < f->task.part_count; part++)
            for (uint32_t t = level + 1; t <= LP_LEVEL_COUNT_MAX; t++)
                layout.level_count[level] += (uint32_t)f->task.level_starts[part][t];
    }
    for (uint32_t k = 0; k < (build->params.depth + 1u) / 2; k++)
        layout.wide_count[k] = 2 * k + 2 <= build->params.depth ? layout.level_count[2 * k + 2] : 1;
    enum lp_code code = lp_scene_layout_bytes(&f->byte_count, &layout, f->err);
    if (code != LP_OK)
        return code;
    f->bytes = aligned_alloc(LP_SCENE_ALIGN, f->byte_count);
    if (!f->bytes)
        return lp_fail(f->err, LP_NO_MEMORY, "", "no memory for a scene of %zu bytes",
                       f->byte_count);
    memset(f->bytes, 0, f->byte_count);
    lp_scene_lay_out(&f->scene, f->bytes, f->byte_count, &layout);
    f->scene.filter = build->params.filter;
    f->scene.voxel_size_m = build->params.voxel_size_m;
    memcpy(f->scene.origin_m, build->params.origin_m, sizeof f->scene.origin_m);
    f->task.scene = &f->scene;
    return LP_OK;
}

static void sum_parts(uint64_t *counts, uint32_t part_count)
{
    uint64_t at = 0;
    for (uint32_t part = 0; part < part_count; part++) {
        uint64_t n = counts[part];
        counts[part] = at;
        at += n;
    }
}

/* Coarse values of wide level k, whose nodes' keys are in task.to. */
static enum lp_code filter_level(struct finish *f, uint32_t k)
{
    uint32_t nodes = f->scene.tree.wide_count[k];
    struct lp_build_task *task = &f->task;
    bool ok = (task->weights_out = malloc(nodes * sizeof *task->weights_out)) != NULL;
    for (uint32_t c = 0; c < f->scene.channel_count; c++)
        ok &= (task->sums_out[c] = malloc(nodes * sizeof *task->sums_out[c])) != NULL;
    if (!ok)
        return lp_fail(f->err, LP_NO_MEMORY, "", "no memory to filter %u nodes", nodes);
    struct lp_build_order keys = task->from;
    task->from = task->to;
    task->wide_level = k;
    run_pass(f, LP_BUILD_FILTER, nodes);
    task->from = keys;
    free(task->weights_in);
    task->weights_in = task->weights_out;
    task->weights_out = NULL;
    for (uint32_t c = 0; c < f->scene.channel_count; c++) {
        free(task->sums_in[c]);
        task->sums_in[c] = task->sums_out[c];
        task->sums_out[c] = NULL;
    }
    return LP_OK;
}

static void swap_orders(struct lp_build_task *task)
{
    struct lp_build_order from = task->from;
    task->from = task->to;
    task->to = from;
}

/* All wide levels' nodes, finest first; the bricks' keys are kept for filtering. */
static enum lp_code build_levels(struct finish *f)
{
    struct lp_build_task *task = &f->task;
    uint32_t wide_levels = f->scene.tree.wide_levels;
    enum lp_code code = step(f, "building levels", wide_levels);
    for (uint32_t k = 0; k < wide_levels && code == LP_OK; k++) {
        if (lp_progress_cancelled(f->build->params.progress))
            return lp_fail(f->err, LP_CANCELLED, "", "cancelled");
        uint64_t children = f->scene.tree.level_count[2 * k];
        task->wide = (struct lp_wide_node *)(uintptr_t)f->scene.tree.wide[k]; /* our memory */
        run_pass(f, LP_BUILD_COUNT_WIDE, children);
        sum_parts(task->part_children, task->part_count);
        sum_parts(task->part_mids, task->part_count);
        run_pass(f, LP_BUILD_WRITE_WIDE, children);
        swap_orders(task);
        advance(f);
    }
    return code;
}

/* Morton keys of the bricks once more, for their neighbours: from the voxels of the tree. */
static void brick_keys(uint64_t *keys, const struct lp_octree *tree, lp_node node, uint64_t key,
                       uint64_t *count)
{
    if (node.level <= 2) {
        keys[(*count)++] = key;
        return;
    }
    for (uint32_t mask = lp_octree_child_mask(tree, node); mask; mask &= mask - 1) {
        uint32_t i = (uint32_t)__builtin_ctz(mask);
        brick_keys(keys, tree, lp_octree_child(tree, node, i), key << 3 | i, count);
    }
}

static enum lp_code filter_levels(struct finish *f)
{
    enum lp_code code = step(f, "filtering colours", f->scene.tree.wide_levels);
    uint64_t count = 0;
    brick_keys(f->task.to.keys, &f->scene.tree, lp_octree_root(&f->scene.tree), 0, &count);
    for (uint32_t k = 0; k < f->scene.tree.wide_levels && code == LP_OK; k++) {
        if (lp_progress_cancelled(f->build->params.progress))
            return lp_fail(f->err, LP_CANCELLED, "", "cancelled");
        code = filter_level(f, k);
        advance(f);
    }
    return code;
}

static void release(struct finish *f)
{
    for (int i = 0; i < 2; i++) {
        free(f->orders[i].keys);
        free(f->orders[i].places);
    }
    free(f->task.digit_counts);
    free(f->task.weights_in);
    free(f->task.weights_out);
    for (uint32_t c = 0; c < LP_CHANNELS_MAX; c++) {
        free(f->task.sums_in[c]);
        free(f->task.sums_out[c]);
    }
}

enum lp_code lp_build_finish(void **out, size_t *out_bytes, struct lp_build *build,
                             struct lp_error *err)
{
    if (build->used_up)
        return lp_fail(err, LP_INVALID, "", "the build is finished");
    if (build->count == 0)
        return lp_fail(err, LP_INVALID, "voxels", "there is no voxel: the scene would be empty");
    struct finish *f = calloc(1, sizeof *f);
    if (!f)
        return lp_fail(err, LP_NO_MEMORY, "", "no memory to build");
    f->build = build;
    f->err = err;
    build->used_up = true;
    enum lp_code code = take_orders(f);
    if (code == LP_OK)
        code = sort_stream(f);
    if (code == LP_OK)
        code = lay_out(f);
    if (code == LP_OK) {
        run_pass(f, LP_BUILD_MERGE, build->count);
        swap_orders(&f->task);
        drop_chunks(build);
        code = build_levels(f);
    }
    if (code == LP_OK)
        code = filter_levels(f);
    if (code == LP_OK)
        code = step(f, "sealing", 0);
    if (code == LP_OK) {
        lp_octree_bounds(f->scene.bounds_min_vox, f->scene.bounds_max_vox, &f->scene.tree);
        lp_probe_suggest(f->scene.suggested_probe_m, &f->scene);
        lp_scene_seal(f->bytes, f->byte_count, &f->scene);
        *out = f->bytes;
        *out_bytes = f->byte_count;
        f->bytes = NULL;
    }
    free(f->bytes);
    release(f);
    free(f);
    return code;
}
