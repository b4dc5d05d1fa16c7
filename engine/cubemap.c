/* Texel to direction and back. */
#include "engine/cubemap.h"

#include <math.h>

const char *lp_face_text(enum lp_face face)
{
    static const char *const texts[] = {"+X", "-X", "+Y", "-Y", "+Z", "-Z", "none"};
    return (unsigned)face < sizeof texts / sizeof texts[0] ? texts[face] : "none";
}

/* The table: the point of the face on the cube of edge 2. */
static lp_vec3 face_point(enum lp_face face, float cx, float cy)
{
    switch (face) {
    case LP_FACE_POS_X:
        return (lp_vec3){1.0f, cy, -cx};
    case LP_FACE_NEG_X:
        return (lp_vec3){-1.0f, cy, cx};
    case LP_FACE_POS_Y:
        return (lp_vec3){cx, 1.0f, -cy};
    case LP_FACE_NEG_Y:
        return (lp_vec3){cx, -1.0f, cy};
    case LP_FACE_POS_Z:
        return (lp_vec3){cx, cy, 1.0f};
    case LP_FACE_NEG_Z:
    case LP_FACE_NONE:
        break;
    }
    return (lp_vec3){-cx, cy, -1.0f};
}

lp_vec3 lp_cubemap_direction(enum lp_face face, uint32_t x, uint32_t y, uint32_t n)
{
    /* 2(x + 0.5)/n - 1 = (2x + 1 - n)/n: the numerator is exact, so there is one rounding. */
    float cx = (float)(2 * (int32_t)x + 1 - (int32_t)n) / (float)n;
    float cy = (float)((int32_t)n - 2 * (int32_t)y - 1) / (float)n;
    lp_vec3 p = face_point(face, cx, cy);
    float length = sqrtf((p.x * p.x + p.y * p.y) + p.z * p.z);
    return (lp_vec3){p.x / length, p.y / length, p.z / length};
}

static uint32_t texel_of(float c, float major, uint32_t n)
{
    float t = (c / major + 1.0f) * 0.5f * (float)n;
    if (!(t > 0.0f))
        return 0;
    return t >= (float)n ? n - 1 : (uint32_t)t;
}

void lp_cubemap_texel(enum lp_face *face, uint32_t *x, uint32_t *y, lp_vec3 direction, uint32_t n)
{
    const float d[3] = {direction.x, direction.y, direction.z};
    int axis = 0;
    for (int a = 1; a < 3; a++)
        axis = fabsf(d[a]) > fabsf(d[axis]) ? a : axis;
    *face = (enum lp_face)(2 * axis + (d[axis] < 0.0f));
    float cx, cy = direction.y;
    switch (*face) {
    case LP_FACE_POS_X:
        cx = -direction.z;
        break;
    case LP_FACE_NEG_X:
        cx = direction.z;
        break;
    case LP_FACE_POS_Y:
        cx = direction.x;
        cy = -direction.z;
        break;
    case LP_FACE_NEG_Y:
        cx = direction.x;
        cy = direction.z;
        break;
    case LP_FACE_POS_Z:
        cx = direction.x;
        break;
    default:
        cx = -direction.x;
        break;
    }
    *x = texel_of(cx, fabsf(d[axis]), n);
    *y = texel_of(-cy, fabsf(d[axis]), n);
}
