/* Height maps to voxels: reads the maps, resamples row by row, pushes the closed surface.
 *
 * Beyond the decoded maps and the build it holds a few rows only:
 *
 *     maps -> taps (rows, then columns) -> ring of three rows of tops -> voxels of the middle row
 */
#include "engine/import.h"

#include "engine/image.h"
#include "engine/import_batch.h"
#include "engine/import_columns.h"
#include "engine/srgb.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>

#define MAP_PIXELS_MAX   (UINT64_C(1) << 28)
#define LENGTH_MIN_M     1e-6
#define LENGTH_MAX_M     1e9
#define RING_ROWS        3
#define GREY_DARKEST_LIN 0.2 /* without a colour map: grey of height 0 ... */
#define GREY_BRIGHT_LIN  0.8 /* ... and of the full height, linear light */

/* One decoded map and how it is resampled. */
struct map {
    struct lp_samples file;
    struct lp_taps taps;
    uint32_t used;   /* samples of a pixel that are taken: 1 or 3 */
    double *row;     /* file.width_px * used: filtered across rows */
    double *columns; /* column_count * used: filtered along the row */
};

struct heightmap {
    const struct lp_heightmap_params *params;
    uint8_t depth;
    uint32_t side_vox;     /* of the cube */
    uint32_t column_count; /* along x and along z */
    uint32_t offset_vox;   /* cell of the first column in x and z */
    double voxel_m;
    double sample_max;          /* 255 or 65535: samples of the height map are kept as integers */
    struct map heights, colors; /* `colors` is all zero without a colour map */
    uint32_t *tops[RING_ROWS];  /* topmost solid voxel; row z at z % RING_ROWS */
    double *rise[RING_ROWS];    /* height / height_m, likewise */
    struct lp_build *build;
    struct lp_batch *batch;
};

static enum lp_code check_length(double value, const char *flag, struct lp_error *err)
{
    if (value >= LENGTH_MIN_M && value <= LENGTH_MAX_M) /* false for NaN */
        return LP_OK;
    return lp_fail(err, LP_INVALID, flag, "%g is not a length: give metres from %g to %g", value,
                   LENGTH_MIN_M, LENGTH_MAX_M);
}

/* The smallest depth whose cube of 2^depth voxels holds `voxels`, or one past the largest. */
static int depth_for(double voxels)
{
    int depth = 1;
    while (depth <= LP_HEIGHTMAP_DEPTH_MAX && (double)(UINT32_C(1) << depth) < voxels)
        depth++;
    return depth;
}

/* Checks the parameters and derives the grid of columns. */
static enum lp_code plan_columns(struct heightmap *import, struct lp_error *err)
{
    const struct lp_heightmap_params *params = import->params;
    if (!params->height_path || !params->height_path[0])
        return lp_fail(err, LP_INVALID, "SOURCE", "no height map is named; give a picture file");
    enum lp_code code = check_length(params->size_m, "--size-m", err);
    if (code == LP_OK)
        code = check_length(params->height_m, "--height-m", err);
    if (code == LP_OK && params->voxel_m != 0.0)
        code = check_length(params->voxel_m, "--voxel-m", err);
    if (code != LP_OK)
        return code;
    import->depth = params->depth ? params->depth : LP_IMPORT_DEPTH_DEFAULT;
    if (import->depth > LP_HEIGHTMAP_DEPTH_MAX)
        return lp_fail(err, LP_INVALID, "--depth", "%d is not a depth of height maps: give 1 to %d",
                       import->depth, LP_HEIGHTMAP_DEPTH_MAX);
    import->side_vox = UINT32_C(1) << import->depth;
    import->column_count = import->side_vox;
    import->voxel_m = params->size_m / import->side_vox;
    if (params->voxel_m == 0.0)
        return LP_OK;

