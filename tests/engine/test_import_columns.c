/* Tests of the tent filter and of the rule that closes the surface between columns. */
#include "engine/import_columns.h"
#include "tests/harness/test.h"

#include <math.h>
#include <stdlib.h>

enum { MAP_MAX = 80 };

/* The tent in its definition: all pixels in reach, the map's edge pixels going on outside. */
static double filter_as_defined(const float *map, uint32_t pixels, uint32_t columns, uint32_t x,
                                uint32_t z)
{
    double half = fmax(1.0 / pixels, 1.0 / columns), sum = 0.0, weights = 0.0;
    double center_x = (x + 0.5) / columns, center_z = (z + 0.5) / columns;
    long reach = (long)ceil(half * pixels) + 1;
    for (long j = -reach; j < (long)pixels + reach; j++)
        for (long i = -reach; i < (long)pixels + reach; i++) {
            double wx = fmax(0.0, 1.0 - fabs(((double)i + 0.5) / pixels - center_x) / half);
            double wz = fmax(0.0, 1.0 - fabs(((double)j + 0.5) / pixels - center_z) / half);
            long ci = i < 0 ? 0 : i >= (long)pixels ? (long)pixels - 1 : i;
            long cj = j < 0 ? 0 : j >= (long)pixels ? (long)pixels - 1 : j;
            sum += wx * wz * (double)map[cj * (long)pixels + ci];
            weights += wx * wz;
        }
    return sum / weights;
}

static void filter(double *out, const float *map, uint32_t pixels, uint32_t columns,
                   uint32_t stride, uint32_t used)
{
    struct lp_taps taps;
    double *row = malloc(sizeof *row * pixels * used);
    REQUIRE(row && lp_taps_init(&taps, columns, pixels, NULL) == LP_OK);
    for (uint32_t z = 0; z < columns; z++) {
        lp_taps_filter_rows(row, &taps, z, map, stride, used);
        lp_taps_filter_columns(out + (size_t)z * columns * used, &taps, row, used);
    }
    lp_taps_finish(&taps);
    free(row);
}

TEST(tent_filters_as_defined_for_any_two_sizes)
{
    test_random random = test_random_begin();
    float map[MAP_MAX * MAP_MAX];
    double *out = malloc(sizeof *out * MAP_MAX * MAP_MAX);
    REQUIRE(out);
    for (int round = 0; round < 60; round++) {
        uint32_t pixels = 1 + test_random_below(&random, 20);
        uint32_t columns = 1 + test_random_below(&random, 40);
        for (size_t i = 0; i < (size_t)pixels * pixels; i++)
            map[i] = (float)test_random_below(&random, 65536);
        filter(out, map, pixels, columns, 1, 1);
        for (uint32_t z = 0; z < columns; z++)
            for (uint32_t x = 0; x < columns; x++)
                CHECK_NEAR(out[z * columns + x], filter_as_defined(map, pixels, columns, x, z),
                           1e-9 * 65536);
    }
    free(out);
}

TEST(tent_leaves_a_map_of_the_same_size_alone)
{
    test_random random = test_random_begin();
    enum { N = 33 };
    float map[N * N];
    double out[N * N];
    for (size_t i = 0; i < N * N; i++)
        map[i] = (float)test_random_below(&random, 65536);
    filter(out, map, N, N, 1, 1);
    for (size_t i = 0; i < N * N; i++)
        CHECK(out[i] == (double)map[i]);
}

TEST(tent_keeps_flat_maps_exactly_flat)
{
    float map[21 * 21];
    double out[64 * 64];
    for (uint32_t columns = 1; columns <= 64; columns++) {
        for (size_t i = 0; i < 21 * 21; i++)
            map[i] = 0.1f * (float)columns;
        filter(out, map, 21, columns, 1, 1);
        for (size_t i = 0; i < (size_t)columns * columns; i++)
            CHECK(out[i] == (double)map[0]);
    }
}

TEST(tent_filters_channels_apart)
{
    enum { N = 7, COLUMNS = 10 };
    float mixed[N * N * 4], single[N * N];
    double out[COLUMNS * COLUMNS * 3], one[COLUMNS * COLUMNS];
    test_random random = test_random_begin();
    for (size_t i = 0; i < N * N * 4; i++)
        mixed[i] = (float)test_random_unit(&random);
    filter(out, mixed, N, COLUMNS, 4, 3);
    for (uint32_t c = 0; c < 3; c++) {
        for (size_t i = 0; i < N * N; i++)
            single[i] = mixed[4 * i + c];
        filter(one, single, N, COLUMNS, 1, 1);
        for (size_t i = 0; i < COLUMNS * COLUMNS; i++)
            CHECK(out[3 * i + c] == one[i]);
    }
}

TEST(lowest_voxel_is_the_lowest_top_of_nine_columns)
{
    const uint32_t above[] = {9, 9, 4, 9}, middle[] = {7, 8, 6, 5}, below[] = {3, 9, 9, 9};
    const uint32_t *all[3] = {above, middle, below}, *first[3] = {NULL, middle, below},
                   *only[3] = {NULL, middle, NULL};
    CHECK_EQ(lp_columns_lowest(all, 4, 0), 3);
    CHECK_EQ(lp_columns_lowest(all, 4, 1), 3);
    CHECK_EQ(lp_columns_lowest(all, 4, 2), 4);
    CHECK_EQ(lp_columns_lowest(all, 4, 3), 4);
    CHECK_EQ(lp_columns_lowest(first, 4, 3), 5);
    CHECK_EQ(lp_columns_lowest(only, 4, 0), 7);
    CHECK_EQ(lp_columns_lowest(only, 1, 0), 7);
}
