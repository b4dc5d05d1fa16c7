/* A job's document made of a request file and flags. */
#include "clients/cli/request.h"

#include <ctype.h>
#include <errno.h>
#include <stdlib.h>
#include <string.h>

#define LIST_BYTES  512
#define POINT_BYTES 128

static enum lp_code read_file(char **out, size_t *out_bytes, const char *path, struct lp_error *err)
{
    bool standard = strcmp(path, "-") == 0;
    const char *where = standard ? "standard input" : path;
    FILE *file = standard ? stdin : fopen(path, "rb");
    char *text = NULL;
    enum lp_code code = LP_OK;
    if (!file)
        return lp_fail(err, LP_IO, where, "%s: name the job's document with --request",
                       strerror(errno));
    text = malloc((size_t)WIRE_BODY_MAX + 1);
    if (!text) {
        code = lp_fail(err, LP_NO_MEMORY, where, "out of memory for the document");
        goto out;
    }
    size_t bytes = fread(text, 1, (size_t)WIRE_BODY_MAX + 1, file);
    if (ferror(file)) {
        code = lp_fail(err, LP_IO, where, "cannot be read: %s", strerror(errno));
        goto out;
    }
    if (bytes > WIRE_BODY_MAX) {
        code =
            lp_fail(err, LP_LIMIT, where, "a job's document has at most %u bytes", WIRE_BODY_MAX);
        goto out;
    }
    *out = text;
    *out_bytes = bytes;
    text = NULL;
out:
    free(text);
    if (!standard)
        fclose(file);
    return code;
}

/* "a,b" as ["a","b"]. False for signs that no name of the contract has. */
static bool list_json(char out[LIST_BYTES], const char *list)
{
    size_t used = 0;
    out[used++] = '[';
    out[used++] = '"';
    for (const char *at = list; *at; at++) {
        bool plain = isalnum((unsigned char)*at) || strchr("+-._", *at);
        if ((!plain && *at != ',') || used + 8 > LIST_BYTES)
            return false;
        if (plain)
            out[used++] = *at;
        else
            used += (size_t)snprintf(out + used, LIST_BYTES - used, "\",\"");
    }
    snprintf(out + used, LIST_BYTES - used, "\"]");
    return true;
}

static enum lp_code not_set(const char *name, struct lp_error *err)
{
    return lp_fail(err, LP_INVALID, "--request",
                   "the document is no JSON object, so \"%s\" cannot be set in it", name);
}

static enum lp_code set_text(struct request *request, const char *name, const char *value,
                             struct lp_error *err)
{
    if (!value)
        return LP_OK;
    request->changed = true;
    return wire_read_set_text(request->read, name, value) ? LP_OK : not_set(name, err);
}

static enum lp_code set_json(struct request *request, const char *name, const char *json,
                             struct lp_error *err)
{
    request->changed = true;
    return wire_read_set_json(request->read, name, json) ? LP_OK : not_set(name, err);
}

static enum lp_code set_u64(struct request *request, const char *name, uint64_t value, bool given,
                            struct lp_error *err)
{
    char json[32];
    snprintf(json, sizeof json, "%llu", (unsigned long long)value);
    return given ? set_json(request, name, json, err) : LP_OK;
}

static enum lp_code set_list(struct request *request, const char *name, const char *flag,
                             const char *list, struct lp_error *err)
{
    char json[LIST_BYTES];
    if (!list)
        return LP_OK;
    if (!list_json(json, list))
        return lp_fail(err, LP_INVALID, flag, "\"%.40s\" is no list such as a,b", list);
    return set_json(request, name, json, err);
}

static enum lp_code set_flags(struct request *request, const struct render_options *options,
                              struct lp_error *err)
{
    enum lp_code code = set_text(request, "scene", options->scene, err);
    if (code == LP_OK)
        code = set_text(request, "lighting", options->lighting, err);
    if (code == LP_OK)
        code = set_text(request, "mode", options->mode, err);
    if (code == LP_OK)
        code = set_text(request, "levels", options->levels, err);
    if (code == LP_OK)
        code = set_u64(request, "face_px", options->face_px, options->face_px_given, err);
    if (code == LP_OK)
        code = set_u64(request, "samples_per_axis", options->samples_per_axis,
                       options->samples_given, err);
    if (code == LP_OK)
        code = set_u64(request, "seed", options->seed, options->seed_given, err);
    if (code == LP_OK)
        code = set_list(request, "faces", "--faces", options->faces, err);
    if (code == LP_OK)
        code = set_list(request, "images", "--format", options->formats, err);
    if (code == LP_OK && options->probe_given)
        code = request_set_probe(request, options->probe_m, err);
    if (code == LP_OK && options->environment_given) {
        char json[POINT_BYTES];
        snprintf(json, sizeof json, "{\"constant\":[%.17g,%.17g,%.17g]}", options->environment[0],
                 options->environment[1], options->environment[2]);
        code = set_json(request, "environment", json, err);
    }
    return code;
}

enum lp_code request_open(struct request *request, const struct render_options *options,
                          struct lp_error *err)
{
    if (options->request) {
        enum lp_code code = read_file(&request->text, &request->bytes, options->request, err);
        if (code != LP_OK)
            return code;
        /* The strict judge looks first: afterwards it would see what the lenient reader made. */
        struct wire_job job;
        struct wire_problem *problem = calloc(1, sizeof *problem);
        if (!problem)
            return lp_fail(err, LP_NO_MEMORY, options->request, "out of memory");
        if (wire_job_read(&job, problem, request->text, request->bytes) ==
            WIRE_PROBLEM_INVALID_JSON)
            code = command_take_problem(err, options->request, problem);
        free(problem);
        if (code != LP_OK)
            return code;
        request->read = wire_read_open(request->text, request->bytes);
    } else {
        request->read = wire_read_open("{}", 2);
        request->changed = true;
    }
    if (!request->read)
        return lp_fail(err, LP_NO_MEMORY, options->request ? options->request : "",
                       "out of memory for the document");
    return set_flags(request, options, err);
}

void request_finish(struct request *request)
{
    wire_read_close(&request->read);
    free(request->text);
    *request = (struct request){0};
}

const char *request_scene(const struct request *request)
{
    return wire_read_text(wire_read_get(wire_read_root(request->read), "scene"));
}

bool request_has_probe(const struct request *request)
{
    const struct wire_value *root = wire_read_root(request->read);
    return wire_read_get(root, "probes") || wire_read_get(root, "grid");
}

enum lp_code request_set_scene(struct request *request, const char *name, struct lp_error *err)
{
    return set_text(request, "scene", name, err);
}

enum lp_code request_set_probe(struct request *request, const double point_m[3],
                               struct lp_error *err)
{
    char json[POINT_BYTES];
    snprintf(json, sizeof json, "[[%.17g,%.17g,%.17g]]", point_m[0], point_m[1], point_m[2]);
    return set_json(request, "probes", json, err);
}

enum lp_code request_write(char **text, size_t *bytes, const struct request *request,
                           struct lp_error *err)
{
    char *made;
    if (request->changed) {
        made = wire_read_print(wire_read_root(request->read));
        *bytes = made ? strlen(made) : *bytes;
    } else {
        made = malloc(request->bytes + 1);
        if (made) {
            memcpy(made, request->text, request->bytes);
            made[request->bytes] = '\0';
            *bytes = request->bytes;
        }
    }
    if (!made)
        return lp_fail(err, LP_NO_MEMORY, "", "out of memory for the job's document");
    *text = made;
    return LP_OK;
}
