/* Scene files on the disk: operators' files in, our own checked and immutable copies out.
 *
 *     DIR/scenes/NAME.lps           written by operators, at any time, in any way: never mapped
 *     DIR/resident/<sha256>.lps     our copy, mode 0444, whole and fully verified: mapped
 *     DIR/resident/verified         which operators' file had which hash, one a line
 *
 * A line of `verified` pairs the identity (device, inode, size, times) of an operator's file with
 * the identity and hash of its copy. While both files still are what they were, neither has to be
 * read again. Belongs to the scenes thread. */
#ifndef SCENE_STORE_H
#define SCENE_STORE_H

#include "engine/scene_file.h"
#include "protocol/wire.h"
#include "server/data_dir.h"

#include <stdatomic.h>

#define SCENE_STORE_MAX   1000 /* scenes */
#define SCENE_KEY_BYTES   72   /* <sha256>.lps */
#define SCENE_STORE_LINES (2 * SCENE_STORE_MAX)

/* Two files with the same identity have the same bytes (short of somebody turning clocks back). */
struct scene_identity {
    uint64_t dev, ino, bytes;
    int64_t mtime_ns, ctime_ns;
};
/* That of an open file; false: it cannot be asked. */
bool scene_identity_of(struct scene_identity *out, int fd);
bool scene_identity_equal(const struct scene_identity *a, const struct scene_identity *b);

struct scene_store;

/* Reads `verified`; a damaged line only costs its file a second verification. NULL: no memory.
 * `dir` and `stop` (makes long copies give up) must outlive it. */
struct scene_store *scene_store_create(const struct data_dir *dir, const atomic_bool *stop);
void scene_store_destroy(struct scene_store **store);

/* Opens DIR/scenes/FILE without following links and takes its identity. `*fd` is the caller's.
 * LP_INVALID: no regular file. LP_NOT_FOUND, LP_IO. */
LP_MUST_CHECK enum lp_code scene_store_source(const struct scene_store *store, int *fd,
                                              struct scene_identity *identity,
                                              const char *file_name, struct lp_error *err);
/* The hash that this very file is known to have, with its copy still in place; NULL: unknown. */
const char *scene_store_known(const struct scene_store *store,
                              const struct scene_identity *identity);
/* Copies and hashes the file behind `fd`, verifies the copy and opens it; remembers it.
 * LP_CANCELLED when stopped, LP_CORRUPT also when the file changed meanwhile. */
LP_MUST_CHECK enum lp_code scene_store_adopt(struct scene_store *store, struct lp_scene_file *file,
                                             char sha256[WIRE_SHA256_BYTES], int fd,
                                             const struct scene_identity *identity,
                                             struct lp_error *err);
/* Opens a known copy, trusting its content: microseconds. */
LP_MUST_CHECK enum lp_code scene_store_open(const struct scene_store *store,
                                            struct lp_scene_file *file, const char *sha256,
                                            struct lp_error *err);

/* Removes copies (and memories) that are not among `sha256s`, and what crashes left. */
void scene_store_sweep(struct scene_store *store, const char (*sha256s)[WIRE_SHA256_BYTES],
                       size_t count);
/* Writes `verified` if it changed. A failure costs time at the next start, no more. */
LP_MUST_CHECK enum lp_code scene_store_save(struct scene_store *store, struct lp_error *err);

#endif