    double columns = floor(params->size_m / params->voxel_m + 0.5);
    if (columns < 1.0)
        return lp_fail(err, LP_INVALID, "--voxel-m",
                       "a voxel of %g m is larger than the area of %g m; make it smaller",
                       params->voxel_m, params->size_m);
    if (columns > import->side_vox) {
        int depth = depth_for(columns);
        char way_out[32] = "";
        if (depth <= LP_HEIGHTMAP_DEPTH_MAX)
            snprintf(way_out, sizeof way_out, "give --depth %d or ", depth);
        return lp_fail(err, LP_LIMIT, "--voxel-m",
                       "%g m in voxels of %g m are %.0f columns, but depth %d holds %u; %suse "
                       "larger voxels",
                       params->size_m, params->voxel_m, columns, import->depth, import->side_vox,
                       way_out);
    }
    import->column_count = (uint32_t)columns;
    import->offset_vox = (import->side_vox - import->column_count) / 2;
    import->voxel_m = params->voxel_m;
    return LP_OK;
}

/* Reads a square map of integers and makes room for its rows. */
static enum lp_code read_map(struct map *map, const char *path, const char *what,
                             uint32_t column_count, struct lp_error *err)
{
    enum lp_code code = lp_image_read(&map->file, path, MAP_PIXELS_MAX, err);
    if (code != LP_OK)
        return code;
    if (map->file.width_px != map->file.height_px)
        return lp_fail(err, LP_INVALID, path,
                       "is %u x %u pixels, but a %s must be square: crop or pad it",
                       map->file.width_px, map->file.height_px, what);
    if (map->file.bits != 8 && map->file.bits != 16)
        return lp_fail(err, LP_INVALID, path,
                       "holds floats, but a %s has integers of 8 or 16 bits: convert it to a "
                       "16-bit PNG",
                       what);
    code = lp_taps_init(&map->taps, column_count, map->file.width_px, err);
    if (code != LP_OK)
        return code;
    map->row = calloc((size_t)map->file.width_px * map->used, sizeof *map->row);
    map->columns = calloc((size_t)column_count * map->used, sizeof *map->columns);
    if (!map->row || !map->columns)
        return lp_fail(err, LP_NO_MEMORY, path, "no memory for its rows");
    return LP_OK;
}

static void finish_map(struct map *map)
{
    lp_samples_finish(&map->file);
    lp_taps_finish(&map->taps);
    free(map->row);
    free(map->columns);
}

/* Turns samples back into the file's integers, which filter without rounding. */
static void heights_to_integers(struct map *map, double sample_max)
{
    size_t count = (size_t)map->file.width_px * map->file.height_px * map->file.channels;
    for (size_t i = 0; i < count; i++)
        map->file.samples[i] = (float)floor((double)map->file.samples[i] * sample_max + 0.5);
}

/* Turns sRGB samples into linear light: by the table where they have 8 bits, between its entries
 * (wrong by less than 1e-5) where they have 16. */
static void colors_to_linear(struct map *map)
{
    size_t count = (size_t)map->file.width_px * map->file.height_px * map->file.channels;
    for (size_t i = 0; i < count; i++) {
        double code = (double)map->file.samples[i] * 255.0;
        if (map->file.bits == 8)
            code = floor(code + 0.5);
        int low = code < 254.0 ? (int)code : 254;
        double from = (double)lp_srgb_to_linear[low], to = (double)lp_srgb_to_linear[low + 1];
        double part = code - low;
        map->file.samples[i] = (float)(part >= 1.0 ? to : from + part * (to - from));
    }
}

