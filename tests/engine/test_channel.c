/* Tests of channel names, encodings and the shared-exponent colours. */
#include "engine/channel.h"
#include "engine/srgb.h"
#include "tests/harness/test.h"

#include <math.h>
#include <string.h>

/* The encoding in the specification's own words (EXT_texture_shared_exponent), with libm. */
static uint32_t encode_as_specified(const float rgb[3])
{
    double clamped[3];
    for (int c = 0; c < 3; c++)
        clamped[c] = isnan(rgb[c]) ? 0.0 : fmax(0.0, fmin(65408.0, (double)rgb[c]));
    double largest = fmax(clamped[0], fmax(clamped[1], clamped[2]));
    int exponent = 0;
    if (largest > 0.0)
        exponent = (int)fmax(-16.0, floor(log2(largest))) + 16;
    if (floor(largest / exp2(exponent - 24) + 0.5) == 512.0)
        exponent++;
    uint32_t packed = (uint32_t)exponent << 27;
    for (int c = 0; c < 3; c++)
        packed |= (uint32_t)floor(clamped[c] / exp2(exponent - 24) + 0.5) << (9 * c);
    return packed;
}

static void check_encoding(float r, float g, float b)
{
    float rgb[3] = {r, g, b};
    uint32_t packed = lp_rgb9e5_encode(rgb), wanted = encode_as_specified(rgb);
    if (packed != wanted)
        test_fail(__FILE__, __LINE__, "(%a, %a, %a) is %08x, not %08x", (double)r, (double)g,
                  (double)b, packed, wanted);
}

TEST(rgb9e5_encodes_as_specified)
{
    test_random random = test_random_begin();
    for (int i = 0; i < 300000; i++) {
        float rgb[3];
        for (int c = 0; c < 3; c++) {
            uint32_t bits = (uint32_t)test_random_u64(&random);
            if (test_random_below(&random, 4) > 0) /* mostly within the range */
                bits = (bits & 0x007fffffu) | (100 + test_random_below(&random, 45)) << 23;
            memcpy(&rgb[c], &bits, sizeof bits);
        }
        check_encoding(rgb[0], rgb[1], rgb[2]);
    }
}

TEST(rgb9e5_rounds_up_into_the_exponent)
{
    for (int e = -30; e <= 15; e++) {
        float power = (float)exp2(e);
        float edge = power * 511.5f / 512.0f; /* rounds to the power itself */
        check_encoding(edge, 0.0f, 0.0f);
        check_encoding(nextafterf(edge, 0.0f), power / 3.0f, edge);
        check_encoding(nextafterf(edge, 1e9f), power / 7.0f, 0.0f);
        check_encoding(nextafterf(power, 0.0f), nextafterf(power, 0.0f), power / 1024.0f);
        check_encoding(power, nextafterf(power / 512.0f, 0.0f), power / 513.0f);
    }
}

TEST(rgb9e5_gives_every_code_back)
{
    for (uint32_t exponent = 0; exponent < 32; exponent++)
        for (uint32_t mantissa = 0; mantissa < 512; mantissa++) {
            uint32_t packed =
                mantissa | (511 - mantissa) << 9 | (mantissa / 2) << 18 | exponent << 27;
            float rgb[3], again[3];
            lp_rgb9e5_decode(rgb, packed);
            CHECK((double)rgb[0] == ldexp(mantissa, (int)exponent - 24));
            CHECK((double)rgb[1] == ldexp(511 - mantissa, (int)exponent - 24));
            CHECK((double)rgb[2] == ldexp(mantissa / 2, (int)exponent - 24));
            lp_rgb9e5_decode(again, lp_rgb9e5_encode(rgb));
            CHECK(memcmp(rgb, again, sizeof rgb) == 0);
        }
}

TEST(rgb9e5_clamps)
{
    float rgb[3] = {NAN, -5.0f, -INFINITY}, out[3];
    lp_rgb9e5_decode(out, lp_rgb9e5_encode(rgb));
    CHECK(out[0] == 0.0f && out[1] == 0.0f && out[2] == 0.0f);
    float bright[3] = {INFINITY, 65408.0f, 1e30f};
    lp_rgb9e5_decode(out, lp_rgb9e5_encode(bright));
    CHECK(out[0] == 65408.0f && out[1] == 65408.0f && out[2] == 65408.0f);
    float tiny[3] = {0x1p-149f, 0x1p-25f, 0x1p-26f};
    lp_rgb9e5_decode(out, lp_rgb9e5_encode(tiny));
    CHECK(out[0] == 0.0f && out[1] == 0x1p-24f && out[2] == 0.0f);
}

