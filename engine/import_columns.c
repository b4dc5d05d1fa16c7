/* Tent-filtered resampling of maps, and which voxels of a column close the surface. */
#include "engine/import_columns.h"

#include <math.h>
#include <stdlib.h>

/* Centre of column i, in pixels from the centre of pixel 0. */
static double column_center_px(const struct lp_taps *taps, uint32_t i)
{
    int64_t columns = taps->column_count, pixels = taps->pixel_count;
    return (double)((2 * (int64_t)i + 1) * pixels - columns) / (double)(2 * columns);
}

static double half_width_px(const struct lp_taps *taps)
{
    double column_px = (double)taps->pixel_count / (double)taps->column_count;
    return column_px > 1.0 ? column_px : 1.0;
}

/* Writes column i's weights, which sum to 1, at taps->start[i]; returns how many. */
static size_t make_weights(struct lp_taps *taps, uint32_t i)
{
    double center = column_center_px(taps, i), half = half_width_px(taps);
    int64_t first = (int64_t)floor(center - half) + 1; /* pixels at the tent's foot weigh 0 */
    int64_t last = (int64_t)ceil(center + half) - 1;
    double *weights = taps->weights + taps->start[i];
    double sum = 0.0;
    taps->first[i] = first;
    for (int64_t j = first; j <= last; j++) {
        double distance = center > (double)j ? center - (double)j : (double)j - center;
        weights[j - first] = 1.0 - distance / half;
        sum += weights[j - first];
    }
    for (int64_t j = first; j <= last; j++)
        weights[j - first] /= sum;
    return (size_t)(last - first + 1);
}

enum lp_code lp_taps_init(struct lp_taps *taps, uint32_t column_count, uint32_t pixel_count,
                          struct lp_error *err)
{
    struct lp_taps made = {.column_count = column_count, .pixel_count = pixel_count};
    size_t most = (size_t)(2.0 * half_width_px(&made)) + 2, total;
    made.start = calloc((size_t)column_count + 1, sizeof *made.start);
    made.first = calloc(column_count, sizeof *made.first);
    if (lp_size_mul(most, column_count, &total))
        made.weights = calloc(total, sizeof *made.weights);
    if (!made.start || !made.first || !made.weights) {
        lp_taps_finish(&made);
        return lp_fail(err, LP_NO_MEMORY, "", "no memory for the weights of %u columns",
                       column_count);
    }
    for (uint32_t i = 0; i < column_count; i++)
        made.start[i + 1] = made.start[i] + make_weights(&made, i);
    *taps = made;
    return LP_OK;
}

void lp_taps_finish(struct lp_taps *taps)
{
    free(taps->start);
    free(taps->first);
    free(taps->weights);
    *taps = (struct lp_taps){0};
}

static uint32_t clamp_pixel(const struct lp_taps *taps, int64_t j)
{
    if (j < 0)
        return 0;
    return j < (int64_t)taps->pixel_count ? (uint32_t)j : taps->pixel_count - 1;
}

void lp_taps_filter_rows(double *row, const struct lp_taps *taps, uint32_t z, const float *samples,
                         uint32_t stride, uint32_t used)
{
    size_t row_samples = (size_t)taps->pixel_count * stride;
    const double *weights = taps->weights + taps->start[z];
    size_t count = taps->start[z + 1] - taps->start[z];
    const float *first = samples + clamp_pixel(taps, taps->first[z]) * row_samples;
    for (uint32_t j = 0; j < taps->pixel_count; j++)
        for (uint32_t c = 0; c < used; c++)
            row[(size_t)j * used + c] = (double)first[(size_t)j * stride + c];
    for (size_t k = 1; k < count; k++) {
        const float *other = samples + clamp_pixel(taps, taps->first[z] + (int64_t)k) * row_samples;
        for (uint32_t j = 0; j < taps->pixel_count; j++)
            for (uint32_t c = 0; c < used; c++) {
                size_t at = (size_t)j * stride + c;
                row[(size_t)j * used + c] += weights[k] * ((double)other[at] - (double)first[at]);
            }
    }
}

void lp_taps_filter_columns(double *columns, const struct lp_taps *taps, const double *row,
                            uint32_t used)
{
    for (uint32_t i = 0; i < taps->column_count; i++) {
        const double *weights = taps->weights + taps->start[i];
        size_t count = taps->start[i + 1] - taps->start[i];
        for (uint32_t c = 0; c < used; c++) {
            double first = row[(size_t)clamp_pixel(taps, taps->first[i]) * used + c];
            double sum = first;
            for (size_t k = 1; k < count; k++) {
                uint32_t j = clamp_pixel(taps, taps->first[i] + (int64_t)k);
                sum += weights[k] * (row[(size_t)j * used + c] - first);
            }
            columns[(size_t)i * used + c] = sum;
        }
    }
}

uint32_t lp_columns_lowest(const uint32_t *const tops[3], uint32_t count, uint32_t x)
{
    uint32_t from = x > 0 ? x - 1 : 0;
    uint32_t to = x + 1 < count ? x + 1 : x;
    uint32_t lowest = tops[1][x];
    for (int row = 0; row < 3; row++)
        for (uint32_t i = from; tops[row] && i <= to; i++)
            if (tops[row][i] < lowest)
                lowest = tops[row][i];
    return lowest;
}
