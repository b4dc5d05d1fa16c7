/* Cubemap faces: texel to direction and back (Khronos KTX / OpenGL / Vulkan table).
 *
 * Order +X -X +Y -Y +Z -Z, row 0 at the top; with cx = 2(x + 0.5)/n - 1 and cy = 1 - 2(y + 0.5)/n
 *
 *     +X ( 1, cy, -cx)   -X (-1, cy, cx)   +Y (cx, 1, -cy)
 *     -Y (cx, -1, cy)    +Z (cx, cy, 1)    -Z (-cx, cy, -1)
 *
 * The table is left-handed and our world right-handed: stored faces read mirrored, as in every
 * engine that uses it. */
#ifndef LP_CUBEMAP_H
#define LP_CUBEMAP_H

#include "engine/trace.h"

#define LP_FACE_COUNT 6

/* "+X", "-X", ... */
const char *lp_face_text(enum lp_face face);

/* Unit direction through the centre of texel (x, y) of an n * n face; x, y in 0..n-1, n in
 * 1..2^20. Float, correctly rounded operations in fixed order: 2x + 1 - n over n, then divided by
 * the length. Sub-samples s of a texel are the texels of the face at n * samples. */
lp_vec3 lp_cubemap_direction(enum lp_face face, uint32_t x, uint32_t y, uint32_t n);

/* The texel that a direction (not zero, any length) falls into; on an edge the face of the lower
 * axis. */
void lp_cubemap_texel(enum lp_face *face, uint32_t *x, uint32_t *y, lp_vec3 direction, uint32_t n);

#endif
