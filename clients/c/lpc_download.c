/* Downloads: a result's pictures into files, checked against what the document promises. */
#include "clients/c/lpc_http.h"

#include <ctype.h>
#include <string.h>
#include <strings.h>

#include "protocol/read.h"

#define EXTENSION_MAX 8 /* letters */

static void hex_of(char out[2 * SHA256_DIGEST_SIZE + 1], const uint8_t digest[SHA256_DIGEST_SIZE])
{
    for (size_t i = 0; i < SHA256_DIGEST_SIZE; i++)
        snprintf(out + 2 * i, 3, "%02x", digest[i]);
}

/* What arrived against what was promised. */
static enum lpc_code compare(struct lpc_file_sink *sink, const char *path, const char *sha256_hex,
                             uint64_t bytes, struct lpc_error *err)
{
    if (bytes != UINT64_MAX && sink->bytes != bytes)
        return lpc_fail(err, LPC_PROTOCOL,
                        "%s has %llu bytes, but the document promised %llu: ask for the render "
                        "again",
                        path, (unsigned long long)sink->bytes, (unsigned long long)bytes);
    uint8_t digest[SHA256_DIGEST_SIZE];
    char hex[2 * SHA256_DIGEST_SIZE + 1];
    sha256_digest(&sink->sha256, sizeof digest, digest);
    hex_of(hex, digest);
    if (sha256_hex && strcasecmp(hex, sha256_hex) != 0)
        return lpc_fail(err, LPC_PROTOCOL,
                        "%s has SHA-256 %s, but the document promised %.64s: ask for the render "
                        "again",
                        path, hex, sha256_hex);
    return LPC_OK;
}

enum lpc_code lpc_download(struct lpc_client *client, const char *path, const char *to,
                           const char *sha256_hex, uint64_t bytes, struct lpc_error *err)
{
    struct lpc_file file = {0};
    struct lpc_answer answer = {0};
    enum lpc_code code = lpc_file_create(&file, to, err);
    if (code != LPC_OK)
        return code;
    struct lpc_file_sink sink = {.file = &file};
    sha256_init(&sink.sha256);
    const struct lpc_request request = {.path = path, .accept = "*/*"};
    code = lpc_transfer(client, &answer, &sink, &request, err);
    if (code == LPC_OK && answer.status != 200)
        code = lpc_refused(client, &answer, path, err);
    if (code == LPC_OK)
        code = compare(&sink, path, sha256_hex, bytes, err);
    if (code == LPC_OK)
        code = lpc_file_keep(&file, err);
    lpc_file_drop(&file);
    lpc_answer_finish(&answer);
    return code;
}

/* The letters after the last dot of an href's path ("png" of "/a/0.png?layout=strip"). */
static bool extension_of(char out[EXTENSION_MAX + 1], const char *href)
{
    size_t length = strcspn(href, "?#");
    size_t letters = 0;
    while (letters < length && isalnum((unsigned char)href[length - 1 - letters]))
        letters++;
    if (letters < 1 || letters > EXTENSION_MAX || letters == length ||
        href[length - 1 - letters] != '.')
        return false;
    memcpy(out, href + length - letters, letters);
    out[letters] = '\0';
    return true;
}

struct picture_name {
    const char *folder, *stem;
    uint64_t index;
    enum { PICTURE_ONLY_PROBE, PICTURE_OF_MANY } which;
};

static enum lpc_code save_picture(struct lpc_client *client, struct lpc_pictures *pictures,
                                  const struct wire_value *image, const struct picture_name *name,
                                  struct lpc_error *err)
{
    const char *href = wire_read_text(wire_read_get(image, "href"));
    char extension[EXTENSION_MAX + 1];
    if (!href || href[0] != '/' || !extension_of(extension, href))
        return lpc_fail(err, LPC_PROTOCOL,
                        "%s names a picture \"%.100s\", which is no path this client understands",
                        lpc_server_shown(client), href ? href : "");
    if (pictures->count == LPC_PICTURES_MAX)
        return lpc_fail(err, LPC_LIMIT, "the result has more than %d pictures", LPC_PICTURES_MAX);
    struct lpc_picture *picture = &pictures->list[pictures->count];
    int length;
    if (name->which == PICTURE_OF_MANY)
        length = snprintf(picture->path, sizeof picture->path, "%s/%s-%llu.%s", name->folder,
                          name->stem, (unsigned long long)name->index, extension);
    else
        length = snprintf(picture->path, sizeof picture->path, "%s/%s.%s", name->folder, name->stem,
                          extension);
    if (length < 0 || (size_t)length >= sizeof picture->path)
        return lpc_fail(err, LPC_INVALID, "%.80s...: the folder's path is too long", name->folder);
    picture->bytes = UINT64_MAX;
    (void)wire_read_u64(&picture->bytes, wire_read_get(image, "bytes"));
    const char *sha256_hex = wire_read_text(wire_read_get(image, "sha256"));
    enum lpc_code code = lpc_download(client, href, picture->path, sha256_hex, picture->bytes, err);
    if (code == LPC_OK)
        pictures->count++;
    return code;
}

enum lpc_code lpc_save_pictures(struct lpc_client *client, struct lpc_pictures *pictures,
                                const char *document, size_t document_bytes, const char *folder,
                                const char *stem, struct lpc_error *err)
{
    struct wire_read *read = wire_read_open(document, document_bytes);
    const struct wire_value *probes = wire_read_get(wire_read_root(read), "probes");
    struct picture_name name = {.folder = folder, .stem = stem};
    name.which = wire_read_count(probes) > 1 ? PICTURE_OF_MANY : PICTURE_ONLY_PROBE;
    enum lpc_code code = LPC_OK;
    if (!wire_read_is_array(probes))
        code = lpc_fail(err, LPC_PROTOCOL,
                        "%s answered without a list \"probes\": does a lightprobe daemon listen "
                        "there?",
                        lpc_server_shown(client));
    for (const struct wire_value *probe = wire_read_first(probes); probe && code == LPC_OK;
         probe = wire_read_next(probe)) {
        (void)wire_read_u64(&name.index, wire_read_get(probe, "index"));
        const struct wire_value *images = wire_read_get(probe, "images");
        for (const struct wire_value *image = wire_read_first(images); image && code == LPC_OK;
             image = wire_read_next(image))
            code = save_picture(client, pictures, image, &name, err);
    }
    wire_read_close(&read);
    return code;
}
