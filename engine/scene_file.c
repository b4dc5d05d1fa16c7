/* Laying out, sealing, checking and mapping scene files; the format is drawn in the header. */
#include "engine/scene_file.h"

#include <math.h>
#include <stdio.h>
#include <string.h>

#define XXH_STATIC_LINKING_ONLY /* the state's size, to have it on the stack */
#include <xxhash.h>

#if __BYTE_ORDER__ != __ORDER_LITTLE_ENDIAN__
#error "a scene is mapped as it lies on disk: little-endian machines only"
#endif

#define SECTIONS_MAX   (LP_WIDE_LEVELS_MAX + LP_CHANNELS_MAX)
#define NAME_ROOM      104
#define ENTRY_BYTES    160
#define CHECKSUM_FIELD 24

static const uint8_t magic[8] = {0x89, 'L', 'P', 'S', '\r', '\n', 0x1a, '\n'};

enum section_kind { SECTION_NODES = 1, SECTION_CHANNEL = 2 };

struct file_header {
    uint8_t magic[8];
    uint32_t version, header_bytes;
    uint64_t file_bytes, checksum;
    uint32_t depth, filter;
    double voxel_size_m, origin_m[3];
    uint32_t bounds_min_vox[3], bounds_max_vox[3];
    double suggested_probe_m[3];
    uint32_t section_count, zero;
    uint32_t level_count[LP_LEVEL_COUNT_MAX];
    uint8_t zeros[LP_SCENE_HEADER_BYTES - 204];
};
_Static_assert(sizeof(struct file_header) == LP_SCENE_HEADER_BYTES, "as drawn");
_Static_assert(offsetof(struct file_header, checksum) == CHECKSUM_FIELD, "as drawn");
_Static_assert(offsetof(struct file_header, level_count) == 128, "as drawn");
_Static_assert(offsetof(struct file_header, zeros) == 204, "as drawn");

struct file_section {
    uint32_t kind, index, channel_kind, encoding;
    uint64_t offset, bytes, checksum;
    char name[NAME_ROOM];
    uint8_t zeros[16];
};
_Static_assert(sizeof(struct file_section) == ENTRY_BYTES, "as drawn");
_Static_assert(sizeof(struct lp_wide_node) == 16, "as drawn");

static uint64_t align_up(uint64_t n)
{
    return (n + LP_SCENE_ALIGN - 1) / LP_SCENE_ALIGN * LP_SCENE_ALIGN;
}

static uint64_t table_end(uint32_t section_count)
{
    return LP_SCENE_HEADER_BYTES + (uint64_t)section_count * ENTRY_BYTES;
}

/* Where section `i` stops counting for its checksum: the next one's start, or the file's end. */
static uint64_t section_end(const struct file_section *table, uint32_t count, uint32_t i,
                            uint64_t file_bytes)
{
    return i + 1 < count ? table[i + 1].offset : file_bytes;
}

/* Header and table with the checksum's own field as zero, up to the first section. */
static uint64_t head_checksum(const uint8_t *bytes, uint64_t head_bytes)
{
    static const uint8_t zeros[8];
    XXH3_state_t state;
    XXH3_64bits_reset(&state);
    XXH3_64bits_update(&state, bytes, CHECKSUM_FIELD);
    XXH3_64bits_update(&state, zeros, sizeof zeros);
    XXH3_64bits_update(&state, bytes + CHECKSUM_FIELD + 8, (size_t)head_bytes - CHECKSUM_FIELD - 8);
    return XXH3_64bits_digest(&state);
}

/* ---- writing -----------------------------------------------------------------------------------
 */

/* Fills the table of a new file; returns its size, or 0 when it does not fit 64 bits. */
static uint64_t plan_sections(struct file_section *table, uint32_t *count,
                              const struct lp_scene_layout *layout)
{
    uint32_t wide_levels = (layout->depth + 1u) / 2;
    uint64_t nodes = 0;
    for (int level = 0; level <= layout->depth; level++)
        nodes += layout->level_count[level];
    *count = wide_levels + layout->channel_count;
    uint64_t at = align_up(table_end(*count));
    for (uint32_t i = 0; i < *count; i++) {
        struct file_section *section = &table[i];
        *section = (struct file_section){.offset = at};
        if (i < wide_levels) {
            section->kind = SECTION_NODES;
            section->index = i;
            section->bytes = (uint64_t)layout->wide_count[i] * sizeof(struct lp_wide_node);
        } else {
            const struct lp_channel *channel = &layout->channels[i - wide_levels];
            section->kind = SECTION_CHANNEL;
            section->index = i - wide_levels;
            section->channel_kind = (uint32_t)channel->kind;
            section->encoding = (uint32_t)channel->encoding;
            section->bytes = nodes * channel->stride_bytes;
            memcpy(section->name, channel->name, strlen(channel->name));
        }
        at = align_up(at + section->bytes);
    }
    return at;
}

