/* Small PNG files from samples: stored (uncompressed) deflate blocks, one per row. */
#include "tests/harness/png.h"

#include "tests/harness/test.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

struct png_bytes {
    uint8_t *data;
    size_t count, capacity;
};

static void put(struct png_bytes *out, const void *data, size_t bytes)
{
    if (out->count + bytes > out->capacity) {
        out->capacity = 2 * (out->count + bytes);
        out->data = realloc(out->data, out->capacity);
        REQUIRE(out->data);
    }
    memcpy(out->data + out->count, data, bytes);
    out->count += bytes;
}

static void put_u32(struct png_bytes *out, uint32_t value)
{
    uint8_t bytes[4] = {(uint8_t)(value >> 24), (uint8_t)(value >> 16), (uint8_t)(value >> 8),
                        (uint8_t)value};
    put(out, bytes, sizeof bytes);
}

/* CRC-32 of PNG (ISO 3309). */
static uint32_t crc32_of(const uint8_t *data, size_t bytes)
{
    uint32_t crc = 0xffffffffu;
    for (size_t i = 0; i < bytes; i++) {
        crc ^= data[i];
        for (int bit = 0; bit < 8; bit++)
            crc = crc >> 1 ^ (crc & 1 ? 0xedb88320u : 0u);
    }
    return ~crc;
}

static void put_chunk(struct png_bytes *out, const char *type, const uint8_t *data, size_t bytes)
{
    put_u32(out, (uint32_t)bytes);
    size_t start = out->count;
    put(out, type, 4);
    if (bytes > 0)
        put(out, data, bytes);
    put_u32(out, crc32_of(out->data + start, bytes + 4));
}

/* One zlib stream: filter byte 0 and the samples of each row, most significant byte first. */
static void put_rows(struct png_bytes *out, const uint16_t *samples, uint32_t row_samples,
                     uint32_t height, uint32_t bits)
{
    uint32_t a = 1, b = 0; /* Adler-32 */
    size_t row_bytes = 1 + (size_t)row_samples * (bits / 8);
    REQUIRE(row_bytes <= 0xffff);
    put(out, "\x78\x01", 2);
    for (uint32_t y = 0; y < height; y++) {
        uint8_t block[5] = {y + 1 == height, (uint8_t)row_bytes, (uint8_t)(row_bytes >> 8),
                            (uint8_t)~row_bytes, (uint8_t)(~row_bytes >> 8)};
        put(out, block, sizeof block);
        size_t start = out->count;
        put(out, "\0", 1);
        for (uint32_t i = 0; i < row_samples; i++) {
            uint16_t sample = samples[(size_t)y * row_samples + i];
            uint8_t bytes[2] = {(uint8_t)(sample >> 8), (uint8_t)sample};
            put(out, bits == 8 ? bytes + 1 : bytes, bits / 8);
        }
        for (size_t i = start; i < out->count; i++) {
            a = (a + out->data[i]) % 65521;
            b = (b + a) % 65521;
        }
    }
    put_u32(out, b << 16 | a);
}

void test_write_png(const char *path, const uint16_t *samples, uint32_t width, uint32_t height,
                    uint32_t channels, uint32_t bits)
{
    static const uint8_t color_types[] = {0, 0, 4, 2, 6};
    REQUIRE(channels >= 1 && channels <= 4 && (bits == 8 || bits == 16));
    struct png_bytes file = {0}, header = {0}, rows = {0};
    put_u32(&header, width);
    put_u32(&header, height);
    uint8_t rest[5] = {(uint8_t)bits, color_types[channels], 0, 0, 0};
    put(&header, rest, sizeof rest);
    put_rows(&rows, samples, width * channels, height, bits);
    put(&file, "\x89PNG\r\n\x1a\n", 8);
    put_chunk(&file, "IHDR", header.data, header.count);
    put_chunk(&file, "IDAT", rows.data, rows.count);
    put_chunk(&file, "IEND", NULL, 0);
    FILE *stream = fopen(path, "wb");
    REQUIRE(stream && fwrite(file.data, 1, file.count, stream) == file.count);
    REQUIRE(fclose(stream) == 0);
    free(file.data);
    free(header.data);
    free(rows.data);
}
