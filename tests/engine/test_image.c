/* Tests of reading and writing pictures. */
#include "engine/image.h"
#include "engine/image_oiio.h"
#include "engine/srgb.h"
#include "tests/harness/png.h"
#include "tests/harness/test.h"

#include <fcntl.h>
#include <math.h>
#include <pthread.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <time.h>
#include <unistd.h>

#define MANY (1u << 24)

static void write_file(const char *path, const void *data, size_t bytes)
{
    FILE *stream = fopen(path, "wb");
    REQUIRE(stream && fwrite(data, 1, bytes, stream) == bytes && fclose(stream) == 0);
}

static uint8_t *read_file(size_t *bytes, const char *path)
{
    FILE *stream = fopen(path, "rb");
    REQUIRE(stream && fseek(stream, 0, SEEK_END) == 0);
    *bytes = (size_t)ftell(stream);
    rewind(stream);
    uint8_t *data = malloc(*bytes + 1);
    REQUIRE(data && fread(data, 1, *bytes, stream) == *bytes);
    fclose(stream);
    return data;
}

/* A test picture whose samples are all different and go above 1. */
static float *shaped_pixels(uint32_t width, uint32_t height)
{
    size_t count = (size_t)width * height * 3;
    float *rgb = malloc(count * sizeof *rgb);
    REQUIRE(rgb);
    for (size_t i = 0; i < count; i++)
        rgb[i] = (float)i * 1.37f / (float)count;
    rgb[count - 1] = 50.0f;
    rgb[0] = 0.0f;
    return rgb;
}

static void encode(uint8_t **data, size_t *bytes, enum lp_image_format format, const float *rgb,
                   uint32_t width, uint32_t height)
{
    struct lp_error err = {0};
    struct lp_pixels pixels = {width, height, rgb};
    if (lp_image_encode(data, bytes, format, &pixels, &err) != LP_OK)
        test_abort(__FILE__, __LINE__, "%s: %s", err.where, err.text);
}

static void read_picture(struct lp_samples *out, const char *path)
{
    struct lp_error err = {0};
    if (lp_image_read(out, path, MANY, &err) != LP_OK)
        test_abort(__FILE__, __LINE__, "%s: %s", err.where, err.text);
}

TEST(png_holds_our_srgb_codes)
{
    float *rgb = shaped_pixels(13, 7);
    uint8_t *data;
    size_t bytes;
    encode(&data, &bytes, LP_IMAGE_PNG, rgb, 13, 7);
    write_file("a.png", data, bytes);
    struct lp_samples back;
    read_picture(&back, "a.png");
    CHECK_EQ(back.width_px, 13);
    CHECK_EQ(back.height_px, 7);
    CHECK_EQ(back.channels, 3);
    CHECK_EQ(back.bits, 8);
    for (size_t i = 0; i < 13 * 7 * 3; i++)
        CHECK(back.samples[i] == (float)lp_srgb_from_linear(rgb[i]) / 255.0f);
    CHECK(memmem(data, bytes, "sRGB", 4)); /* readers are told */
    lp_samples_finish(&back);
    free(data);
    free(rgb);
}

TEST(exr_holds_linear_floats_unclipped)
{
    float *rgb = shaped_pixels(6 * 8, 8);
    uint8_t *data;
    size_t bytes;
    encode(&data, &bytes, LP_IMAGE_EXR, rgb, 6 * 8, 8);
    write_file("a.exr", data, bytes);
    struct lp_samples back;
    read_picture(&back, "a.exr");
    CHECK_EQ(back.width_px, 48);
    CHECK_EQ(back.height_px, 8);
    CHECK_EQ(back.channels, 3);
    CHECK_EQ(back.bits, 32);
    CHECK(memcmp(back.samples, rgb, sizeof *rgb * 48 * 8 * 3) == 0);
    lp_samples_finish(&back);
    free(data);
    free(rgb);
}

TEST(equal_pixels_give_equal_bytes_at_any_time)
{
    float *rgb = shaped_pixels(32, 32);
    uint8_t *data[2][2];
    size_t bytes[2][2];
    for (int round = 0; round < 2; round++) {
        for (int format = 0; format < 2; format++)
            encode(&data[round][format], &bytes[round][format], (enum lp_image_format)format, rgb,
                   32, 32);
        /* The clock's next second is the condition: a time stamp would show it. */
        for (time_t start = time(NULL); round == 0 && time(NULL) <= start + 1;)
            usleep(10000);
    }
    char host[256] = "", folder[1024] = "";
    REQUIRE(gethostname(host, sizeof host - 1) == 0 && getcwd(folder, sizeof folder));
    const char *const traces[] = {host, folder, test_root(), "OpenImageIO", "OpenEXR", "Software"};
    for (int format = 0; format < 2; format++) {
        CHECK_EQ(bytes[0][format], bytes[1][format]);
        CHECK(memcmp(data[0][format], data[1][format], bytes[0][format]) == 0);
        for (size_t i = 0; i < sizeof traces / sizeof traces[0]; i++)
            if (traces[i][0] &&
                memmem(data[0][format], bytes[0][format], traces[i], strlen(traces[i])))
                test_fail(__FILE__, __LINE__, "%s names %s",
                          lp_image_extension((enum lp_image_format)format), traces[i]);
        free(data[0][format]);
        free(data[1][format]);
    }
    free(rgb);
}

