/* Unit vectors in two bytes: the octahedral map with 8 bits an axis (Cigolle et al. 2014). */
#ifndef LP_OCTAHEDRAL_H
#define LP_OCTAHEDRAL_H

#include <stdint.h>

/* The code of the nearest direction, for one of any length ("precise" in the paper: the best of
 * the four codes around the point); zero and NaN give +Y. Low byte u, high byte v,
 * both two's complement in -127..127. Thread: any. */
uint16_t lp_oct16_encode(const float direction[3]);
/* Unit vector of any code. Thread: any. */
void lp_oct16_decode(float direction[3], uint16_t code);

#endif
