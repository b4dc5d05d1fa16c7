/* Inside the client library: a transfer whose body may go into a file. */
#ifndef LPC_HTTP_H
#define LPC_HTTP_H

#include "clients/c/lpc_private.h"

#include <nettle/sha2.h>

/* Where the body of a 200 goes; any other body goes into the answer. */
struct lpc_file_sink {
    struct lpc_file *file;
    struct sha256_ctx sha256;
    uint64_t bytes;
    int write_errno;
};

/* lpc_send, with `sink` NULL for an answer in memory. */
LPC_MUST_CHECK enum lpc_code lpc_transfer(struct lpc_client *client, struct lpc_answer *answer,
                                          struct lpc_file_sink *sink,
                                          const struct lpc_request *request, struct lpc_error *err);

/* LPC_REFUSED with the sentence of the problem document that came instead of the wanted answer. */
enum lpc_code lpc_refused(struct lpc_client *client, const struct lpc_answer *answer,
                          const char *path, struct lpc_error *err);

/* The server's address as people know it. */
const char *lpc_server_shown(const struct lpc_client *client);

#endif
