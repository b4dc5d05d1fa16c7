/* Importers: sources that become streams of voxels. Each pushes into a build and is done. */
#ifndef LP_IMPORT_H
#define LP_IMPORT_H

#include "engine/build.h"

#define LP_IMPORT_DEPTH_DEFAULT 10
#define LP_HEIGHTMAP_DEPTH_MAX  14

/* A height map and its colours. A column grows along +X, a row along +Z; the map is centred on
 * x = z = 0, height 0 lies at y = 0. */
struct lp_heightmap_params {
    const char *height_path;      /* square; 8 or 16 bit; one channel, or the first of several */
    const char *color_path;       /* NULL: grey by height; square; sRGB; any size */
    double size_m;                /* edge of the area, > 0 */
    double height_m;              /* of the brightest sample the format can hold, > 0 */
    double voxel_m;               /* 0: size_m / 2^depth */
    uint8_t depth;                /* 0: LP_IMPORT_DEPTH_DEFAULT */
    enum lp_filter filter;        /* 0: visible */
    uint64_t memory_limit_bytes;  /* of the voxels on their way; 0: none. LP_LIMIT beyond it */
    struct lp_executor *executor; /* NULL: serial */
    struct lp_progress *progress; /* NULL: none */
};

/* Reads both files and makes a closed surface: of the solid {height <= h(x, z)} every voxel that
 * has an empty voxel among its 26 neighbours, so that no ray, through edges and corners included,
 * passes from empty space into the solid without meeting one. Heights are sampled at column
 * centres, with a tent filter as wide as a column or a pixel, whichever is larger; colours
 * likewise in linear light. The voxel that holds the height is the column's top.
 * `*out`, `*out_bytes`: the scene file's bytes, to be given to free(). */
LP_MUST_CHECK enum lp_code lp_import_heightmap(void **out, size_t *out_bytes,
                                               const struct lp_heightmap_params *params,
                                               struct lp_error *err);

/* Procedural scenes for tests and demonstrations. */
enum lp_procedural {
    LP_PROCEDURAL_ROOM,  /* closed cube, its six walls in six colours, one voxel thick, with a
                            lighting "lamp": the walls' colours with a patch of 50 on the ceiling */
    LP_PROCEDURAL_SPHERE /* a sphere over a checkerboard */
};

struct lp_procedural_params {
    enum lp_procedural which;
    double size_m;         /* edge of the cube; 0: 8 */
    uint8_t depth;         /* 0: LP_IMPORT_DEPTH_DEFAULT; 3..11 */
    enum lp_filter filter; /* 0: visible */
    struct lp_executor *executor;
    struct lp_progress *progress;
};

/* sRGB colours of the room's walls by the direction one looks in from inside, cubemap order:
 * +X red, -X cyan, +Y white, -Y yellow-brown, +Z blue, -Z green. */
extern const uint8_t lp_room_walls_srgb[6][3];

/* The name "room" or "sphere" as a kind; false when unknown. */
bool lp_procedural_named(enum lp_procedural *out, const char *name);

LP_MUST_CHECK enum lp_code lp_import_procedural(void **out, size_t *out_bytes,
                                                const struct lp_procedural_params *params,
                                                struct lp_error *err);

#endif