enum lp_code lp_scene_layout_bytes(size_t *bytes, const struct lp_scene_layout *layout,
                                   struct lp_error *err)
{
    /* At most 2^32 nodes in each of 19 levels times 4 bytes in 32 channels: far below 2^64. */
    struct file_section table[SECTIONS_MAX];
    uint32_t count;
    uint64_t all = plan_sections(table, &count, layout);
    if (all > SIZE_MAX / 2)
        return lp_fail(err, LP_LIMIT, "", "the scene would take %llu bytes",
                       (unsigned long long)all);
    *bytes = (size_t)all;
    return LP_OK;
}

/* Points a scene at the sections of checked or freshly laid-out bytes. */
static void point_at(struct lp_scene *scene, const uint8_t *bytes, const struct file_header *header,
                     const struct file_section *table)
{
    *scene = (struct lp_scene){.filter = (enum lp_filter)header->filter,
                               .voxel_size_m = header->voxel_size_m};
    scene->tree.depth = (uint8_t)header->depth;
    scene->tree.wide_levels = (uint8_t)((header->depth + 1) / 2);
    memcpy(scene->tree.level_count, header->level_count, sizeof header->level_count);
    memcpy(scene->origin_m, header->origin_m, sizeof scene->origin_m);
    memcpy(scene->bounds_min_vox, header->bounds_min_vox, sizeof scene->bounds_min_vox);
    memcpy(scene->bounds_max_vox, header->bounds_max_vox, sizeof scene->bounds_max_vox);
    memcpy(scene->suggested_probe_m, header->suggested_probe_m, sizeof scene->suggested_probe_m);
    lp_octree_number(&scene->tree);
    for (uint32_t i = 0; i < header->section_count; i++) {
        const struct file_section *section = &table[i];
        const void *data = bytes + section->offset;
        if (section->kind == SECTION_NODES) {
            scene->tree.wide[section->index] = data;
            scene->tree.wide_count[section->index] =
                (uint32_t)(section->bytes / sizeof(struct lp_wide_node));
            continue;
        }
        struct lp_channel *channel = &scene->channels[scene->channel_count++];
        channel->kind = (enum lp_channel_kind)section->channel_kind;
        channel->encoding = (enum lp_encoding)section->encoding;
        channel->stride_bytes = lp_encoding_stride_bytes(channel->encoding);
        memcpy(channel->name, section->name, sizeof channel->name);
        channel->values = data;
    }
}

void lp_scene_lay_out(struct lp_scene *scene, void *bytes, size_t byte_count,
                      const struct lp_scene_layout *layout)
{
    struct file_header *header = bytes;
    struct file_section *table = (void *)((uint8_t *)bytes + LP_SCENE_HEADER_BYTES);
    memcpy(header->magic, magic, sizeof magic);
    header->version = LP_SCENE_VERSION;
    header->header_bytes = LP_SCENE_HEADER_BYTES;
    header->file_bytes = byte_count;
    header->depth = layout->depth;
    memcpy(header->level_count, layout->level_count, sizeof header->level_count);
    plan_sections(table, &header->section_count, layout);
    point_at(scene, bytes, header, table);
}

