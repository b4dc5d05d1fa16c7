/* One HTTP request at a time: the one face of libcurl. */
#include "clients/c/lpc_http.h"

#include <errno.h>
#include <stdarg.h>
#include <stdlib.h>
#include <string.h>
#include <strings.h>

#include <curl/curl.h>

#define CONNECT_TIMEOUT_MS 5000
#define TIMEOUT_MS         600000
#define BODY_MAX_BYTES     ((size_t)64 << 20)
#define FILE_MAX_BYTES     ((uint64_t)4 << 30)
#define URL_BYTES          2048
#define HEADER_BYTES       1024
#define BODY_FIRST_BYTES   4096

struct lpc_client {
    CURL *curl;
    struct lpc_address address;
    struct lpc_options options; /* defaults filled; `server` is not used any more */
};

/* One transfer as libcurl's callbacks see it. */
struct transfer {
    const struct lpc_client *client;
    struct lpc_answer *answer;
    struct lpc_file_sink *file; /* where the body of a 200 goes; NULL: into `answer` */
    size_t capacity;            /* of answer->body */
    enum lpc_code failure;      /* why a callback stopped the transfer */
};

enum lpc_code lpc_fail(struct lpc_error *err, enum lpc_code code, const char *format, ...)
{
    if (!err || err->code != LPC_OK)
        return code;
    err->code = code;
    va_list args;
    va_start(args, format);
    vsnprintf(err->text, sizeof err->text, format, args);
    va_end(args);
    return code;
}

enum lpc_code lpc_client_create(struct lpc_client **out, const struct lpc_options *options,
                                struct lpc_error *err)
{
    struct lpc_address address;
    enum lpc_code code = lpc_address_read(&address, options->server, err);
    if (code != LPC_OK)
        return code;
    if (curl_global_init(CURL_GLOBAL_DEFAULT) != CURLE_OK)
        return lpc_fail(err, LPC_NO_MEMORY, "the HTTP library does not start: out of memory");
    struct lpc_client *client = calloc(1, sizeof *client);
    if (client)
        client->curl = curl_easy_init();
    if (!client || !client->curl) {
        free(client);
        curl_global_cleanup();
        return lpc_fail(err, LPC_NO_MEMORY, "the HTTP client does not start: out of memory");
    }
    client->address = address;
    client->options = *options;
    client->options.server = NULL;
    if (!client->options.connect_timeout_ms)
        client->options.connect_timeout_ms = CONNECT_TIMEOUT_MS;
    if (!client->options.timeout_ms)
        client->options.timeout_ms = TIMEOUT_MS;
    if (!client->options.body_max_bytes)
        client->options.body_max_bytes = BODY_MAX_BYTES;
    if (!client->options.file_max_bytes)
        client->options.file_max_bytes = FILE_MAX_BYTES;
    *out = client;
    return LPC_OK;
}

void lpc_client_destroy(struct lpc_client **client)
{
    if (!client || !*client)
        return;
    curl_easy_cleanup((*client)->curl);
    free(*client);
    curl_global_cleanup();
    *client = NULL;
}

void lpc_answer_finish(struct lpc_answer *answer)
{
    free(answer->body);
    *answer = (struct lpc_answer){0};
}

/* ---- callbacks: libcurl's glue, hence the void pointers -----------------------------------------
 */

static void copy_header(char *out, size_t out_bytes, const char *value, size_t length)
{
    while (length && (*value == ' ' || *value == '\t')) {
        value++;
        length--;
    }
    while (length && (unsigned char)value[length - 1] <= ' ')
        length--;
    if (length < out_bytes) { /* a longer one is of no use cut off */
        memcpy(out, value, length);
        out[length] = '\0';
    }
}

