/* SHA-256 of bytes: names of scenes, films and results. The one face of the hashing library. */
#ifndef LP_SHA256_H
#define LP_SHA256_H

#include <stddef.h>
#include <stdint.h>

#define LP_SHA256_BYTES 32

/* Hashes `bytes` of `data` into `out`. Thread: any. */
void lp_sha256(uint8_t out[LP_SHA256_BYTES], const void *data, size_t bytes);

/* The same in pieces. begin, update as often as wanted, end. */
struct lp_sha256_state {
    _Alignas(16) unsigned char opaque[256];
};
void lp_sha256_begin(struct lp_sha256_state *state);
void lp_sha256_update(struct lp_sha256_state *state, const void *data, size_t bytes);
void lp_sha256_end(struct lp_sha256_state *state, uint8_t out[LP_SHA256_BYTES]);

#endif