void lp_scene_seal(void *bytes, size_t byte_count, const struct lp_scene *scene)
{
    struct file_header *header = bytes;
    struct file_section *table = (void *)((uint8_t *)bytes + LP_SCENE_HEADER_BYTES);
    header->filter = (uint32_t)scene->filter;
    header->voxel_size_m = scene->voxel_size_m;
    memcpy(header->origin_m, scene->origin_m, sizeof header->origin_m);
    memcpy(header->bounds_min_vox, scene->bounds_min_vox, sizeof header->bounds_min_vox);
    memcpy(header->bounds_max_vox, scene->bounds_max_vox, sizeof header->bounds_max_vox);
    memcpy(header->suggested_probe_m, scene->suggested_probe_m, sizeof header->suggested_probe_m);
    for (uint32_t i = 0; i < header->section_count; i++) {
        uint64_t end = section_end(table, header->section_count, i, byte_count);
        table[i].checksum =
            XXH3_64bits((uint8_t *)bytes + table[i].offset, (size_t)(end - table[i].offset));
    }
    header->checksum = head_checksum(bytes, table[0].offset);
}

/* ---- checking ----------------------------------------------------------------------------------
 */

static bool all_zero(const uint8_t *bytes, uint64_t count)
{
    for (uint64_t i = 0; i < count; i++)
        if (bytes[i] != 0)
            return false;
    return true;
}

/* What can be said before the checksum is known to hold. */
static enum lp_code check_shape(const uint8_t *bytes, size_t byte_count, struct lp_error *err)
{
    const struct file_header *header = (const void *)bytes;
    if (byte_count < sizeof magic || memcmp(bytes, magic, sizeof magic) != 0)
        return lp_fail(err, LP_CORRUPT, "magic",
                       byte_count >= 4 && memcmp(bytes, magic, 4) == 0
                           ? "the first bytes were changed as text transfers do: copy the file in "
                             "binary mode"
                           : "this is not a lightprobe scene: the first bytes are not \\x89LPS");
    if (byte_count < LP_SCENE_HEADER_BYTES)
        return lp_fail(err, LP_CORRUPT, "header",
                       "the file ends after %zu bytes, inside of its "
                       "header of %d",
                       byte_count, LP_SCENE_HEADER_BYTES);
    if (header->version != LP_SCENE_VERSION)
        return lp_fail(err, LP_UNSUPPORTED, "version",
                       "scene format %u is not in this version, "
                       "which reads %d: build the scene anew or use a newer program",
                       header->version, LP_SCENE_VERSION);
    if (header->header_bytes != LP_SCENE_HEADER_BYTES)
        return lp_fail(err, LP_CORRUPT, "header_bytes", "is %u, not %d", header->header_bytes,
                       LP_SCENE_HEADER_BYTES);
    if (header->file_bytes != byte_count)
        return lp_fail(err, LP_CORRUPT, "file_bytes",
                       "the file has %zu bytes, its header says "
                       "%llu: it was cut or is still being written",
                       byte_count, (unsigned long long)header->file_bytes);
    if (header->section_count == 0 || header->section_count > SECTIONS_MAX)
        return lp_fail(err, LP_CORRUPT, "section_count", "is %u, not 1..%d", header->section_count,
                       SECTIONS_MAX);
    uint64_t head = align_up(table_end(header->section_count));
    if (head > byte_count)
        return lp_fail(err, LP_CORRUPT, "section table", "reaches beyond the end of the file");
    if (head_checksum(bytes, head) != header->checksum)
        return lp_fail(err, LP_CORRUPT, "checksum", "header or section table is damaged");
    return LP_OK;
}

static enum lp_code check_header(const struct file_header *header, struct lp_error *err)
{
    if (header->depth < 1 || header->depth > LP_DEPTH_MAX)
        return lp_fail(err, LP_CORRUPT, "depth", "is %u, not 1..%d", header->depth, LP_DEPTH_MAX);
    if (header->filter != LP_FILTER_VISIBLE && header->filter != LP_FILTER_MEAN)
        return lp_fail(err, LP_CORRUPT, "filter", "%u is unknown", header->filter);
    if (!isfinite(header->voxel_size_m) || header->voxel_size_m <= 0)
        return lp_fail(err, LP_CORRUPT, "voxel_size_m", "is not a positive number");
    uint32_t side = 1u << header->depth;
    for (int a = 0; a < 3; a++) {
        if (!isfinite(header->origin_m[a]))
            return lp_fail(err, LP_CORRUPT, "origin_m", "is not finite");
        if (!isfinite(header->suggested_probe_m[a]))
            return lp_fail(err, LP_CORRUPT, "suggested_probe_m", "is not finite");
        if (header->bounds_min_vox[a] >= header->bounds_max_vox[a] ||
            header->bounds_max_vox[a] > side)
            return lp_fail(err, LP_CORRUPT, "bounds_vox", "are empty or outside of the cube");
    }
    for (uint32_t level = 0; level < LP_LEVEL_COUNT_MAX; level++)
        if ((header->level_count[level] == 0) != (level > header->depth))
            return lp_fail(err, LP_CORRUPT, "level_count", "level %u of %u has %u nodes", level,
                           header->depth, header->level_count[level]);
    if (header->zero != 0 || !all_zero(header->zeros, sizeof header->zeros))
        return lp_fail(err, LP_CORRUPT, "header", "bytes that must be zero are not");
    return LP_OK;
}

