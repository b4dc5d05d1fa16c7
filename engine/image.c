/* Pictures in and out: layouts, colour encoding and the checks around the image library. */
#include "engine/image.h"

#include "engine/image_oiio.h"
#include "engine/png_check.h"
#include "engine/srgb.h"

#include <errno.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>

#define IMAGE_SIDE_MAX_PX 65535u

const char *lp_image_media_type(enum lp_image_format format)
{
    return format == LP_IMAGE_EXR ? "image/x-exr" : "image/png";
}

const char *lp_image_extension(enum lp_image_format format)
{
    return format == LP_IMAGE_EXR ? "exr" : "png";
}

/* Samples of a picture of three channels; false when they cannot be counted. */
static bool count_samples(size_t *count, const struct lp_pixels *pixels)
{
    size_t pixel_count;
    return lp_size_mul(pixels->width_px, pixels->height_px, &pixel_count) &&
           lp_size_mul(pixel_count, 3, count);
}

enum lp_code lp_image_encode(uint8_t **out, size_t *out_bytes, enum lp_image_format format,
                             const struct lp_pixels *pixels, struct lp_error *err)
{
    enum lp_code code = LP_OK;
    const char *name = lp_image_extension(format);
    uint8_t *codes = NULL;
    size_t count;
    if (pixels->width_px == 0 || pixels->height_px == 0 || pixels->width_px > IMAGE_SIDE_MAX_PX ||
        pixels->height_px > IMAGE_SIDE_MAX_PX || !count_samples(&count, pixels))
        return lp_fail(err, LP_INVALID, name, "a picture has 1 to %u pixels a side, not %u x %u",
                       IMAGE_SIDE_MAX_PX, pixels->width_px, pixels->height_px);
    struct lp_oiio_picture picture = {.width_px = pixels->width_px,
                                      .height_px = pixels->height_px,
                                      .type = LP_OIIO_F32,
                                      .srgb = false,
                                      .pixels = pixels->rgb_lin};
    if (format == LP_IMAGE_PNG) { /* the library would write linear values as they are */
        codes = malloc(count);
        if (!codes) {
            code = lp_fail(err, LP_NO_MEMORY, name, "no memory for %zu bytes of a picture", count);
            goto out;
        }
        for (size_t i = 0; i < count; i++)
            codes[i] = lp_srgb_from_linear(pixels->rgb_lin[i]);
        picture.type = LP_OIIO_U8;
        picture.srgb = true;
        picture.pixels = codes;
    }
    code = lp_oiio_encode(out, out_bytes, name, &picture, err);
out:
    free(codes);
    return code;
}

void lp_image_strip(float *rgb_lin, const struct lp_film *film)
{
    size_t row = (size_t)film->face_px * 3; /* floats of one face's row */
    for (uint32_t y = 0; y < film->face_px; y++)
        for (uint32_t face = 0; face < film->face_count; face++) {
            const float *from = film->radiance + ((size_t)face * film->face_px + y) * row;
            float *to = rgb_lin + ((size_t)y * film->face_count + face) * row;
            memcpy(to, from, row * sizeof *to);
        }
}

/* What the image library would say less clearly. */
static enum lp_code check_is_file(const char *path, struct lp_error *err)
{
    struct stat status;
    if (stat(path, &status) != 0)
        return lp_fail(err, LP_IO, path, "cannot be read: %s; check the path", strerror(errno));
    if (S_ISDIR(status.st_mode))
        return lp_fail(err, LP_INVALID, path, "is a folder, not a picture; name a file");
    if (!S_ISREG(status.st_mode))
        return lp_fail(err, LP_INVALID, path, "is not a regular file; name a picture file");
    if (status.st_size == 0)
        return lp_fail(err, LP_INVALID, path, "is empty; name a picture file");
    return lp_png_check(path, err);
}

/* Widens the `count` raw samples that lie at the end of `samples` to floats, front to back: the
 * write position never overtakes the read position. */
static void widen(float *samples, size_t count, enum lp_oiio_type type)
{
    if (type == LP_OIIO_U8) {
        const uint8_t *raw = (const uint8_t *)(samples + count) - count;
        for (size_t i = 0; i < count; i++) {
            float value = (float)raw[i] / 255.0f;
            memcpy(samples + i, &value, sizeof value);
        }
    } else if (type == LP_OIIO_U16) {
        const uint8_t *raw = (const uint8_t *)(samples + count) - 2 * count;
        for (size_t i = 0; i < count; i++) {
            uint16_t code;
            memcpy(&code, raw + 2 * i, sizeof code);
            float value = (float)code / 65535.0f;
            memcpy(samples + i, &value, sizeof value);
        }
    }
}

static size_t sample_bytes(enum lp_oiio_type type)
{
    switch (type) {
    case LP_OIIO_U8:
        return 1;
    case LP_OIIO_U16:
        return 2;
    case LP_OIIO_F32:
        break;
    }
    return sizeof(float);
}

enum lp_code lp_image_read(struct lp_samples *out, const char *path, uint64_t pixels_max,
                           struct lp_error *err)
{
    struct lp_oiio_reader *reader = NULL;
    struct lp_oiio_header header = {0};
    float *samples = NULL;
    enum lp_code code = check_is_file(path, err);
    if (code == LP_OK)
        code = lp_oiio_open(&reader, &header, path, err);
    if (code != LP_OK)
        goto out;
    uint64_t pixels = (uint64_t)header.width_px * header.height_px;
    if (pixels > pixels_max) {
        code = lp_fail(err, LP_LIMIT, path,
                       "has %u x %u pixels, more than the limit of %llu; scale it down",
                       header.width_px, header.height_px, (unsigned long long)pixels_max);
        goto out;
    }
    size_t count, bytes;
    if (!lp_size_mul(pixels, header.channels, &count) ||
        !lp_size_mul(count, sizeof *samples, &bytes) || !(samples = malloc(bytes))) {
        code = lp_fail(err, LP_NO_MEMORY, path, "no memory for its %u x %u pixels; scale it down",
                       header.width_px, header.height_px);
        goto out;
    }
    code =
        lp_oiio_read((uint8_t *)samples + bytes - count * sample_bytes(header.type), reader, err);
    if (code != LP_OK)
        goto out;
    widen(samples, count, header.type);
    *out = (struct lp_samples){.width_px = header.width_px,
                               .height_px = header.height_px,
                               .channels = header.channels,
                               .bits = (uint32_t)sample_bytes(header.type) * 8,
                               .samples = samples};
    samples = NULL;
out:
    lp_oiio_close(&reader);
    free(samples);
    return code;
}

void lp_samples_finish(struct lp_samples *samples)
{
    free(samples->samples);
    *samples = (struct lp_samples){0};
}
