/* Tests of the sRGB tables against an independent computation. */
#include "engine/srgb.h"
#include "tests/harness/test.h"

#include <math.h>

static long double curve(long double encoded)
{
    if (encoded <= 0.04045L)
        return encoded / 12.92L;
    return powl((encoded + 0.055L) / 1.055L, 2.4L);
}

/* Within one unit in the last place of the true value. */
static void check_entry(float entry, long double truth, int index)
{
    float low = nextafterf((float)truth, -1.0f), high = nextafterf((float)truth, 2.0f);
    if (!(entry >= low && entry <= high))
        test_fail(__FILE__, __LINE__, "entry %d is %.9g, not %.9Lg", index, (double)entry, truth);
    /* Correct rounding, wherever long double can tell: no neighbour is nearer. */
    long double distance = fabsl((long double)entry - truth);
    long double slack = truth * 0x1p-55L;
    CHECK(distance <= fabsl((long double)nextafterf(entry, -1.0f) - truth) + slack);
    CHECK(distance <= fabsl((long double)nextafterf(entry, 2.0f) - truth) + slack);
}

TEST(srgb_tables_hold_the_true_curve)
{
    for (int i = 0; i < 256; i++) {
        check_entry(lp_srgb_to_linear[i], curve((long double)i / 255.0L), i);
        if (i > 0)
            check_entry(lp_srgb_threshold[i], curve(((long double)i - 0.5L) / 255.0L), i);
    }
    CHECK(lp_srgb_to_linear[0] == 0.0f);
    CHECK(lp_srgb_threshold[0] == 0.0f);
    CHECK(lp_srgb_to_linear[255] == 1.0f);
}

TEST(srgb_codes_survive_decoding_and_encoding)
{
    for (int i = 0; i < 256; i++)
        CHECK_EQ(lp_srgb_from_linear(lp_srgb_to_linear[i]), i);
}

TEST(srgb_code_changes_exactly_at_its_threshold)
{
    for (int i = 1; i < 256; i++) {
        float threshold = lp_srgb_threshold[i];
        CHECK_EQ(lp_srgb_from_linear(nextafterf(threshold, -1.0f)), i - 1);
        CHECK_EQ(lp_srgb_from_linear(threshold), i);
        CHECK_EQ(lp_srgb_from_linear(nextafterf(threshold, 2.0f)), i);
        CHECK(lp_srgb_threshold[i] > lp_srgb_threshold[i - 1]);
        CHECK(lp_srgb_to_linear[i - 1] < threshold && threshold < lp_srgb_to_linear[i]);
    }
}

TEST(srgb_never_falls_when_light_rises)
{
    test_random random = test_random_begin();
    for (int i = 0; i < 200000; i++) {
        float a = (float)test_random_unit(&random);
        float b = nextafterf(a, 2.0f);
        CHECK(lp_srgb_from_linear(a) <= lp_srgb_from_linear(b));
        /* The nearest code, by the curve itself (away from the thresholds' own rounding). */
        long double encoded = a <= 0.0031308f ? a * 12.92L : 1.055L * powl(a, 1.0L / 2.4L) - 0.055L;
        CHECK(fabsl(encoded * 255.0L - lp_srgb_from_linear(a)) <= 0.5001L);
    }
}

TEST(srgb_clips_and_takes_nan_as_black)
{
    CHECK_EQ(lp_srgb_from_linear(-1.0f), 0);
    CHECK_EQ(lp_srgb_from_linear(-0.0f), 0);
    CHECK_EQ(lp_srgb_from_linear(-INFINITY), 0);
    CHECK_EQ(lp_srgb_from_linear(NAN), 0);
    CHECK_EQ(lp_srgb_from_linear(-NAN), 0);
    CHECK_EQ(lp_srgb_from_linear(1.0f), 255);
    CHECK_EQ(lp_srgb_from_linear(50.0f), 255);
    CHECK_EQ(lp_srgb_from_linear(INFINITY), 255);
    CHECK_EQ(lp_srgb_from_linear(0x1p-149f), 0);
}
