/* SHA-256 through nettle. */
#include "engine/sha256.h"

#include <nettle/sha2.h>
#include <string.h>

_Static_assert(sizeof(struct sha256_ctx) <= sizeof(struct lp_sha256_state), "room for the state");

static struct sha256_ctx *context(struct lp_sha256_state *state)
{
    return (struct sha256_ctx *)(void *)state->opaque;
}

void lp_sha256_begin(struct lp_sha256_state *state)
{
    sha256_init(context(state));
}

void lp_sha256_update(struct lp_sha256_state *state, const void *data, size_t bytes)
{
    sha256_update(context(state), bytes, data);
}

void lp_sha256_end(struct lp_sha256_state *state, uint8_t out[LP_SHA256_BYTES])
{
    sha256_digest(context(state), LP_SHA256_BYTES, out);
}

void lp_sha256(uint8_t out[LP_SHA256_BYTES], const void *data, size_t bytes)
{
    struct lp_sha256_state state;
    lp_sha256_begin(&state);
    lp_sha256_update(&state, data, bytes);
    lp_sha256_end(&state, out);
}
