/* `lightprobe render` on a scene file: plan, tiles, pictures, document. */
#include "clients/cli/render.h"

#include <stdlib.h>
#include <string.h>

#include "clients/cli/request.h"
#include "clients/cli/scene_info.h"
#include "clients/cli/tiles.h"
#include "engine/image.h"

#define FILM_ALIGN 64

/* The job's document, with the file's own name and suggested probe where it names none. */
static enum lp_code make_job(struct wire_job *job, const struct render_options *options,
                             const struct wire_scene *scene, struct lp_error *err)
{
    struct request request = {0};
    struct wire_problem *problem = calloc(1, sizeof *problem);
    char *text = NULL;
    size_t bytes = 0;
    enum lp_code code = LP_OK;
    if (!problem) {
        code = lp_fail(err, LP_NO_MEMORY, "", "out of memory");
        goto out;
    }
    code = request_open(&request, options, err);
    if (code != LP_OK)
        goto out;
    const struct wire_value *root = wire_read_root(request.read);
    if (wire_read_is_object(root) && !wire_read_get(root, "scene"))
        code = request_set_scene(&request, scene->name, err);
    if (code == LP_OK && wire_read_is_object(root) && !request_has_probe(&request))
        code = request_set_probe(&request, scene->suggested_probe_m, err);
    if (code == LP_OK)
        code = request_write(&text, &bytes, &request, err);
    if (code != LP_OK)
        goto out;
    if (wire_job_read(job, problem, text, bytes) != WIRE_PROBLEM_NONE)
        code = command_take_problem(err, options->request ? options->request : "the job", problem);
    else if (strcmp(job->scene, scene->name) != 0)
        code = lp_fail(err, LP_INVALID, options->request ? options->request : "--scene",
                       "the job is for scene \"%s\", but the file is %s: they have to agree",
                       job->scene, options->file);
out:
    free(text);
    free(problem);
    request_finish(&request);
    return code;
}

static enum lp_code save_picture(struct render_outcome *outcome, struct wire_probe *probe,
                                 const struct lp_film *film, const struct wire_job *job,
                                 enum wire_image image, const char *folder, struct lp_error *err)
{
    static const enum lp_image_format formats[WIRE_IMAGE_KINDS] = {
        [WIRE_IMAGE_PNG] = LP_IMAGE_PNG, [WIRE_IMAGE_EXR] = LP_IMAGE_EXR};
    struct lpc_error trouble = {0};
    struct bake_picture picture = {0};
    struct lpc_picture *saved = &outcome->pictures.list[outcome->pictures.count];
    struct wire_image_ref *ref = &probe->images[probe->image_count];
    int length = snprintf(ref->href, sizeof ref->href, "%s.%s", job->scene,
                          lp_image_extension(formats[image]));
    if (length < 0 || (size_t)length >= sizeof ref->href)
        return lp_fail(err, LP_LIMIT, job->scene, "the name is too long for a file's");
    length = snprintf(saved->path, sizeof saved->path, "%s/%s", folder, ref->href);
    if (length < 0 || (size_t)length >= sizeof saved->path)
        return lp_fail(err, LP_LIMIT, "-o", "the folder's path is too long");
    enum lp_code code = bake_picture(&picture, film, job->layout, image, err);
    if (code != LP_OK)
        return code;
    if (lpc_file_write(saved->path, picture.data, picture.bytes, &trouble) != LPC_OK) {
        code = command_take_lpc(err, &trouble);
    } else {
        memcpy(ref->sha256, picture.sha256, sizeof ref->sha256);
        ref->bytes = saved->bytes = picture.bytes;
        probe->image_count++;
        outcome->pictures.count++;
    }
    free(picture.data);
    return code;
}