static enum lp_code check_channel(const struct file_section *section, uint32_t nth,
                                  uint64_t node_count, struct lp_error *err)
{
    char name[NAME_ROOM];
    memcpy(name, section->name, sizeof name);
    size_t length = strnlen(name, sizeof name);
    if (length >= LP_NAME_BYTES || !lp_name_ok(name) ||
        !all_zero((const uint8_t *)name + length, sizeof name - length))
        return lp_fail(err, LP_CORRUPT, "channel", "channel %u has no valid name", nth);
    enum lp_channel_kind kind = (enum lp_channel_kind)section->channel_kind;
    enum lp_encoding encoding = lp_channel_encoding(kind);
    if (encoding == 0 || (uint32_t)encoding != section->encoding)
        return lp_fail(err, LP_CORRUPT, name, "channel kind %u with encoding %u is unknown",
                       section->channel_kind, section->encoding);
    if ((nth == 0) != (kind == LP_CHANNEL_ALBEDO))
        return lp_fail(err, LP_CORRUPT, name, "albedo must be the first channel and the only one");
    if (kind != LP_CHANNEL_RADIANCE && strcmp(name, lp_channel_kind_text(kind)) != 0)
        return lp_fail(err, LP_CORRUPT, name, "the channel of kind %s must bear its name",
                       lp_channel_kind_text(kind));
    if (section->bytes != node_count * lp_encoding_stride_bytes(encoding))
        return lp_fail(err, LP_CORRUPT, name,
                       "has %llu bytes, not one value for each of %llu nodes",
                       (unsigned long long)section->bytes, (unsigned long long)node_count);
    return LP_OK;
}

/* One entry: kinds, sizes, and that it begins where the one before ended. */
static enum lp_code check_entry(const struct file_header *header, const struct file_section *table,
                                uint32_t i, uint64_t *at, struct lp_error *err)
{
    const struct file_section *section = &table[i];
    uint32_t wide_levels = (header->depth + 1) / 2;
    uint64_t nodes = 0;
    for (uint32_t level = 0; level <= header->depth; level++)
        nodes += header->level_count[level];
    if (*at > header->file_bytes || section->offset != *at ||
        section->bytes > header->file_bytes - *at)
        return lp_fail(err, LP_CORRUPT, "section table",
                       "section %u lies at %llu with %llu bytes, "
                       "where %llu is due",
                       i, (unsigned long long)section->offset, (unsigned long long)section->bytes,
                       (unsigned long long)*at);
    if (!all_zero(section->zeros, sizeof section->zeros))
        return lp_fail(err, LP_CORRUPT, "section table", "section %u has bytes that must be zero",
                       i);
    *at = align_up(*at + section->bytes);
    if (i >= wide_levels) {
        if (section->kind != SECTION_CHANNEL || section->index != i - wide_levels)
            return lp_fail(err, LP_CORRUPT, "section table", "section %u is not channel %u", i,
                           i - wide_levels);
        return check_channel(section, i - wide_levels, nodes, err);
    }
    uint64_t due = 2 * i + 2 <= header->depth ? header->level_count[2 * i + 2] : 1;
    if (section->kind != SECTION_NODES || section->index != i || section->channel_kind != 0 ||
        section->encoding != 0 || !all_zero((const uint8_t *)section->name, NAME_ROOM) ||
        section->bytes != due * sizeof(struct lp_wide_node))
        return lp_fail(err, LP_CORRUPT, "section table",
                       "section %u does not hold the %llu nodes of wide level %u", i,
                       (unsigned long long)due, i);
    return LP_OK;
}

