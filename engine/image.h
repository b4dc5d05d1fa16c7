/* Pictures in and out: the one face of OpenImageIO.
 *
 * Every function may be called from any thread. Files carry no time and no host, so equal pixels
 * give equal bytes with the same version of the libraries. */
#ifndef LP_IMAGE_H
#define LP_IMAGE_H

#include "engine/render.h"

enum lp_image_format {
    LP_IMAGE_PNG, /* 8-bit sRGB, values above 1 clipped */
    LP_IMAGE_EXR, /* linear float32, not clipped */
};

/* "image/png", "image/x-exr"; "png", "exr". */
const char *lp_image_media_type(enum lp_image_format format);
const char *lp_image_extension(enum lp_image_format format);

/* A picture in memory: linear RGB, rows from the top, no padding. */
struct lp_pixels {
    uint32_t width_px, height_px;
    const float *rgb_lin; /* 3 * width_px * height_px, the caller's */
};

/* Encodes into a fresh block `*out` of `*out_bytes`, to be given to free(). LP_INVALID,
 * LP_NO_MEMORY, LP_IO. */
LP_MUST_CHECK enum lp_code lp_image_encode(uint8_t **out, size_t *out_bytes,
                                           enum lp_image_format format,
                                           const struct lp_pixels *pixels, struct lp_error *err);

/* Layout `strip`: the film's faces side by side, left to right, into `rgb_lin` of
 * face_count * face_px * face_px * 3 floats. */
void lp_image_strip(float *rgb_lin, const struct lp_film *film);

/* A decoded file: `channels` samples a pixel, each 0..1 for integer files (sample / largest value
 * of the format), as it stands for float files. No colour conversion. */
struct lp_samples {
    uint32_t width_px, height_px, channels;
    uint32_t bits;  /* integers of 8 or 16 bits; 32: floats (halves too) */
    float *samples; /* owned: lp_samples_finish */
};

/* Reads a PNG, JPEG, TIFF, EXR, HDR ... file that the local user named (never an upload).
 * `pixels_max` and 65535 pixels a side are checked on the header, before memory is taken: LP_LIMIT.
 * Of more than four channels the first four are read. LP_IO / LP_INVALID say which file and why. */
LP_MUST_CHECK enum lp_code lp_image_read(struct lp_samples *out, const char *path,
                                         uint64_t pixels_max, struct lp_error *err);

/* Accepts a zeroed or finished one. */
void lp_samples_finish(struct lp_samples *samples);

#endif
