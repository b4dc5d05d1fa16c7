/* Channels: names, encodings, and colours as they are stored. */
#include "engine/channel.h"

#include "engine/srgb.h"

#include <string.h>

uint32_t lp_encoding_stride_bytes(enum lp_encoding encoding)
{
    switch (encoding) {
    case LP_ENCODING_SRGB8:
        return 3;
    case LP_ENCODING_RGB9E5:
        return 4;
    case LP_ENCODING_OCT16:
        return 2;
    }
    return 0;
}

enum lp_encoding lp_channel_encoding(enum lp_channel_kind kind)
{
    switch (kind) {
    case LP_CHANNEL_ALBEDO:
        return LP_ENCODING_SRGB8;
    case LP_CHANNEL_RADIANCE:
    case LP_CHANNEL_EMISSION:
        return LP_ENCODING_RGB9E5;
    case LP_CHANNEL_NORMAL:
        return LP_ENCODING_OCT16;
    }
    return (enum lp_encoding)0;
}

const char *lp_channel_kind_text(enum lp_channel_kind kind)
{
    switch (kind) {
    case LP_CHANNEL_ALBEDO:
        return "albedo";
    case LP_CHANNEL_RADIANCE:
        return "radiance";
    case LP_CHANNEL_EMISSION:
        return "emission";
    case LP_CHANNEL_NORMAL:
        return "normal";
    }
    return "unknown";
}

static bool is_letter_or_digit(char c)
{
    return (c >= 'A' && c <= 'Z') || (c >= 'a' && c <= 'z') || (c >= '0' && c <= '9');
}

bool lp_name_ok(const char *name)
{
    if (!name || !is_letter_or_digit(name[0]))
        return false;
    for (size_t i = 1; i < LP_NAME_BYTES; i++) {
        if (name[i] == '\0')
            return true;
        if (!is_letter_or_digit(name[i]) && name[i] != '.' && name[i] != '_' && name[i] != '-')
            return false;
    }
    return false;
}

/* RGB9E5, in the terms of EXT_texture_shared_exponent: N = 9 mantissa bits, exponent bias B = 15,
 * a component is mantissa * 2^(exponent - B - N). All of it is done on the bits of the floats, so
 * that neither compiler nor rounding mode has a say. */
#define E5_MANTISSA_BITS 9
#define E5_MANTISSA_MAX  0x1ffu
#define E5_BIAS          15
#define F32_BIAS         127
#define F32_ONE          0x00800000u /* the bit above the 23 stored ones */
#define F32_INFINITY     0x7f800000u
#define E5_LARGEST_BITS  0x477f8000u /* 65408.0f = 511/512 * 2^16 */

static uint32_t f32_bits(float value)
{
    uint32_t bits;
    memcpy(&bits, &value, sizeof bits);
    return bits;
}

/* Bits of a component clamped to 0..65408. Non-negative floats sort like their bits. */
static uint32_t clamped_bits(float value)
{
    uint32_t bits = f32_bits(value);
    if (bits > F32_INFINITY) /* NaN, or the sign bit is set */
        return 0;
    return bits > E5_LARGEST_BITS ? E5_LARGEST_BITS : bits;
}

/* floor(component / 2^(exponent - B - N) + 0.5) for the bits of a clamped component. */
static uint32_t e5_mantissa(uint32_t bits, uint32_t exponent)
{
    uint32_t stored = bits >> 23;
    uint32_t value = bits & (F32_ONE - 1); /* component = value * 2^(stored - 150) */
    if (stored == 0)
        stored = 1;
    else
        value |= F32_ONE;
    /* `exponent` is never below the component's own, so the shift is at least 15. */
    uint32_t shift = F32_BIAS - 1 + exponent - stored;
    return shift > 24 ? 0 : (value + (1u << (shift - 1))) >> shift;
}

uint32_t lp_rgb9e5_encode(const float rgb_lin[3])
{
    uint32_t bits[3], largest = 0;
    for (int c = 0; c < 3; c++) {
        bits[c] = clamped_bits(rgb_lin[c]);
        if (bits[c] > largest)
            largest = bits[c];
    }
    /* exponent = max(-B - 1, floor(log2(largest))) + 1 + B */
    const uint32_t lowest = F32_BIAS - E5_BIAS - 1;
    uint32_t stored = largest >> 23;
    uint32_t exponent = stored > lowest ? stored - lowest : 0;
    if (e5_mantissa(largest, exponent) > E5_MANTISSA_MAX)
        exponent++; /* the largest rounds up to the next power of two */
    return e5_mantissa(bits[0], exponent) | e5_mantissa(bits[1], exponent) << E5_MANTISSA_BITS |
           e5_mantissa(bits[2], exponent) << (2 * E5_MANTISSA_BITS) |
           exponent << (3 * E5_MANTISSA_BITS);
}

void lp_rgb9e5_decode(float rgb_lin[3], uint32_t packed)
{
    uint32_t exponent = packed >> (3 * E5_MANTISSA_BITS);
    uint32_t scale_bits = (F32_BIAS + exponent - E5_BIAS - E5_MANTISSA_BITS) << 23;
    float scale;
    memcpy(&scale, &scale_bits, sizeof scale);
    for (int c = 0; c < 3; c++) /* nine bits times a power of two: exact */
        rgb_lin[c] = (float)(packed >> (c * E5_MANTISSA_BITS) & E5_MANTISSA_MAX) * scale;
}

void lp_channel_rgb(float rgb_lin[3], const struct lp_channel *channel, uint64_t attribute)
{
    const uint8_t *value = channel->values + attribute * channel->stride_bytes;
    if (channel->encoding == LP_ENCODING_SRGB8) {
        for (int c = 0; c < 3; c++)
            rgb_lin[c] = lp_srgb_to_linear[value[c]];
    } else if (channel->encoding == LP_ENCODING_RGB9E5) {
        lp_rgb9e5_decode(rgb_lin, (uint32_t)value[0] | (uint32_t)value[1] << 8 |
                                      (uint32_t)value[2] << 16 | (uint32_t)value[3] << 24);
    } else {
        rgb_lin[0] = rgb_lin[1] = rgb_lin[2] = 0.0f; /* a direction has no colour */
    }
}