static enum lp_code check_table(const struct file_header *header, const struct file_section *table,
                                struct lp_error *err)
{
    uint32_t wide_levels = (header->depth + 1) / 2;
    uint32_t count = header->section_count;
    if (count <= wide_levels || count > wide_levels + LP_CHANNELS_MAX)
        return lp_fail(err, LP_CORRUPT, "section_count", "%u does not fit depth %u", count,
                       header->depth);
    uint64_t at = align_up(table_end(count));
    for (uint32_t i = 0; i < count; i++) {
        enum lp_code code = check_entry(header, table, i, &at, err);
        if (code != LP_OK)
            return code;
    }
    if (at != header->file_bytes)
        return lp_fail(err, LP_CORRUPT, "file_bytes", "the sections end at %llu, the file at %llu",
                       (unsigned long long)at, (unsigned long long)header->file_bytes);
    for (uint32_t i = wide_levels; i < count; i++)
        for (uint32_t j = wide_levels; j < i; j++)
            if (strncmp(table[i].name, table[j].name, NAME_ROOM) == 0)
                return lp_fail(err, LP_CORRUPT, "section table", "two channels are named %.100s",
                               table[i].name);
    return LP_OK;
}

/* Every byte of every section: checksums, and zeros between them. */
static enum lp_code check_content(const uint8_t *bytes, size_t byte_count,
                                  const struct file_header *header,
                                  const struct file_section *table, struct lp_error *err)
{
    for (uint32_t i = 0; i < header->section_count; i++) {
        uint64_t end = section_end(table, header->section_count, i, byte_count);
        char where[NAME_ROOM + 16];
        if (table[i].kind == SECTION_NODES)
            snprintf(where, sizeof where, "nodes of wide level %u", i);
        else
            snprintf(where, sizeof where, "channel %.100s", table[i].name);
        if (XXH3_64bits(bytes + table[i].offset, (size_t)(end - table[i].offset)) !=
            table[i].checksum)
            return lp_fail(err, LP_CORRUPT, where,
                           "bytes %llu to %llu are damaged: copy or build "
                           "the file again",
                           (unsigned long long)table[i].offset, (unsigned long long)end - 1);
        uint64_t used = table[i].offset + table[i].bytes;
        if (!all_zero(bytes + used, end - used))
            return lp_fail(err, LP_CORRUPT, where, "the padding behind it is not zero");
    }
    return LP_OK;
}

/* The voxels' box must be the true one: renderers and users rely on it. */
static enum lp_code check_bounds(const struct lp_scene *scene, struct lp_error *err)
{
    uint32_t low[3], high[3];
    lp_octree_bounds(low, high, &scene->tree);
    for (int a = 0; a < 3; a++)
        if (low[a] != scene->bounds_min_vox[a] || high[a] != scene->bounds_max_vox[a])
            return lp_fail(err, LP_CORRUPT, "bounds_vox",
                           "axis %d says %u to %u, the voxels fill %u to %u", a,
                           scene->bounds_min_vox[a], scene->bounds_max_vox[a], low[a], high[a]);
    return LP_OK;
}

enum lp_code lp_scene_view(struct lp_scene *scene, const void *bytes, size_t byte_count,
                           enum lp_trust trust, struct lp_error *err)
{
    const struct file_header *header = bytes;
    enum lp_code code = check_shape(bytes, byte_count, err);
    if (code != LP_OK)
        return code;
    const struct file_section *table =
        (const void *)((const uint8_t *)bytes + LP_SCENE_HEADER_BYTES);
    code = check_header(header, err);
    if (code == LP_OK)
        code = check_table(header, table, err);
    uint64_t end = table_end(header->section_count);
    if (code == LP_OK && !all_zero((const uint8_t *)bytes + end, table[0].offset - end))
        code = lp_fail(err, LP_CORRUPT, "section table", "the padding behind it is not zero");
    if (code == LP_OK && trust == LP_TRUST_NOTHING)
        code = check_content(bytes, byte_count, header, table, err);
    if (code != LP_OK)
        return code;
    struct lp_scene view;
    point_at(&view, bytes, header, table);
    if (trust == LP_TRUST_NOTHING) {
        code = lp_octree_check(&view.tree, err);
        if (code == LP_OK)
            code = check_bounds(&view, err);
        if (code != LP_OK)
            return code;
    }
    *scene = view;
    return LP_OK;
}