static size_t on_header(char *data, size_t size, size_t count, void *user)
{
    struct transfer *transfer = user;
    struct lpc_answer *answer = transfer->answer;
    size_t bytes = size * count;
    if (bytes >= 5 && memcmp(data, "HTTP/", 5) == 0) { /* also after 100 Continue: begin again */
        answer->content_type[0] = answer->etag[0] = answer->request_id[0] = '\0';
        answer->location[0] = '\0';
        answer->retry_after_s = -1;
        return bytes;
    }
    const struct {
        const char *name;
        char *out;
        size_t out_bytes;
    } wanted[] = {
        {"content-type:", answer->content_type, sizeof answer->content_type},
        {"etag:", answer->etag, sizeof answer->etag},
        {"x-request-id:", answer->request_id, sizeof answer->request_id},
        {"location:", answer->location, sizeof answer->location},
    };
    for (size_t i = 0; i < sizeof wanted / sizeof wanted[0]; i++) {
        size_t length = strlen(wanted[i].name);
        if (bytes > length && strncasecmp(data, wanted[i].name, length) == 0)
            copy_header(wanted[i].out, wanted[i].out_bytes, data + length, bytes - length);
    }
    static const char retry_after[] = "retry-after:";
    size_t length = sizeof retry_after - 1;
    if (bytes > length && strncasecmp(data, retry_after, length) == 0) {
        char text[16] = "";
        char *end = text;
        copy_header(text, sizeof text, data + length, bytes - length);
        long seconds = strtol(text, &end, 10);
        if (end != text && *end == '\0' && seconds >= 0)
            answer->retry_after_s = seconds;
    }
    return bytes;
}

static bool keep_in_memory(struct transfer *transfer, const char *data, size_t bytes)
{
    struct lpc_answer *answer = transfer->answer;
    size_t limit = transfer->client->options.body_max_bytes;
    if (bytes > limit || answer->bytes > limit - bytes) {
        transfer->failure = LPC_LIMIT;
        return false;
    }
    size_t needed = answer->bytes + bytes + 1;
    if (needed > transfer->capacity) {
        size_t capacity = transfer->capacity ? transfer->capacity : BODY_FIRST_BYTES;
        while (capacity < needed)
            capacity = capacity > SIZE_MAX / 2 ? needed : capacity * 2;
        char *body = realloc(answer->body, capacity);
        if (!body) {
            transfer->failure = LPC_NO_MEMORY;
            return false;
        }
        answer->body = body;
        transfer->capacity = capacity;
    }
    memcpy(answer->body + answer->bytes, data, bytes);
    answer->bytes += bytes;
    answer->body[answer->bytes] = '\0';
    return true;
}

static bool keep_in_file(struct transfer *transfer, const char *data, size_t bytes)
{
    struct lpc_file_sink *sink = transfer->file;
    uint64_t limit = transfer->client->options.file_max_bytes;
    if (bytes > limit || sink->bytes > limit - bytes) {
        transfer->failure = LPC_LIMIT;
        return false;
    }
    if (fwrite(data, 1, bytes, sink->file->stream) != bytes) {
        sink->write_errno = errno;
        transfer->failure = LPC_IO;
        return false;
    }
    sha256_update(&sink->sha256, bytes, (const uint8_t *)data);
    sink->bytes += bytes;
    if (transfer->client->options.bytes_moved)
        atomic_fetch_add_explicit(transfer->client->options.bytes_moved, bytes,
                                  memory_order_relaxed);
    return true;
}

static size_t on_body(char *data, size_t size, size_t count, void *user)
{
    struct transfer *transfer = user;
    size_t bytes = size * count;
    long status = 0;
    curl_easy_getinfo(transfer->client->curl, CURLINFO_RESPONSE_CODE, &status);
    bool kept = transfer->file && status == 200 ? keep_in_file(transfer, data, bytes)
                                                : keep_in_memory(transfer, data, bytes);
    return kept ? bytes : 0;
}

static int on_progress(void *user, curl_off_t down_total, curl_off_t down, curl_off_t up_total,
                       curl_off_t up)
{
    (void)down_total;
    (void)down;
    (void)up_total;
    (void)up;
    struct transfer *transfer = user;
    const atomic_bool *cancelled = transfer->client->options.cancelled;
    if (!cancelled || !atomic_load_explicit(cancelled, memory_order_relaxed))
        return 0;
    transfer->failure = LPC_CANCELLED;
    return 1;
}