/* Renders the plan and saves its pictures; fills probe and seconds of `result`. */
static enum lp_code render_plan(struct render_outcome *outcome, struct wire_result *result,
                                const struct lp_render_plan *plan,
                                const struct render_options *options, struct lp_progress *progress,
                                struct lp_error *err)
{
    struct pool *pool = NULL;
    struct lp_film film;
    struct lp_counters counters;
    size_t film_bytes;
    void *memory = NULL;
    if (lp_size_add(plan->film_bytes, FILM_ALIGN - 1, &film_bytes))
        memory = aligned_alloc(FILM_ALIGN, film_bytes / FILM_ALIGN * FILM_ALIGN);
    if (!memory)
        return lp_fail(err, LP_NO_MEMORY, "--face-px",
                       "out of memory for a film of %zu bytes: ask for fewer texels or faces",
                       plan->film_bytes);
    lp_film_init(&film, plan, memory);
    enum lp_code code = pool_create(&pool, (uint32_t)options->threads, err);
    if (code != LP_OK)
        goto out;
    double start = command_seconds();
    code = tiles_render(&film, &counters, plan, pool, progress, err);
    if (code != LP_OK)
        goto out;
    result->render_s = command_seconds() - start;

    start = command_seconds();
    lp_progress_phase(progress, "encoding pictures", 0);
    bake_probe(&result->probe, plan, &counters, &film);
    result->probe.image_count = 0;
    for (int image = 0; image < WIRE_IMAGE_KINDS && code == LP_OK; image++) {
        if (lp_progress_cancelled(progress))
            code = lp_fail(err, LP_CANCELLED, "", "cancelled");
        else if (result->request.images[image])
            code = save_picture(outcome, &result->probe, &film, &result->request,
                                (enum wire_image)image, options->folder, err);
    }
    result->encode_s = command_seconds() - start;
out:
    pool_destroy(&pool);
    free(memory);
    return code;
}

enum lp_code render_local(struct render_outcome *outcome, const struct render_options *options,
                          struct lp_progress *progress, struct lp_error *err)
{
    struct lp_scene_file file = {0};
    struct bake_scene info = {0};
    struct lp_render_plan plan;
    struct wire_problem *problem = calloc(1, sizeof *problem);
    struct wire_result *result = calloc(1, sizeof *result);
    enum lp_code code = LP_OK;
    if (!problem || !result) {
        code = lp_fail(err, LP_NO_MEMORY, "", "out of memory");
        goto out;
    }
    lp_progress_phase(progress, "checking the scene", 0);
    code = scene_info_open(&info, &file, options->file, err);
    if (code != LP_OK)
        goto out;
    if (!wire_name_ok(info.scene.name)) {
        code = lp_fail(err, LP_INVALID, options->file,
                       "the file's name without .lps is the scene's name and has to be made of "
                       "letters, digits, \".\", \"_\" and \"-\" (up to 100): rename the file");
        goto out;
    }
    code = make_job(&result->request, options, &info.scene, err);
    if (code != LP_OK)
        goto out;
    if (bake_plan(&plan, problem, &file.scene, &result->request) != WIRE_PROBLEM_NONE) {
        code = command_take_problem(err, options->request ? options->request : "the job", problem);
        goto out;
    }
    code = render_make_folder(options->folder, err);
    if (code == LP_OK)
        code = render_plan(outcome, result, &plan, options, progress, err);
    if (code != LP_OK)
        goto out;
    snprintf(result->id, sizeof result->id, "local");
    memcpy(result->scene_sha256, info.scene.sha256, sizeof result->scene_sha256);
    snprintf(result->engine, sizeof result->engine, "%s", LP_VERSION);
    snprintf(result->kernel, sizeof result->kernel, "scalar");
    outcome->document = wire_result_write(result);
    if (!outcome->document) {
        code = lp_fail(err, LP_NO_MEMORY, "", "out of memory for the document");
        goto out;
    }
    outcome->document_bytes = strlen(outcome->document);
    code = render_write_document(options, outcome->document, outcome->document_bytes, err);
out:
    lp_scene_file_close(&file);
    free(result);
    free(problem);
    return code;
}
