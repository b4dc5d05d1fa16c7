/* Encodes linear light as 8-bit sRGB by searching the table of thresholds. */
#include "engine/srgb.h"

uint8_t lp_srgb_from_linear(float linear)
{
    /* The largest code whose threshold is not above the value; a NaN is above nothing. */
    unsigned code = 0;
    for (unsigned step = 128; step > 0; step >>= 1)
        if (linear >= lp_srgb_threshold[code + step])
            code += step;
    return (uint8_t)code;
}
