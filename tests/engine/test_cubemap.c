/* The cubemap table, by its published numbers and by its geometry. */
#include "engine/cubemap.h"
#include "tests/harness/test.h"

#include <math.h>

TEST(the_published_check_holds)
{
    lp_vec3 d = lp_cubemap_direction(LP_FACE_POS_X, 0, 0, 2);
    CHECK_NEAR(d.x, 0.816497, 1e-6);
    CHECK_NEAR(d.y, 0.408248, 1e-6);
    CHECK_NEAR(d.z, 0.408248, 1e-6);
}

/* Right and up of every face, from the conventions' table. */
TEST(columns_grow_to_the_right_and_rows_down)
{
    static const struct {
        float ahead[3], right[3], up[3];
    } table[6] = {
        {{1, 0, 0}, {0, 0, -1}, {0, 1, 0}}, {{-1, 0, 0}, {0, 0, 1}, {0, 1, 0}},
        {{0, 1, 0}, {1, 0, 0}, {0, 0, -1}}, {{0, -1, 0}, {1, 0, 0}, {0, 0, 1}},
        {{0, 0, 1}, {1, 0, 0}, {0, 1, 0}},  {{0, 0, -1}, {-1, 0, 0}, {0, 1, 0}},
    };
    for (int face = 0; face < 6; face++)
        for (uint32_t y = 0; y < 7; y++)
            for (uint32_t x = 0; x < 7; x++) {
                lp_vec3 d = lp_cubemap_direction((enum lp_face)face, x, y, 7);
                float right = 2 * ((float)x + 0.5f) / 7 - 1, up = 1 - 2 * ((float)y + 0.5f) / 7;
                float p[3], length = 0, got[3] = {d.x, d.y, d.z};
                for (int a = 0; a < 3; a++) {
                    p[a] = table[face].ahead[a] + right * table[face].right[a] +
                           up * table[face].up[a];
                    length += p[a] * p[a];
                }
                for (int a = 0; a < 3; a++)
                    CHECK_NEAR(got[a], p[a] / sqrtf(length), 1e-6);
            }
}

TEST(directions_have_unit_length_and_lead_back_to_their_texel)
{
    static const uint32_t sizes[] = {1, 2, 3, 64, 255, 4096, 4096 * 32};
    test_random r = test_random_begin();
    for (int i = 0; i < 200000; i++) {
        uint32_t n = sizes[i % 7];
        enum lp_face face = (enum lp_face)test_random_below(&r, 6), back;
        uint32_t x = test_random_below(&r, n), y = test_random_below(&r, n), bx, by;
        lp_vec3 d = lp_cubemap_direction(face, x, y, n);
        double x2 = (double)d.x * (double)d.x, y2 = (double)d.y * (double)d.y;
        CHECK_NEAR(x2 + y2 + (double)d.z * (double)d.z, 1, 3e-7); /* 5 roundings of 2^-24 */
        lp_cubemap_texel(&back, &bx, &by, d, n);
        CHECK(back == face && bx == x && by == y);
    }
}

/* The texel's point on its face is exact up to one rounding, so mirror images are exact. */
TEST(opposite_texels_are_exact_mirror_images)
{
    for (uint32_t n = 1; n <= 65; n++)
        for (uint32_t x = 0; x < n; x++) {
            lp_vec3 a = lp_cubemap_direction(LP_FACE_POS_Z, x, 0, n);
            lp_vec3 b = lp_cubemap_direction(LP_FACE_POS_Z, n - 1 - x, n - 1, n);
            CHECK(a.x == -b.x && a.y == -b.y && a.z == b.z);
        }
}