TEST(integers_of_8_and_16_bits_are_read_exactly)
{
    enum { WIDTH = 40, HEIGHT = 30 };
    uint16_t samples[WIDTH * HEIGHT * 4];
    test_random random = test_random_begin();
    for (uint32_t channels = 1; channels <= 4; channels++)
        for (uint32_t bits = 8; bits <= 16; bits += 8) {
            uint32_t largest = (1u << bits) - 1;
            for (size_t i = 0; i < WIDTH * HEIGHT * channels; i++)
                samples[i] = (uint16_t)test_random_below(&random, largest + 1);
            samples[0] = 0;
            samples[1] = (uint16_t)largest;
            test_write_png("a.png", samples, WIDTH, HEIGHT, channels, bits);
            struct lp_samples back;
            read_picture(&back, "a.png");
            CHECK_EQ(back.width_px, WIDTH);
            CHECK_EQ(back.height_px, HEIGHT);
            CHECK_EQ(back.channels, channels);
            CHECK_EQ(back.bits, bits);
            for (size_t i = 0; i < WIDTH * HEIGHT * channels; i++)
                CHECK(back.samples[i] == (float)samples[i] / (float)largest);
            lp_samples_finish(&back);
        }
}

/* Reads what must fail and returns the sentence. Nothing may be printed meanwhile. */
static void fail_to_read(struct lp_error *err, enum lp_code code, const char *path, uint64_t most)
{
    fflush(NULL);
    int kept_out = dup(1), kept_err = dup(2);
    int file = open("printed", O_RDWR | O_CREAT | O_TRUNC, 0600);
    REQUIRE(kept_out >= 0 && kept_err >= 0 && file >= 0 && dup2(file, 1) == 1 &&
            dup2(file, 2) == 2);
    struct lp_samples samples = {.width_px = 77};
    *err = (struct lp_error){0};
    enum lp_code got = lp_image_read(&samples, path, most, err);
    fflush(NULL);
    REQUIRE(dup2(kept_out, 1) == 1 && dup2(kept_err, 2) == 2);
    struct stat status;
    REQUIRE(fstat(file, &status) == 0);
    if (status.st_size > 0)
        test_fail(__FILE__, __LINE__, "reading %s printed %ld bytes", path, (long)status.st_size);
    close(file);
    close(kept_out);
    close(kept_err);
    if (got != code)
        test_fail(__FILE__, __LINE__, "reading %s gives \"%s\", not \"%s\": %s", path,
                  lp_code_text(got), lp_code_text(code), err->text);
    CHECK_EQ(samples.width_px, 77); /* outputs are untouched on failure */
    CHECK_STR(err->where, path);
    CHECK_EQ(err->code, got);
    CHECK(!strchr(err->text, '\n'));
}

TEST(what_is_no_picture_is_refused_in_a_sentence)
{
    struct lp_error err;
    fail_to_read(&err, LP_IO, "missing.png", MANY);
    CHECK_HAS(err.text, "No such file");
    REQUIRE(mkdir("folder.png", 0700) == 0);
    fail_to_read(&err, LP_INVALID, "folder.png", MANY);
    CHECK_HAS(err.text, "folder");
    write_file("empty.png", "", 0);
    fail_to_read(&err, LP_INVALID, "empty.png", MANY);
    CHECK_HAS(err.text, "empty");
    write_file("text.png", "no picture at all, just words", 29);
    fail_to_read(&err, LP_INVALID, "text.png", MANY);
    CHECK_HAS(err.text, "not a picture");
    write_file("words.txt", "no picture at all, just words", 29);
    fail_to_read(&err, LP_INVALID, "words.txt", MANY);
    CHECK_HAS(err.text, "not a picture");
    REQUIRE(mkfifo("pipe.png", 0600) == 0);
    fail_to_read(&err, LP_INVALID, "pipe.png", MANY);
    CHECK_HAS(err.text, "regular file");
}

TEST(a_header_over_the_limit_is_refused_before_memory_is_taken)
{
    struct lp_error err;
    uint16_t samples[20 * 10] = {0};
    test_write_png("a.png", samples, 20, 10, 1, 8);
    fail_to_read(&err, LP_LIMIT, "a.png", 199);
    CHECK_HAS(err.text, "20 x 10");
    CHECK_HAS(err.text, "199");
    struct lp_samples back;
    struct lp_error none = {0};
    CHECK_EQ(lp_image_read(&back, "a.png", 200, &none), LP_OK);
    lp_samples_finish(&back);
    lp_samples_finish(&back); /* a finished one is accepted */
    CHECK(!back.samples);

    uint16_t *wide = calloc(65536, sizeof *wide);
    REQUIRE(wide);
    test_write_png("tall.png", wide, 1, 65536, 1, 8);
    fail_to_read(&err, LP_LIMIT, "tall.png", MANY);
    CHECK_HAS(err.text, "65535");
    free(wide);
}

