/* The octahedral map: project on |x| + |y| + |z| = 1 and fold the half below z = 0 outwards. */
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

static int clamp(int i)
{
    return i < -127 ? -127 : i > 127 ? 127 : i;
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

uint16_t lp_oct16_encode(const float direction[3])
{
    static const float up[3] = {0.0f, 1.0f, 0.0f};
    float sum = fabsf(direction[0]) + fabsf(direction[1]) + fabsf(direction[2]);
    bool usable = sum > 0.0f && sum <= 0x1p+100f;
    const float *d = usable ? direction : up;
    float length1 = usable ? sum : 1.0f;
    float u = d[0] / length1, v = d[1] / length1;
    if (d[2] < 0.0f) {
        float folded_u = (1.0f - fabsf(v)) * sign_not_zero(u);
        v = (1.0f - fabsf(u)) * sign_not_zero(v);
        u = folded_u;
    }
    /* The map is not angle-preserving: of the four codes around the point the nearest direction. */
    int u0 = (int)floorf(u * 127.0f), v0 = (int)floorf(v * 127.0f);
    uint16_t best = 0;
    float best_dot = -INFINITY;
    for (int i = 0; i < 4; i++) {
        uint16_t code = pack(clamp(u0 + (i & 1)), clamp(v0 + (i >> 1)));
        float back[3];
        lp_oct16_decode(back, code);
        float dot = (d[0] * back[0] + d[1] * back[1]) + d[2] * back[2];
        if (dot > best_dot) {
            best_dot = dot;
            best = code;
        }
    }
    return best;
}
