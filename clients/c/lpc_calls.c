/* The service's calls: render, scenes, statistics, and the sentences of its refusals. */
#include "clients/c/lpc_http.h"

#include <stdarg.h>
#include <string.h>

#include "protocol/read.h"
#include "protocol/wire.h"

#define ERRORS_SHOWN 4

/* Appends to text of `size` bytes; what does not fit is left out. */
static void append(char *text, size_t size, const char *format, ...)
    __attribute__((format(printf, 3, 4)));

static void append(char *text, size_t size, const char *format, ...)
{
    size_t used = strlen(text);
    va_list args;
    va_start(args, format);
    vsnprintf(text + used, size - used, format, args);
    va_end(args);
}

enum lpc_code lpc_refused(struct lpc_client *client, const struct lpc_answer *answer,
                          const char *path, struct lpc_error *err)
{
    struct wire_read *read = wire_read_open(answer->body, answer->bytes);
    const struct wire_value *root = wire_read_root(read);
    const char *detail = wire_read_text(wire_read_get(root, "detail"));
    const char *title = wire_read_text(wire_read_get(root, "title"));
    const char *type = wire_read_text(wire_read_get(root, "type"));
    const char *slug = type && strrchr(type, '/') ? strrchr(type, '/') + 1 : "";
    char text[LPC_ERROR_TEXT_BYTES] = "";

    append(text, sizeof text, "%s%s: %d", lpc_server_shown(client), path, answer->status);
    if (*slug)
        append(text, sizeof text, " %s", slug);
    const struct wire_value *errors = wire_read_get(root, "errors");
    if (wire_read_count(errors) > 0)
        append(text, sizeof text, ":"); /* the detail only sums up the offenders */
    else if (detail || title)
        append(text, sizeof text, ": %s", detail ? detail : title);
    else
        append(text, sizeof text, ": does a lightprobe daemon listen there?");
    uint32_t shown = 0;
    for (const struct wire_value *one = wire_read_first(errors); one && shown < ERRORS_SHOWN;
         one = wire_read_next(one), shown++) {
        const char *pointer = wire_read_text(wire_read_get(one, "pointer"));
        const char *what = wire_read_text(wire_read_get(one, "detail"));
        append(text, sizeof text, "%s %s: %s", shown ? ";" : "",
               pointer && *pointer ? pointer : "the document", what ? what : "wrong");
    }
    if (wire_read_count(errors) > shown)
        append(text, sizeof text, "; and %zu more", wire_read_count(errors) - shown);
    if (answer->retry_after_s >= 0)
        append(text, sizeof text, "; try again in %lld s", (long long)answer->retry_after_s);
    if (answer->status >= 500 && answer->request_id[0])
        append(text, sizeof text, " (request %s)", answer->request_id);

    if (err && err->code == LPC_OK) {
        err->status = answer->status;
        snprintf(err->problem, sizeof err->problem, "%s", slug);
    }
    enum lpc_code code = lpc_fail(err, LPC_REFUSED, "%s", text);
    wire_read_close(&read);
    return code;
}

enum lpc_code lpc_send(struct lpc_client *client, struct lpc_answer *answer,
                       const struct lpc_request *request, struct lpc_error *err)
{
    return lpc_transfer(client, answer, NULL, request, err);
}

enum lpc_code lpc_ask(struct lpc_client *client, struct lpc_answer *answer,
                      const struct lpc_request *request, struct lpc_error *err)
{
    struct lpc_answer got = {0};
    enum lpc_code code = lpc_send(client, &got, request, err);
    if (code != LPC_OK)
        return code;
    if (got.status < 200 || got.status > 202) {
        code = lpc_refused(client, &got, request->path, err);
        lpc_answer_finish(&got);
        return code;
    }
    *answer = got;
    return LPC_OK;
}

enum lpc_code lpc_render(struct lpc_client *client, struct lpc_answer *answer, const char *job,
                         size_t job_bytes, const char *accept, struct lpc_error *err)
{
    const struct lpc_request request = {
        .path = "/v1/render", .accept = accept, .body = job, .body_bytes = job_bytes};
    return lpc_ask(client, answer, &request, err);
}

enum lpc_code lpc_scenes(struct lpc_client *client, struct lpc_answer *answer,
                         struct lpc_error *err)
{
    return lpc_ask(client, answer, &(struct lpc_request){.path = "/v1/scenes"}, err);
}

enum lpc_code lpc_scene(struct lpc_client *client, struct lpc_answer *answer, const char *name,
                        struct lpc_error *err)
{
    if (!wire_name_ok(name))
        return lpc_fail(err, LPC_INVALID,
                        "\"%.100s\" cannot be a scene's name: letters, digits, \".\", \"_\" and "
                        "\"-\", up to 100, the first a letter or digit",
                        name);
    char path[sizeof "/v1/scenes/" + WIRE_NAME_BYTES];
    snprintf(path, sizeof path, "/v1/scenes/%s", name);
    return lpc_ask(client, answer, &(struct lpc_request){.path = path}, err);
}

enum lpc_code lpc_stats(struct lpc_client *client, struct lpc_answer *answer, struct lpc_error *err)
{
    return lpc_ask(client, answer, &(struct lpc_request){.path = "/v1/stats"}, err);
}