/* Every file cut anywhere is refused. */
static void check_truncations(const char *path, size_t step)
{
    size_t bytes;
    uint8_t *data = read_file(&bytes, path);
    char cut[64];
    snprintf(cut, sizeof cut, "cut-%s", path);
    for (size_t length = 1; length < bytes; length += step) {
        struct lp_error err;
        write_file(cut, data, length);
        fail_to_read(&err, LP_INVALID, cut, MANY);
        CHECK(err.text[0] != '\0');
        CHECK(!strstr(err.text, "no reason given"));
        unlink(cut);
    }
    free(data);
}

TEST(truncated_pictures_are_refused)
{
    float *rgb = shaped_pixels(24, 40);
    uint8_t codes[24 * 40 * 3];
    for (size_t i = 0; i < sizeof codes; i++)
        codes[i] = (uint8_t)(i * i >> 5);
    struct lp_oiio_picture picture = {24, 40, LP_OIIO_U8, true, codes};
    static const char *const formats[] = {"png", "exr", "jpg", "bmp"};
    for (size_t i = 0; i < sizeof formats / sizeof formats[0]; i++) {
        picture.type = strcmp(formats[i], "exr") == 0 ? LP_OIIO_F32 : LP_OIIO_U8;
        picture.pixels = picture.type == LP_OIIO_F32 ? (const void *)rgb : codes;
        uint8_t *data;
        size_t bytes;
        char path[16];
        REQUIRE(lp_oiio_encode(&data, &bytes, formats[i], &picture, NULL) == LP_OK);
        snprintf(path, sizeof path, "a.%s", formats[i]);
        write_file(path, data, bytes);
        free(data);
        struct lp_samples whole;
        read_picture(&whole, path);
        lp_samples_finish(&whole);
        check_truncations(path, bytes / 50 + 1);
    }
    free(rgb);
}

TEST(a_flipped_bit_of_a_png_is_found)
{
    uint16_t samples[16 * 16];
    for (size_t i = 0; i < 16 * 16; i++)
        samples[i] = (uint16_t)(i & 255);
    test_write_png("a.png", samples, 16, 16, 1, 8);
    size_t bytes;
    uint8_t *data = read_file(&bytes, "a.png");
    for (size_t i = 8; i < bytes; i += 3) { /* the signature's own bits make it another format */
        struct lp_error err;
        data[i] ^= 0x10;
        write_file("bad.png", data, bytes);
        fail_to_read(&err, LP_INVALID, "bad.png", MANY);
        data[i] ^= 0x10;
    }
    free(data);
}

static void *encode_many(void *argument)
{
    float *rgb = shaped_pixels(64, 64);
    for (int i = 0; i < 10; i++) {
        uint8_t *data;
        size_t bytes;
        encode(&data, &bytes, i & 1 ? LP_IMAGE_EXR : LP_IMAGE_PNG, rgb, 64, 64);
        free(data);
    }
    free(rgb);
    return argument;
}

TEST(many_threads_encode_at_once)
{
    pthread_t threads[4];
    for (int i = 0; i < 4; i++)
        REQUIRE(pthread_create(&threads[i], NULL, encode_many, NULL) == 0);
    for (int i = 0; i < 4; i++)
        pthread_join(threads[i], NULL);
}

TEST(impossible_sizes_are_refused)
{
    uint8_t *data = NULL;
    size_t bytes = 0;
    struct lp_error err = {0};
    float rgb[3] = {0};
    struct lp_pixels none = {0, 1, rgb}, huge = {70000, 1, rgb};
    CHECK_EQ(lp_image_encode(&data, &bytes, LP_IMAGE_PNG, &none, &err), LP_INVALID);
    CHECK_EQ(lp_image_encode(&data, &bytes, LP_IMAGE_EXR, &huge, NULL), LP_INVALID);
    CHECK_HAS(err.text, "0 x 1");
    CHECK(!data);
}

TEST(strip_puts_faces_side_by_side)
{
    enum { PX = 3, FACES = 2 };
    float radiance[FACES * PX * PX * 3], strip[FACES * PX * PX * 3];
    for (size_t i = 0; i < sizeof radiance / sizeof radiance[0]; i++)
        radiance[i] = (float)i;
    struct lp_film film = {.face_px = PX, .face_count = FACES, .radiance = radiance};
    lp_image_strip(strip, &film);
    for (int face = 0; face < FACES; face++)
        for (int y = 0; y < PX; y++)
            for (int x = 0; x < PX; x++)
                for (int c = 0; c < 3; c++)
                    CHECK(strip[(y * PX * FACES + face * PX + x) * 3 + c] ==
                          radiance[((face * PX + y) * PX + x) * 3 + c]);
    CHECK_STR(lp_image_media_type(LP_IMAGE_PNG), "image/png");
    CHECK_STR(lp_image_media_type(LP_IMAGE_EXR), "image/x-exr");
    CHECK_STR(lp_image_extension(LP_IMAGE_PNG), "png");
    CHECK_STR(lp_image_extension(LP_IMAGE_EXR), "exr");
}