static enum lp_code read_maps(struct heightmap *import, struct lp_error *err)
{
    const struct lp_heightmap_params *params = import->params;
    lp_progress_phase(params->progress, "reading maps", params->color_path ? 2 : 1);
    import->heights.used = 1;
    enum lp_code code =
        read_map(&import->heights, params->height_path, "height map", import->column_count, err);
    if (code != LP_OK)
        return code;
    import->sample_max = import->heights.file.bits == 8 ? 255.0 : 65535.0;
    heights_to_integers(&import->heights, import->sample_max);
    if (!params->color_path)
        return LP_OK;
    if (params->progress)
        atomic_store(&params->progress->done, 1);
    import->colors.used = 3;
    code = read_map(&import->colors, params->color_path, "colour map", import->column_count, err);
    if (code != LP_OK)
        return code;
    if (import->colors.file.channels < 3)
        import->colors.used = 1; /* grey, with or without alpha */
    colors_to_linear(&import->colors);
    return LP_OK;
}

static enum lp_code create_build(struct heightmap *import, struct lp_error *err)
{
    const struct lp_heightmap_params *params = import->params;
    /* The map is centred; where the cube cannot be (an odd rest), it sticks out by one voxel. */
    double corner_m = -(import->offset_vox + import->column_count * 0.5) * import->voxel_m;
    struct lp_build_params build = {.depth = import->depth,
                                    .filter = params->filter,
                                    .voxel_size_m = import->voxel_m,
                                    .origin_m = {corner_m, 0.0, corner_m},
                                    .executor = params->executor,
                                    .progress = params->progress,
                                    .memory_limit_bytes = params->memory_limit_bytes};
    enum lp_code code = lp_build_create(&import->build, &build, err);
    return code == LP_OK ? lp_batch_create(&import->batch, import->build, err) : code;
}

static enum lp_code create_ring(struct heightmap *import, struct lp_error *err)
{
    for (int i = 0; i < RING_ROWS; i++) {
        import->tops[i] = calloc(import->column_count, sizeof *import->tops[i]);
        import->rise[i] = calloc(import->column_count, sizeof *import->rise[i]);
        if (!import->tops[i] || !import->rise[i])
            return lp_fail(err, LP_NO_MEMORY, "", "no memory for rows of %u columns",
                           import->column_count);
    }
    return LP_OK;
}

static enum lp_code fail_too_high(const struct heightmap *import, double height_m,
                                  struct lp_error *err)
{
    double cube_m = import->voxel_m * import->side_vox;
    int depth = depth_for(import->params->height_m / import->voxel_m);
    if (import->params->voxel_m != 0.0 && depth <= LP_HEIGHTMAP_DEPTH_MAX)
        return lp_fail(err, LP_LIMIT, "--height-m",
                       "the relief reaches %.6g m, but the cube is %.6g m high; give --depth %d, "
                       "a larger --voxel-m or a lower --height-m",
                       height_m, cube_m, depth);
    return lp_fail(err, LP_LIMIT, "--height-m",
                   "the relief reaches %.6g m, but the cube is %.6g m high; give a lower "
                   "--height-m or a larger --voxel-m (%.6g holds it)",
                   height_m, cube_m,
                   /* rounded up, so that what is printed does hold it */
                   import->params->height_m / import->side_vox * (1 + 1e-5));
}

/* Row z of columns: how high each rises and which voxel is its top. */
static enum lp_code sample_heights(struct heightmap *import, uint32_t z, struct lp_error *err)
{
    struct map *heights = &import->heights;
    uint32_t *tops = import->tops[z % RING_ROWS];
    double *rise = import->rise[z % RING_ROWS];
    lp_taps_filter_rows(heights->row, &heights->taps, z, heights->file.samples,
                        heights->file.channels, 1);
    lp_taps_filter_columns(heights->columns, &heights->taps, heights->row, 1);
    for (uint32_t x = 0; x < import->column_count; x++) {
        double sample = heights->columns[x];
        double height_m = import->params->height_m;
        if (sample < import->sample_max) /* rounding could lift it above the largest */
            height_m =
                (sample > 0.0 ? sample : 0.0) * import->params->height_m / import->sample_max;
        double height_vox = height_m / import->voxel_m;
        if (height_vox > import->side_vox)
            return fail_too_high(import, height_m, err);
        rise[x] = height_m / import->params->height_m;
        tops[x] = height_vox < import->side_vox ? (uint32_t)height_vox : import->side_vox - 1;
    }
    return LP_OK;
}

