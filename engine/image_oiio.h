/* The thin C face of the C++ shim around OpenImageIO; private to image.c and its tests.
 *
 * No exception leaves the shim and nothing is printed (but one line by libpng itself
 * for a PNG whose checksums hold and whose compressed data do not). The library's global settings
 * (no threads of its own, no messages) are made once, by whoever comes first. Thread: any. */
#ifndef LP_IMAGE_OIIO_H
#define LP_IMAGE_OIIO_H

#ifdef __cplusplus
extern "C" {
#endif

#include "engine/base.h"

/* A sample's type, in memory and in the file. */
enum lp_oiio_type {
    LP_OIIO_U8 = 1,
    LP_OIIO_U16,
    LP_OIIO_F32 /* reading: half floats as well, widened */
};

/* Three channels R G B, rows from the top, no padding. */
struct lp_oiio_picture {
    uint32_t width_px, height_px;
    enum lp_oiio_type type;
    bool srgb;          /* the samples are sRGB-encoded; else linear light */
    const void *pixels; /* the caller's */
};

/* Encodes as `format`, "png" or "exr", into a fresh block to be given to free(). Equal pixels give
 * equal bytes: no time, host or program is noted. LP_IO, LP_NO_MEMORY. */
LP_MUST_CHECK enum lp_code lp_oiio_encode(uint8_t **out, size_t *out_bytes, const char *format,
                                          const struct lp_oiio_picture *picture,
                                          struct lp_error *err);

struct lp_oiio_reader; /* an open file whose header was read */

/* What the header says. At most four channels are offered, the first ones. */
struct lp_oiio_header {
    uint32_t width_px, height_px, channels;
    enum lp_oiio_type type;
};

/* Opens a file of any format the library knows. LP_INVALID: not a picture, or of a type that is
 * not offered here; LP_NO_MEMORY. Close with lp_oiio_close. */
LP_MUST_CHECK enum lp_code lp_oiio_open(struct lp_oiio_reader **out, struct lp_oiio_header *header,
                                        const char *path, struct lp_error *err);

/* Reads all samples, in the header's type, into `samples` of width * height * channels: pixel by
 * pixel, rows from the top. LP_INVALID: the file is truncated or damaged. */
LP_MUST_CHECK enum lp_code lp_oiio_read(void *samples, struct lp_oiio_reader *reader,
                                        struct lp_error *err);

/* Accepts NULL and sets it. */
void lp_oiio_close(struct lp_oiio_reader **reader);

#ifdef __cplusplus
}
#endif

#endif