/* ---- one request -------------------------------------------------------------------------------
 */

static bool add_header(struct curl_slist **headers, const char *name, const char *value)
{
    char line[HEADER_BYTES];
    int length = snprintf(line, sizeof line, "%s: %s", name, value);
    if (length < 0 || (size_t)length >= sizeof line || strpbrk(line, "\r\n"))
        return false;
    struct curl_slist *longer = curl_slist_append(*headers, line);
    if (!longer)
        return false;
    *headers = longer;
    return true;
}

/* Every option of a transfer. curl_easy_setopt fails only when memory is out or an option is not
 * built in; a request that was set up by halves would fail in curl_easy_perform. */
static void set_up(CURL *curl, struct transfer *transfer, const struct lpc_request *request,
                   const char *url, struct curl_slist *headers)
{
    const struct lpc_client *client = transfer->client;
    curl_easy_reset(curl);
    curl_easy_setopt(curl, CURLOPT_URL, url);
    curl_easy_setopt(curl, CURLOPT_PROTOCOLS_STR, "http,https");
    curl_easy_setopt(curl, CURLOPT_PATH_AS_IS, 1L);
    curl_easy_setopt(curl, CURLOPT_NOSIGNAL, 1L);
    curl_easy_setopt(curl, CURLOPT_USERAGENT, "lightprobe-lpc");
    curl_easy_setopt(curl, CURLOPT_HTTPHEADER, headers);
    curl_easy_setopt(curl, CURLOPT_CONNECTTIMEOUT_MS, (long)client->options.connect_timeout_ms);
    curl_easy_setopt(curl, CURLOPT_TIMEOUT_MS, (long)client->options.timeout_ms);
    if (client->address.unix_path[0])
        curl_easy_setopt(curl, CURLOPT_UNIX_SOCKET_PATH, client->address.unix_path);
    if (client->address.loopback)
        curl_easy_setopt(curl, CURLOPT_PROXY, "");
    curl_easy_setopt(curl, CURLOPT_HEADERFUNCTION, on_header);
    curl_easy_setopt(curl, CURLOPT_HEADERDATA, transfer);
    curl_easy_setopt(curl, CURLOPT_WRITEFUNCTION, on_body);
    curl_easy_setopt(curl, CURLOPT_WRITEDATA, transfer);
    curl_easy_setopt(curl, CURLOPT_NOPROGRESS, 0L);
    curl_easy_setopt(curl, CURLOPT_XFERINFOFUNCTION, on_progress);
    curl_easy_setopt(curl, CURLOPT_XFERINFODATA, transfer);
    if (request->body) {
        curl_easy_setopt(curl, CURLOPT_POST, 1L);
        curl_easy_setopt(curl, CURLOPT_POSTFIELDS, request->body);
        curl_easy_setopt(curl, CURLOPT_POSTFIELDSIZE_LARGE, (curl_off_t)request->body_bytes);
    }
    if (request->method && strcmp(request->method, "HEAD") == 0)
        curl_easy_setopt(curl, CURLOPT_NOBODY, 1L);
    else if (request->method)
        curl_easy_setopt(curl, CURLOPT_CUSTOMREQUEST, request->method);
}

