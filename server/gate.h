/* The first look at a request's head: what smuggles, what is too large, what comes from elsewhere.
 *
 * libmicrohttpd lets some ambiguous requests through; this gate sees every header before anything
 * else happens. */
#ifndef GATE_H
#define GATE_H

#include "protocol/wire.h"
#include "server/address.h"

#define GATE_TARGET_BYTES_MAX 4096
#define GATE_HEADER_BYTES_MAX 16384

/* What the head says. All zero to begin with; filled by gate_header, the rest by the caller. */
struct gate {
    size_t target_bytes; /* as sent, undecoded */
    bool target_is_odd;  /* it holds a space, a NUL, or "%00": readers would cut it differently */
    const char *path;    /* decoded */
    const char *version; /* "HTTP/1.1" */
    size_t header_bytes;
    unsigned host_count, origin_count, length_count, encoding_count;
    bool bad_name;         /* a field name that is no token, "Content-Length " say */
    bool lengths_differ;   /* or are no numbers */
    bool encoding_foreign; /* a transfer coding other than chunked */
    uint64_t content_length;
    const char *host, *origin; /* the first ones */
};

/* Takes in one header field. `value` may be NULL and must live as long as the gate. */
void gate_header(struct gate *gate, const char *name, const char *value);

/* Whether a body follows the head. */
bool gate_has_body(const struct gate *gate);

/* Returns 0 and leaves `*problem` alone, or the HTTP status with `*problem` set. */
int gate_check(const struct gate *gate, const struct address *own, struct wire_problem *problem);

#endif