TEST(rgb9e5_keeps_a_strong_light_exactly)
{
    const float values[] = {50.0f, 1.0f, 0.5f, 255.0f, 1024.0f, 50.5f, 32768.0f};
    for (size_t i = 0; i < sizeof values / sizeof values[0]; i++) {
        float rgb[3] = {values[i], values[i], values[i] / 2.0f}, out[3];
        lp_rgb9e5_decode(out, lp_rgb9e5_encode(rgb));
        CHECK(memcmp(rgb, out, sizeof rgb) == 0);
    }
}

TEST(channel_reads_colours_at_their_place)
{
    const uint8_t srgb[] = {0, 0, 0, 10, 128, 255};
    struct lp_channel channel = {LP_CHANNEL_ALBEDO, LP_ENCODING_SRGB8, 3, "albedo", srgb};
    float rgb[3];
    lp_channel_rgb(rgb, &channel, 1);
    CHECK(rgb[0] == lp_srgb_to_linear[10] && rgb[1] == lp_srgb_to_linear[128] && rgb[2] == 1.0f);

    const float light[3] = {50.0f, 3.0f, 0.25f};
    uint32_t packed = lp_rgb9e5_encode(light);
    uint8_t bytes[8] = {0};
    for (int i = 0; i < 4; i++)
        bytes[4 + i] = (uint8_t)(packed >> (8 * i));
    channel = (struct lp_channel){LP_CHANNEL_RADIANCE, LP_ENCODING_RGB9E5, 4, "noon", bytes};
    lp_channel_rgb(rgb, &channel, 1);
    CHECK(memcmp(rgb, light, sizeof rgb) == 0);
    lp_channel_rgb(rgb, &channel, 0);
    CHECK(rgb[0] == 0.0f && rgb[1] == 0.0f && rgb[2] == 0.0f);
}

TEST(channel_kinds_know_their_encoding)
{
    CHECK_EQ(lp_channel_encoding(LP_CHANNEL_ALBEDO), LP_ENCODING_SRGB8);
    CHECK_EQ(lp_channel_encoding(LP_CHANNEL_RADIANCE), LP_ENCODING_RGB9E5);
    CHECK_EQ(lp_channel_encoding(LP_CHANNEL_EMISSION), LP_ENCODING_RGB9E5);
    CHECK_EQ(lp_channel_encoding(LP_CHANNEL_NORMAL), LP_ENCODING_OCT16);
    CHECK_EQ(lp_channel_encoding((enum lp_channel_kind)77), 0);
    CHECK_EQ(lp_encoding_stride_bytes(LP_ENCODING_SRGB8), 3);
    CHECK_EQ(lp_encoding_stride_bytes(LP_ENCODING_RGB9E5), 4);
    CHECK_EQ(lp_encoding_stride_bytes(LP_ENCODING_OCT16), 2);
    CHECK_EQ(lp_encoding_stride_bytes((enum lp_encoding)77), 0);
    CHECK_STR(lp_channel_kind_text(LP_CHANNEL_ALBEDO), "albedo");
    CHECK_STR(lp_channel_kind_text(LP_CHANNEL_RADIANCE), "radiance");
    CHECK_STR(lp_channel_kind_text(LP_CHANNEL_EMISSION), "emission");
    CHECK_STR(lp_channel_kind_text(LP_CHANNEL_NORMAL), "normal");
    CHECK_STR(lp_channel_kind_text((enum lp_channel_kind)0), "unknown");
}

TEST(names_are_what_the_wire_allows)
{
    char longest[102];
    memset(longest, 'a', sizeof longest);
    longest[100] = '\0';
    CHECK(lp_name_ok(longest));
    longest[100] = 'a';
    longest[101] = '\0';
    CHECK(!lp_name_ok(longest));
    const char *const good[] = {"a", "0", "Noon_2.sun-3", "A..", "a--"};
    for (size_t i = 0; i < sizeof good / sizeof good[0]; i++)
        CHECK(lp_name_ok(good[i]));
    const char *const bad[] = {"", ".a", "_a", "-a", "a/b", "a b", "\xc3\xa4", "a\n", "..", "a:b"};
    for (size_t i = 0; i < sizeof bad / sizeof bad[0]; i++)
        CHECK(!lp_name_ok(bad[i]));
    CHECK(!lp_name_ok(NULL));
}