/* The sentence for a transfer that did not come to an end. */
static enum lpc_code transfer_failed(struct lpc_error *err, const struct transfer *transfer,
                                     CURLcode result, const char *path)
{
    const char *server = transfer->client->address.shown;
    const struct lpc_options *options = &transfer->client->options;
    if (transfer->failure == LPC_LIMIT)
        return lpc_fail(err, LPC_LIMIT,
                        "%s%s: the answer is larger than the %llu bytes this client takes", server,
                        path,
                        transfer->file ? (unsigned long long)options->file_max_bytes
                                       : (unsigned long long)options->body_max_bytes);
    if (transfer->failure == LPC_IO)
        return lpc_fail(err, LPC_IO, "%s: cannot be written: %s", transfer->file->file->path,
                        strerror(transfer->file->write_errno));
    if (transfer->failure == LPC_NO_MEMORY || result == CURLE_OUT_OF_MEMORY)
        return lpc_fail(err, LPC_NO_MEMORY, "%s%s: out of memory for the answer", server, path);
    if (transfer->failure == LPC_CANCELLED)
        return lpc_fail(err, LPC_CANCELLED, "%s%s: cancelled", server, path);
    switch (result) {
    case CURLE_COULDNT_CONNECT:
        return lpc_fail(err, LPC_UNREACHABLE,
                        "no daemon answers at %s: is it running? start one with `make serve`, or "
                        "name another with --server",
                        server);
    case CURLE_COULDNT_RESOLVE_HOST:
        return lpc_fail(err, LPC_UNREACHABLE,
                        "the host of %s is not known: check the name in --server", server);
    case CURLE_OPERATION_TIMEDOUT:
        return lpc_fail(err, LPC_TIMEOUT,
                        "%s%s gave no whole answer within %u ms: is the server busy or the job too "
                        "large for a synchronous call?",
                        server, path, options->timeout_ms);
    case CURLE_GOT_NOTHING:
    case CURLE_RECV_ERROR:
    case CURLE_PARTIAL_FILE:
    case CURLE_SEND_ERROR:
        return lpc_fail(err, LPC_UNREACHABLE,
                        "%s%s: the connection broke before the whole answer was here (%s): look "
                        "into the daemon's log",
                        server, path, curl_easy_strerror(result));
    default:
        return lpc_fail(err, LPC_PROTOCOL, "%s%s: %s: does a lightprobe daemon listen there?",
                        server, path, curl_easy_strerror(result));
    }
}

enum lpc_code lpc_transfer(struct lpc_client *client, struct lpc_answer *answer,
                           struct lpc_file_sink *sink, const struct lpc_request *request,
                           struct lpc_error *err)
{
    char url[URL_BYTES];
    if (request->path[0] != '/' || strpbrk(request->path, " \r\n"))
        return lpc_fail(err, LPC_INVALID, "\"%s\" is no path on a server: it starts with /",
                        request->path);
    int length = snprintf(url, sizeof url, "%s%s", client->address.base, request->path);
    if (length < 0 || (size_t)length >= sizeof url)
        return lpc_fail(err, LPC_INVALID, "%.80s...: the path is too long", request->path);

    enum lpc_code code;
    struct lpc_answer got = {.retry_after_s = -1};
    struct transfer transfer = {.client = client, .answer = &got, .file = sink};
    struct curl_slist *headers = NULL;
    if (!add_header(&headers, "Accept", request->accept ? request->accept : "application/json") ||
        (request->body && !add_header(&headers, "Content-Type", "application/json")) ||
        (request->if_none_match &&
         !add_header(&headers, "If-None-Match", request->if_none_match))) {
        code = lpc_fail(err, LPC_INVALID, "%s: a header's value is too long or has a line break",
                        request->path);
        goto out;
    }
    set_up(client->curl, &transfer, request, url, headers);
    CURLcode result = curl_easy_perform(client->curl);
    if (result != CURLE_OK) {
        code = transfer_failed(err, &transfer, result, request->path);
        goto out;
    }
    if (!got.body && !(got.body = calloc(1, 1))) {
        code = lpc_fail(err, LPC_NO_MEMORY, "%s: out of memory", request->path);
        goto out;
    }
    long status = 0;
    curl_easy_getinfo(client->curl, CURLINFO_RESPONSE_CODE, &status);
    got.status = (int)status;
    *answer = got;
    got.body = NULL;
    code = LPC_OK;
out:
    curl_slist_free_all(headers);
    free(got.body);
    return code;
}

const char *lpc_server_shown(const struct lpc_client *client)
{
    return client->address.shown;
}
