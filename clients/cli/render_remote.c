/* `lightprobe render` through a daemon: complete the job, post it, fetch its pictures. */
#include "clients/cli/render.h"

#include <stdlib.h>
#include <string.h>

#include "clients/cli/request.h"

#define NAMES_BYTES 200

/* The server's only ready scene; where there is a choice, a sentence that names it. */
static enum lp_code only_scene(char name[WIRE_NAME_BYTES], struct lpc_client *client,
                               struct lp_error *err)
{
    struct lpc_answer answer = {0};
    struct lpc_error trouble = {0};
    if (lpc_scenes(client, &answer, &trouble) != LPC_OK)
        return command_take_lpc(err, &trouble);
    struct wire_read *read = wire_read_open(answer.body, answer.bytes);
    const struct wire_value *scenes = wire_read_get(wire_read_root(read), "scenes");
    char names[NAMES_BYTES] = "";
    size_t used = 0, ready = 0;
    for (const struct wire_value *scene = wire_read_first(scenes); scene;
         scene = wire_read_next(scene)) {
        const char *one = wire_read_text(wire_read_get(scene, "name"));
        const char *state = wire_read_text(wire_read_get(scene, "state"));
        if (!one || !wire_name_ok(one) || !state || strcmp(state, "ready") != 0)
            continue;
        if (ready++ == 0)
            snprintf(name, WIRE_NAME_BYTES, "%s", one);
        int length = snprintf(names + used, sizeof names - used, "%s%s", used ? ", " : "", one);
        used = length < 0 || used + (size_t)length >= sizeof names ? sizeof names - 1
                                                                   : used + (size_t)length;
    }
    wire_read_close(&read);
    lpc_answer_finish(&answer);
    if (ready == 1)
        return LP_OK;
    if (ready == 0)
        return lp_fail(err, LP_NOT_FOUND, "",
                       "the daemon has no scene that is ready; see `lightprobe scenes`");
    return lp_fail(err, LP_INVALID, "--scene", "say which scene: the daemon has %s", names);
}

static enum lp_code suggested_probe(double point_m[3], struct lpc_client *client, const char *scene,
                                    struct lp_error *err)
{
    struct lpc_answer answer = {0};
    struct lpc_error trouble = {0};
    if (lpc_scene(client, &answer, scene, &trouble) != LPC_OK)
        return command_take_lpc(err, &trouble);
    struct wire_read *read = wire_read_open(answer.body, answer.bytes);
    const struct wire_value *one =
        wire_read_first(wire_read_get(wire_read_root(read), "suggested_probe"));
    int found = 0;
    while (one && found < 3 && wire_read_f64(&point_m[found], one)) {
        found++;
        one = wire_read_next(one);
    }
    wire_read_close(&read);
    lpc_answer_finish(&answer);
    if (found == 3)
        return LP_OK;
    return lp_fail(
        err, LP_INVALID, scene,
        "the daemon suggests no probe for this scene (is it ready?): give --probe x,y,z");
}

/* The document to post, and the scene that it names. */
static enum lp_code make_job(char **text, size_t *bytes, char scene[WIRE_NAME_BYTES],
                             struct lpc_client *client, const struct render_options *options,
                             struct lp_error *err)
{
    struct request request = {0};
    double point_m[3];
    enum lp_code code = request_open(&request, options, err);
    if (code != LP_OK)
        goto out;
    const char *named = request_scene(&request);
    if (!named && !wire_read_get(wire_read_root(request.read), "scene")) {
        code = only_scene(scene, client, err);
        if (code == LP_OK)
            code = request_set_scene(&request, scene, err);
    } else if (named && wire_name_ok(named)) {
        snprintf(scene, WIRE_NAME_BYTES, "%s", named);
    } else {
        code = lp_fail(err, LP_INVALID, options->scene ? "--scene" : "/scene",
                       "\"%.100s\" cannot be a scene's name: letters, digits, \".\", \"_\" and "
                       "\"-\", up to 100",
                       named ? named : "");
    }
    if (code == LP_OK && !request_has_probe(&request)) {
        code = suggested_probe(point_m, client, scene, err);
        if (code == LP_OK)
            code = request_set_probe(&request, point_m, err);
    }
    if (code == LP_OK)
        code = request_write(text, bytes, &request, err);
out:
    request_finish(&request);
    return code;
}

enum lp_code render_remote(struct render_outcome *outcome, const struct render_options *options,
                           struct lp_progress *progress, struct lp_error *err)
{
    struct lpc_client *client = NULL;
    struct lpc_answer answer = {0};
    struct lpc_error trouble = {0};
    char scene[WIRE_NAME_BYTES] = "";
    char *job = NULL;
    size_t job_bytes = 0;
    const struct lpc_options connection = {
        .server = options->server,
        .cancelled = &progress->cancelled,
        .bytes_moved = &progress->done,
    };
    enum lp_code code = LP_OK;
    if (lpc_client_create(&client, &connection, &trouble) != LPC_OK)
        return command_take_lpc(err, &trouble);
    code = make_job(&job, &job_bytes, scene, client, options, err);
    if (code != LP_OK)
        goto out;
    lp_progress_phase(progress, "waiting for the daemon", 0);
    if (lpc_render(client, &answer, job, job_bytes, NULL, &trouble) != LPC_OK) {
        code = command_take_lpc(err, &trouble);
        goto out;
    }
    code = render_make_folder(options->folder, err);
    if (code != LP_OK)
        goto out;
    lp_progress_phase(progress, "fetching pictures", 0);
    if (lpc_save_pictures(client, &outcome->pictures, answer.body, answer.bytes, options->folder,
                          scene, &trouble) != LPC_OK) {
        code = command_take_lpc(err, &trouble);
        goto out;
    }
    outcome->document = answer.body;
    outcome->document_bytes = answer.bytes;
    answer.body = NULL;
    code = render_write_document(options, outcome->document, outcome->document_bytes, err);
out:
    free(job);
    lpc_answer_finish(&answer);
    lpc_client_destroy(&client);
    return code;
}
