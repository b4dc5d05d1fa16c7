/* Typed channels: what a node of the tree knows beside its place, and how it is stored. */
#ifndef LP_CHANNEL_H
#define LP_CHANNEL_H

#include "engine/base.h"

#define LP_NAME_BYTES   101 /* a name has 1..100 characters of [A-Za-z0-9._-], the first no sign */
#define LP_CHANNELS_MAX 32

/* What a channel means. Values are file format: never renumbered. */
enum lp_channel_kind {
    LP_CHANNEL_ALBEDO = 1,   /* diffuse reflectance; exactly one, named "albedo" */
    LP_CHANNEL_RADIANCE = 2, /* outgoing radiance under one lighting; any number, by name */
    LP_CHANNEL_EMISSION = 3, /* emitted radiance; at most one, named "emission" */
    LP_CHANNEL_NORMAL = 4,   /* surface normal; at most one, named "normal" */
};

/* How a value is stored. Values are file format: never renumbered. */
enum lp_encoding {
    LP_ENCODING_SRGB8 = 1,  /* 3 bytes R G B, sRGB-encoded: linear 0..1 */
    LP_ENCODING_RGB9E5 = 2, /* 4 bytes little-endian, shared exponent: linear 0..65408 */
    LP_ENCODING_OCT16 = 3,  /* 2 bytes, octahedral direction, 8 bits an axis */
};

struct lp_channel {
    enum lp_channel_kind kind;
    enum lp_encoding encoding;
    uint32_t stride_bytes;    /* of one value: 3, 4, 2 */
    char name[LP_NAME_BYTES]; /* the lighting's name: `albedo`, `noon` */
    const uint8_t *values;    /* one per node, in the order of lp_octree_attribute */
};

/* Bytes of one value, 0 for an unknown encoding. */
uint32_t lp_encoding_stride_bytes(enum lp_encoding encoding);
/* The only encoding a kind uses in this version; 0 for an unknown kind. */
enum lp_encoding lp_channel_encoding(enum lp_channel_kind kind);
/* "albedo", "radiance", "emission", "normal"; "unknown" otherwise. */
const char *lp_channel_kind_text(enum lp_channel_kind kind);

/* Whether `name` is a name as the wire has it: [A-Za-z0-9][A-Za-z0-9._-]{0,99}. */
bool lp_name_ok(const char *name);

/* RGB9E5 (EXT_texture_shared_exponent): nearest value, components clamped to 0..65408; NaN gives 0.
 * A value whose components are multiples of 1/256 of its largest power of two survives exactly. */
uint32_t lp_rgb9e5_encode(const float rgb_lin[3]);
void lp_rgb9e5_decode(float rgb_lin[3], uint32_t packed);

/* The linear colour of one value (SRGB8 or RGB9E5). Thread: any. */
void lp_channel_rgb(float rgb_lin[3], const struct lp_channel *channel, uint64_t attribute);

#endif
