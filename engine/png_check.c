/* Walks a PNG file's chunks, so that a damaged one is refused before libpng sees it. */
#include "engine/png_check.h"

#include <errno.h>
#include <stdio.h>
#include <string.h>

#define PNG_HEAD_BYTES     8 /* signature, and the head of a chunk: length and type */
#define PNG_CRC_BYTES      4
#define PNG_CHUNK_MAX      0x7fffffffu
#define PNG_PIECE_BYTES    4096
#define PNG_CRC_START      0xffffffffu
#define PNG_CRC_POLYNOMIAL 0xedb88320u

/* The walk: an open file, and the table of its CRC-32 by nibbles. */
struct png_walk {
    FILE *stream;
    const char *path;
    uint64_t offset; /* bytes read so far */
    uint32_t crc_table[16];
};

static void make_crc_table(uint32_t table[16])
{
    for (uint32_t i = 0; i < 16; i++) {
        uint32_t value = i;
        for (int bit = 0; bit < 4; bit++)
            value = value >> 1 ^ (value & 1 ? PNG_CRC_POLYNOMIAL : 0u);
        table[i] = value;
    }
}

static uint32_t add_to_crc(const struct png_walk *walk, uint32_t crc, const uint8_t *data,
                           size_t bytes)
{
    for (size_t i = 0; i < bytes; i++) {
        crc ^= data[i];
        crc = crc >> 4 ^ walk->crc_table[crc & 15];
        crc = crc >> 4 ^ walk->crc_table[crc & 15];
    }
    return crc;
}

static uint32_t big_endian(const uint8_t bytes[4])
{
    return (uint32_t)bytes[0] << 24 | (uint32_t)bytes[1] << 16 | (uint32_t)bytes[2] << 8 | bytes[3];
}

static enum lp_code get(struct png_walk *walk, uint8_t *data, size_t bytes, struct lp_error *err)
{
    size_t got = fread(data, 1, bytes, walk->stream);
    walk->offset += got;
    if (got == bytes)
        return LP_OK;
    if (ferror(walk->stream))
        return lp_fail(err, LP_IO, walk->path, "cannot be read: %s", strerror(errno));
    return lp_fail(err, LP_INVALID, walk->path,
                   "is truncated: this PNG file ends at byte %llu within a chunk; get it again",
                   (unsigned long long)walk->offset);
}

/* Reads one chunk; its type is left in `type`. */
static enum lp_code check_chunk(struct png_walk *walk, char type[5], struct lp_error *err)
{
    uint8_t head[PNG_HEAD_BYTES], piece[PNG_PIECE_BYTES];
    uint64_t start = walk->offset;
    enum lp_code code = get(walk, head, sizeof head, err);
    if (code != LP_OK)
        return code;
    uint32_t left = big_endian(head);
    memcpy(type, head + 4, 4);
    type[4] = '\0';
    for (int i = 0; i < 4; i++)
        if ((type[i] | 0x20) < 'a' || (type[i] | 0x20) > 'z' || left > PNG_CHUNK_MAX)
            return lp_fail(err, LP_INVALID, walk->path,
                           "is damaged: at byte %llu there is no PNG chunk; get it again",
                           (unsigned long long)start);
    uint32_t crc = add_to_crc(walk, PNG_CRC_START, head + 4, 4);
    while (left > 0) {
        size_t bytes = left < sizeof piece ? left : sizeof piece;
        code = get(walk, piece, bytes, err);
        if (code != LP_OK)
            return code;
        crc = add_to_crc(walk, crc, piece, bytes);
        left -= (uint32_t)bytes;
    }
    code = get(walk, piece, PNG_CRC_BYTES, err);
    if (code == LP_OK && big_endian(piece) != ~crc)
        code = lp_fail(err, LP_INVALID, walk->path,
                       "is damaged: the checksum of the PNG chunk %s at byte %llu is wrong; get it "
                       "again",
                       type, (unsigned long long)start);
    return code;
}

enum lp_code lp_png_check(const char *path, struct lp_error *err)
{
    enum lp_code code = LP_OK;
    struct png_walk walk = {.stream = fopen(path, "rb"), .path = path};
    if (!walk.stream)
        return lp_fail(err, LP_IO, path, "cannot be read: %s; check the path and its permissions",
                       strerror(errno));
    uint8_t signature[PNG_HEAD_BYTES];
    if (fread(signature, 1, sizeof signature, walk.stream) != sizeof signature ||
        memcmp(signature, "\x89PNG\r\n\x1a\n", sizeof signature) != 0)
        goto out;
    walk.offset = sizeof signature;
    make_crc_table(walk.crc_table);
    char type[5] = "";
    while (code == LP_OK && strcmp(type, "IEND") != 0)
        code = check_chunk(&walk, type, err);
out:
    fclose(walk.stream);
    return code;
}
