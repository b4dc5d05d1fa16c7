/* Resampling a square map to columns of voxels; private to importers and their tests.
 *
 * Column i of n has its centre at (i + 0.5) / n of the map's edge, pixel j of w at (j + 0.5) / w.
 * The filter is a tent around the column's centre whose half-width is one pixel or one column,
 * whichever is larger: exactly bilinear where the map is coarser than the columns. Beyond the edge
 * the outermost pixels go on. Sums run in a fixed order in double, and as deviations from the first
 * pixel: so bits are the same everywhere and a flat area stays exactly flat. */
#ifndef LP_IMPORT_COLUMNS_H
#define LP_IMPORT_COLUMNS_H

#include "engine/base.h"

/* The tent's weights of all columns along one axis (the map is square: both axes are alike). */
struct lp_taps {
    uint32_t column_count, pixel_count;
    size_t *start;   /* column_count + 1 places in `weights` */
    int64_t *first;  /* pixel of a column's first weight; below 0 and above pixel_count - 1: edge */
    double *weights; /* > 0; those of a column sum to 1 */
};

/* For 1 or more columns and pixels. LP_NO_MEMORY. Release with lp_taps_finish. */
LP_MUST_CHECK enum lp_code lp_taps_init(struct lp_taps *taps, uint32_t column_count,
                                        uint32_t pixel_count, struct lp_error *err);
void lp_taps_finish(struct lp_taps *taps); /* accepts a zeroed one */

/* Filters across rows: the map's row for row `z` of columns. `samples` holds pixel_count^2 pixels
 * of `stride` samples, of which the first `used` are taken; `row` gets pixel_count * used. */
void lp_taps_filter_rows(double *row, const struct lp_taps *taps, uint32_t z, const float *samples,
                         uint32_t stride, uint32_t used);

/* Filters along that row: `columns` gets column_count * used values. */
void lp_taps_filter_columns(double *columns, const struct lp_taps *taps, const double *row,
                            uint32_t used);

/* The voxels of column x that belong to the closed surface: from the returned one up to its own
 * top. `tops` are three rows of `count` topmost solid voxels, the column's own row in the middle;
 * a row beyond the map is NULL. A solid voxel y has an empty voxel among its 26 neighbours where
 * y >= the lowest top of the nine columns around; columns beyond the map do not count, so no skirt
 * closes the map's border. */
uint32_t lp_columns_lowest(const uint32_t *const tops[3], uint32_t count, uint32_t x);

#endif
