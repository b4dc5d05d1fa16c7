/* Result files: content-addressed, counted, bounded; nothing is accepted that cannot be kept.
 *
 *     DIR/results/<sha256>.<png|exr|json>
 *
 * A file exists while somebody refers to it. Space is reserved before a job is accepted and
 * settled when its files are written (in between they count twice, never not at all). Doomed files
 * do not count against a reservation, but one that stands in the way of the limit is unlinked
 * before the next file is written: the files never take more than the limit. A file's states:
 *
 *     (absent) --put--> WRITING --ok--> THERE --last release--> DOOMED --sweep--> UNLINKING -->
 * (absent)
 *                                         ^-----------put-----------'
 *
 * Results of synchronous calls do not outlive the process (the index is in memory, and the folder
 * is emptied at start), so files are not forced to the disk. */
#ifndef RESULTS_H
#define RESULTS_H

#include "protocol/wire.h"
#include "engine/base.h"

#define RESULTS_KEY_BYTES   72   /* sha256, dot, extension, NUL */
#define RESULTS_BLOCK_BYTES 4096 /* what a file is rounded up to, as on the disk */

struct results; /* owns the table of files; thread-safe */

/* Removes what an earlier run left. `folder_fd` stays the caller's. LP_IO, LP_NO_MEMORY. */
LP_MUST_CHECK enum lp_code results_create(struct results **out, int folder_fd, uint64_t limit_bytes,
                                          struct lp_error *err);
/* Removes all files, too. Accepts NULL and sets it. No other thread may use it any more. */
void results_destroy(struct results **results);

/* Sets space aside for files yet to come; false: not that much is left. Thread: any. */
bool results_reserve(struct results *results, uint64_t bytes);
/* Gives a reservation back; what was written meanwhile counts by itself. Thread: any. */
void results_settle(struct results *results, uint64_t bytes);

/* Keeps `data` as <sha256>.<extension> and refers to it once; `key` names it from then on.
 * LP_NO_SPACE, LP_IO, LP_NO_MEMORY: nothing is kept. Blocks for the disk. Thread: worker. */
LP_MUST_CHECK enum lp_code results_put(struct results *results, char key[RESULTS_KEY_BYTES],
                                       const char *sha256, const char *extension, const void *data,
                                       size_t bytes, struct lp_error *err);
/* Drops one reference. Returns whether results_sweep has something to do. Thread: any. */
bool results_drop(struct results *results, const char *key);
/* Unlinks the files nobody refers to. Blocks for the disk. Thread: any but the loop. */
void results_sweep(struct results *results);

/* A descriptor of a file that the caller refers to, and its size; -1: it cannot be read.
 * Thread: any. */
int results_open(const struct results *results, const char *key, uint64_t *bytes);

struct results_usage {
    uint64_t files, used_bytes; /* on the disk, doomed ones too */
    uint64_t reserved_bytes, limit_bytes;
};
struct results_usage results_usage(struct results *results);

#endif
