/* What the client library's own files share; nobody else includes it. */
#ifndef LPC_PRIVATE_H
#define LPC_PRIVATE_H

#include "clients/c/lpc.h"

#include <stdio.h>

/* Records a failure and returns its code; the first failure is kept; `err` may be NULL. */
enum lpc_code lpc_fail(struct lpc_error *err, enum lpc_code code, const char *format, ...)
    __attribute__((format(printf, 3, 4)));

#define LPC_SERVER_BYTES 512

/* A server's address, taken apart. */
struct lpc_address {
    char base[LPC_SERVER_BYTES];      /* "http://host:port", no slash at the end */
    char unix_path[LPC_SERVER_BYTES]; /* of a socket; empty for TCP */
    char shown[LPC_SERVER_BYTES];     /* as people know it, for sentences */
    bool loopback;                    /* never through a proxy */
};
/* LPC_INVALID with a sentence that shows a right address. Thread: any. */
LPC_MUST_CHECK enum lpc_code lpc_address_read(struct lpc_address *address, const char *server,
                                              struct lpc_error *err);

/* A file that appears only when it is whole. */
struct lpc_file {
    FILE *stream; /* of the temporary file */
    char path[LPC_PATH_BYTES];
    char temporary[LPC_PATH_BYTES + 32];
};
LPC_MUST_CHECK enum lpc_code lpc_file_create(struct lpc_file *file, const char *path,
                                             struct lpc_error *err);
/* Flushes, closes and renames; on failure the temporary file is gone. */
LPC_MUST_CHECK enum lpc_code lpc_file_keep(struct lpc_file *file, struct lpc_error *err);
/* Removes the temporary file; accepts a kept or zeroed one. */
void lpc_file_drop(struct lpc_file *file);

#endif