/* The sRGB colour of a column of the row that was filtered last. */
static void column_color(uint8_t srgb[3], const struct heightmap *import, uint32_t x, double rise)
{
    uint32_t used = import->colors.used;
    for (uint32_t c = 0; c < 3; c++) {
        double linear = GREY_DARKEST_LIN + (GREY_BRIGHT_LIN - GREY_DARKEST_LIN) * rise;
        if (used > 0)
            linear = import->colors.columns[(size_t)x * used + (used == 3 ? c : 0)];
        srgb[c] = lp_srgb_from_linear((float)linear);
    }
}

/* Pushes the surface of row z; the rows around it are in the ring. */
static enum lp_code push_row(struct heightmap *import, uint32_t z, struct lp_error *err)
{
    struct map *colors = &import->colors;
    const uint32_t *const tops[3] = {
        z > 0 ? import->tops[(z - 1) % RING_ROWS] : NULL, import->tops[z % RING_ROWS],
        z + 1 < import->column_count ? import->tops[(z + 1) % RING_ROWS] : NULL};
    if (colors->used > 0) {
        lp_taps_filter_rows(colors->row, &colors->taps, z, colors->file.samples,
                            colors->file.channels, colors->used);
        lp_taps_filter_columns(colors->columns, &colors->taps, colors->row, colors->used);
    }
    for (uint32_t x = 0; x < import->column_count; x++) {
        struct lp_voxel voxel = {.x = import->offset_vox + x, .z = import->offset_vox + z};
        column_color(voxel.albedo_srgb, import, x, import->rise[z % RING_ROWS][x]);
        for (voxel.y = lp_columns_lowest(tops, import->column_count, x); voxel.y <= tops[1][x];
             voxel.y++) {
            enum lp_code code = lp_batch_add(import->batch, &voxel, NULL, err);
            if (code != LP_OK)
                return code;
        }
    }
    return LP_OK;
}

static enum lp_code push_columns(struct heightmap *import, struct lp_error *err)
{
    struct lp_progress *progress = import->params->progress;
    lp_progress_phase(progress, "columns", import->column_count);
    enum lp_code code = sample_heights(import, 0, err);
    for (uint32_t z = 0; code == LP_OK && z < import->column_count; z++) {
        if (lp_progress_cancelled(progress))
            return lp_fail(err, LP_CANCELLED, import->params->height_path,
                           "the import was cancelled");
        if (z + 1 < import->column_count)
            code = sample_heights(import, z + 1, err);
        if (code == LP_OK)
            code = push_row(import, z, err);
        if (progress)
            atomic_store_explicit(&progress->done, z + 1, memory_order_relaxed);
    }
    return code == LP_OK ? lp_batch_flush(import->batch, err) : code;
}

enum lp_code lp_import_heightmap(void **out, size_t *out_bytes,
                                 const struct lp_heightmap_params *params, struct lp_error *err)
{
    struct heightmap import = {.params = params};
    enum lp_code code = plan_columns(&import, err);
    if (code == LP_OK)
        code = read_maps(&import, err);
    if (code == LP_OK)
        code = create_build(&import, err);
    if (code == LP_OK)
        code = create_ring(&import, err);
    if (code == LP_OK)
        code = push_columns(&import, err);
    finish_map(&import.heights); /* the build needs the memory more */
    finish_map(&import.colors);
    if (code == LP_OK)
        code = lp_build_finish(out, out_bytes, import.build, err);
    for (int i = 0; i < RING_ROWS; i++) {
        free(import.tops[i]);
        free(import.rise[i]);
    }
    lp_batch_destroy(&import.batch);
    lp_build_destroy(&import.build);
    return code;
}
