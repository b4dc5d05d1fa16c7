/* From a wish to a film: plan, tiles, counters.
 *
 * The caller prepares a plan, gives memory for the film, runs every tile (in any order, on any
 * threads, each once) and adds up the tiles' counters in order. The film depends on the plan's
 * parameters and the scene alone. */
#ifndef LP_RENDER_H
#define LP_RENDER_H

#include "engine/cubemap.h"
#include "engine/scene.h"
#include "engine/sha256.h"

#define LP_FACE_PX_MAX          4096
#define LP_SAMPLES_PER_AXIS_MAX 32
#define LP_TILE_PX              32       /* edge of a tile; the last ones of a face may be cut */
#define LP_RADIANCE_MAX         65504.0f /* of an environment: the largest half float */
#define LP_LEVEL_CLASSES        9        /* refinement 0..8 below the cone's level */
#define LP_RAY_CLASSES          3        /* the thesis's 1, 4 and 16 rays */

enum lp_mode {
    LP_MODE_REFERENCE, /* n * n rays a pixel at the finest level */
    LP_MODE_LOD,       /* one ray a pixel at the cone's or the fixed level */
};
enum lp_levels {
    LP_LEVELS_CONE, /* down to a node whose edge <= t * 2 / face_px */
    LP_LEVELS_FIXED /* the three finest levels of the tree: `lod` stops at level 2 */
};

struct lp_render_params {
    enum lp_mode mode;
    enum lp_levels levels;
    uint32_t face_px;                  /* 1..LP_FACE_PX_MAX */
    uint32_t samples_per_axis;         /* 1..LP_SAMPLES_PER_AXIS_MAX; reference only */
    uint32_t face_count;               /* 1..6 */
    enum lp_face faces[LP_FACE_COUNT]; /* which, in film order, each once */
    const char *lighting;              /* a lighting of the scene */
    double position_m[3];              /* the probe, world */
    float environment[3];              /* linear radiance of a ray that leaves, 0..65504 */
};

/* What to do, checked. A value: copy it freely; valid as long as the scene. */
struct lp_render_plan {
    struct lp_render_params params;
    const struct lp_scene *scene;
    const struct lp_channel *lighting;
    double origin_os[3];
    uint32_t tiles_per_axis;
    uint32_t tile_count;
    uint32_t class_rays[LP_RAY_CLASSES]; /* rays of each class: 1, 4, 16, or n * n; 0 unused */
    uint64_t rays_max;                   /* no more than this many rays will be cast */
    size_t film_bytes;                   /* what lp_film_init needs */
};

/* Exact counts of one tile, or summed. pixels = background + sum of pixels_by_class
 * = background + sum of pixels_by_level. */
struct lp_counters {
    uint64_t rays, rays_hit, rays_discarded;
    uint64_t traversal_steps;
    uint64_t pixels, pixels_background;
    uint64_t pixels_by_class[LP_RAY_CLASSES];
    uint64_t pixels_by_level[LP_LEVEL_CLASSES]; /* 0: the finest this pixel may use */
};

/* The image as it was computed: linear radiance, 3 floats a texel, face after face in plan order,
 * rows from the top. The memory is the caller's. */
struct lp_film {
    uint32_t face_px, face_count;
    float *radiance; /* face_count * face_px * face_px * 3 */
};

enum lp_probe_warning {
    LP_PROBE_INSIDE_MATTER = 1, /* the probe's voxel is solid */
    LP_PROBE_OUTSIDE_SCENE = 2, /* the probe lies outside of the scene's cube */
    LP_PROBE_BELOW_GROUND = 4,  /* matter straight above and none below: under a surface */
};

/* Checks `params` against the scene and fills `*plan`. LP_INVALID: err->where is the field of
 * lp_render_params. LP_NOT_FOUND: no such lighting. Thread: any. */
LP_MUST_CHECK enum lp_code lp_render_prepare(struct lp_render_plan *plan,
                                             const struct lp_scene *scene,
                                             const struct lp_render_params *params,
                                             struct lp_error *err);

/* Lays a film over `memory` of plan->film_bytes, 64-byte aligned; nothing is written. */
void lp_film_init(struct lp_film *film, const struct lp_render_plan *plan, void *memory);

/* Renders tile `tile` (0..tile_count-1) into the film and sets `*counters`. Rounding to nearest,
 * denormals on (lp_render_thread_begin). Allocates nothing. Thread: any, tiles at once. */
void lp_render_tile(struct lp_film *film, struct lp_counters *counters,
                    const struct lp_render_plan *plan, uint32_t tile);

/* Sets the calling thread's floating-point mode to what the film's bits ask for. Call once at the
 * start of every thread that renders. */
void lp_render_thread_begin(void);

/* sum += part. */
void lp_counters_add(struct lp_counters *sum, const struct lp_counters *part);

/* Bits of enum lp_probe_warning for a place in the world. */
unsigned lp_probe_warnings(const struct lp_scene *scene, const double position_m[3]);

/* A place from which a newcomer sees something; in the world. Deterministic; tens
 * of thousands of rays for a landscape, 600,000 at most. */
void lp_probe_suggest(double out_m[3], const struct lp_scene *scene);

/* SHA-256 over the film's layers: radiance as little-endian float32, in film order. */
void lp_film_sha256(uint8_t out[LP_SHA256_BYTES], const struct lp_film *film);

#endif
