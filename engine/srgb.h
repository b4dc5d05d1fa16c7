/* sRGB to linear and back by exact tables, so that every machine gets the same bits (IEC
 * 61966-2-1). */
#ifndef LP_SRGB_H
#define LP_SRGB_H

#include <stdint.h>

/* Linear value of every 8-bit sRGB code, correctly rounded to float: 0 -> 0, 255 -> 1. */
extern const float lp_srgb_to_linear[256];

/* Code i is the nearest for linear values in [lp_srgb_threshold[i], lp_srgb_threshold[i + 1]):
 * the thresholds are the linear values of i - 0.5, entry 0 is 0. */
extern const float lp_srgb_threshold[256];

/* The nearest code of a linear value, clipped to 0..255; NaN gives 0. Thread: any. */
uint8_t lp_srgb_from_linear(float linear);

#endif
