/* The octahedral map: project on |x| + |y| + |z| = 1 and fold the lower half outwards. */
#include "engine/octahedral.h"

#include <math.h>
#include <stdbool.h>

static float sign_not_zero(float v)
{
    return v < 0.0f ? -1.0f : 1.0f;
}

static uint16_t pack(int u, int v)
{
    return (uint16_t)((unsigned)(u & 0xff) | (unsigned)(v & 0xff) << 8);
}

static int snap(float v)
{
    int i = (int)(v * 127.0f + (v < 0.0f ? -0.5f : 0.5f));
    return i < -127 ? -127 : i > 127 ? 127 : i;
}

uint16_t lp_oct16_encode(const float direction[3])
{
    float sum = fabsf(direction[0]) + fabsf(direction[1]) + fabsf(direction[2]);
    static const float up[3] = {0.0f, 1.0f, 0.0f};
    bool usable = sum > 0.0f && sum <= 0x1p+100f;
    const float *d = usable ? direction : up;
    float length1 = usable ? sum : 1.0f;
    float u = d[0] / length1, v = d[1] / length1;
    if (d[2] < 0.0f) {
        float folded_u = (1.0f - fabsf(v)) * sign_not_zero(u);
        v = (1.0f - fabsf(u)) * sign_not_zero(v);
        u = folded_u;
    }
    return pack(snap(u), snap(v));
}

void lp_oct16_decode(float direction[3], uint16_t code)
{
    int iu = (int)(code & 0xff), iv = (int)(code >> 8);
    iu = iu > 127 ? iu - 256 : iu;
    iv = iv > 127 ? iv - 256 : iv;
    float u = (float)iu / 127.0f, v = (float)iv / 127.0f;
    float z = 1.0f - fabsf(u) - fabsf(v);
    if (z < 0.0f) {
        float folded_u = (1.0f - fabsf(v)) * sign_not_zero(u);
        v = (1.0f - fabsf(u)) * sign_not_zero(v);
        u = folded_u;
    }
    float length = sqrtf(u * u + v * v + z * z);
    direction[0] = u / length;
    direction[1] = v / length;
    direction[2] = z / length;
}
