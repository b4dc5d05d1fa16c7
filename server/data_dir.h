/* The daemon's folder: its parts, its lock, and files that are whole or absent. */
#ifndef DATA_DIR_H
#define DATA_DIR_H

#include "engine/base.h"

#define DATA_DIR_PATH_BYTES 1200

/* Descriptors stay open for the life of the process; everything below is opened beneath them. */
struct data_dir {
    int lock_fd;                    /* DIR/lock, locked */
    int scenes_fd;                  /* DIR/scenes: the operator's files */
    int resident_fd;                /* DIR/resident: our checked copies */
    int results_fd;                 /* DIR/results */
    char path[DATA_DIR_PATH_BYTES]; /* absolute */
};

/* Creates what is missing and takes the lock. A folder that another daemon holds is
 * LP_INVALID; LP_IO, LP_NO_SPACE.
 * Thread: main. */
LP_MUST_CHECK enum lp_code data_dir_open(struct data_dir *out, const char *path,
                                         struct lp_error *err);
/* Gives the lock back; accepts a zeroed one. */
void data_dir_close(struct data_dir *dir);

enum data_sync {
    DATA_SYNC_NONE, /* need not outlive the process */
    DATA_SYNC_DISK  /* file and folder are on the disk when it returns */
};

/* Writes NAME beneath `folder_fd` through a temporary file and a rename, mode 0444. On failure
 * nothing is left. LP_NO_SPACE, LP_IO. Thread: any. */
LP_MUST_CHECK enum lp_code data_file_write(int folder_fd, const char *name, const void *data,
                                           size_t bytes, enum data_sync sync, struct lp_error *err);

/* The error that the `errno` of a write means. */
enum lp_code data_fail_errno(struct lp_error *err, const char *where, const char *what, int number);

/* A name for a temporary file, ".tmp-..." : never a scene's or a result's. */
#define DATA_TEMP_PREFIX ".tmp-"
#define DATA_TEMP_BYTES  48
void data_temp_name(char out[DATA_TEMP_BYTES]);

#endif
