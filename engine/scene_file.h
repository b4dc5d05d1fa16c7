/* The scene file `.lps`, version 1: a scene's memory as it lies on disk.
 *
 * Little-endian, offsets only, written once and never changed; the reader maps it read-only.
 *
 *      0  header, 512 bytes (struct in scene_file.c; drawn here)
 *           0  magic      89 4C 50 53 0D 0A 1A 0A   ("\x89LPS\r\n\x1a\n": shows text-mode damage)
 *           8  u32 version = 1          12  u32 header_bytes = 512
 *          16  u64 file_bytes           24  u64 checksum of header and section table
 *          32  u32 depth                36  u32 filter (1 visible, 2 mean)
 *          40  f64 voxel_size_m         48  f64 origin_m[3]
 *          72  u32 bounds_min_vox[3]    84  u32 bounds_max_vox[3]
 *          96  f64 suggested_probe_m[3]
 *         120  u32 section_count       124  u32 0
 *         128  u32 level_count[19]     (nodes of level 0..18, 0 above depth)
 *         204  zeros up to 512
 *    512  section table, section_count entries of 160 bytes
 *           0  u32 kind (1 nodes, 2 channel)        4  u32 index (nodes: wide level, 0 finest)
 *           8  u32 channel kind (enum)             12  u32 encoding (enum)
 *          16  u64 offset, a multiple of 64        24  u64 bytes
 *          32  u64 checksum of [offset, next section's offset or the file's end)
 *          40  char name[104], zero-filled        144  zeros
 *      .  zeros up to a multiple of 64
 *      .  sections, in the table's order: nodes of the finest wide level first, then coarser ones,
 *         then channels (albedo first); each followed by zeros up to a multiple of 64
 *
 * A section of nodes is an array of lp_wide_node; a channel's is one value per node of the whole
 * tree, coarsest level first. Checksums are XXH3-64 (the one of the header is taken with its own
 * field as zero); together they cover every byte. Unknown versions, kinds and encodings are
 * refused; a new kind of section raises the version.
 *
 * Changing the format: raise LP_SCENE_VERSION, keep reading the old one, add a fixture to
 * tests/engine and the reason to engine/README.md, all in one commit. */
#ifndef LP_SCENE_FILE_H
#define LP_SCENE_FILE_H

#include "engine/scene.h"

#define LP_SCENE_VERSION      1
#define LP_SCENE_HEADER_BYTES 512
#define LP_SCENE_ALIGN        64

/* How far an opened file is trusted. */
enum lp_trust {
    LP_TRUST_NOTHING, /* read every byte: checksums, then the tree's invariants */
    LP_TRUST_CONTENT  /* this very file was verified before: header and section table only */
};

/* An open scene. */
struct lp_scene_file {
    struct lp_scene scene; /* views into `map` */
    const void *map;       /* read-only, `bytes` long */
    size_t bytes;
};

/* Maps `path` and checks it. LP_NOT_FOUND, LP_IO: cannot be read. LP_CORRUPT / LP_UNSUPPORTED: one
 * sentence that names the defect and its place. `*file` is untouched on failure. With
 * LP_TRUST_CONTENT it costs microseconds. The file must not be changed in place while it is open.
 * Thread: any. */
LP_MUST_CHECK enum lp_code lp_scene_file_open(struct lp_scene_file *file, const char *path,
                                              enum lp_trust trust, struct lp_error *err);

/* Unmaps; accepts a zeroed one and zeroes it. */
void lp_scene_file_close(struct lp_scene_file *file);

/* The same over bytes in memory (64-byte aligned), which stay the caller's. */
LP_MUST_CHECK enum lp_code lp_scene_view(struct lp_scene *scene, const void *bytes,
                                         size_t byte_count, enum lp_trust trust,
                                         struct lp_error *err);

/* Writes a file that is whole or absent: a temporary file beside it, fsync, rename, fsync of the
 * folder. Replaces an older one. LP_IO, LP_NO_SPACE. */
LP_MUST_CHECK enum lp_code lp_scene_file_write(const char *path, const void *bytes,
                                               size_t byte_count, struct lp_error *err);

/* What decides the size of a new file: its levels and channels. */
struct lp_scene_layout {
    uint8_t depth;
    uint32_t level_count[LP_LEVEL_COUNT_MAX];
    uint32_t wide_count[LP_WIDE_LEVELS_MAX];
    uint32_t channel_count;
    struct lp_channel channels[LP_CHANNELS_MAX]; /* kind, encoding, stride, name; values ignored */
};

/* Size of the file that holds such a tree. LP_LIMIT when it cannot be counted in size_t. */
LP_MUST_CHECK enum lp_code
lp_scene_layout_bytes(size_t *bytes, const struct lp_scene_layout *layout, struct lp_error *err);

/* Lays a new file over zeroed, 64-byte aligned memory of that size: writes header and section
 * table without checksums and points `scene` at the empty sections, which the caller then fills
 * (casting const away: it owns the memory). Set filter, sizes and bounds in `*scene` and call
 * lp_scene_seal to finish. */
void lp_scene_lay_out(struct lp_scene *scene, void *bytes, size_t byte_count,
                      const struct lp_scene_layout *layout);

/* Writes the rest of the header from `scene` and all checksums. */
void lp_scene_seal(void *bytes, size_t byte_count, const struct lp_scene *scene);

#endif
