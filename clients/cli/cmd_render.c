/* `lightprobe render`: bakes a light probe, from a scene file or through a daemon. */
#include "clients/cli/render.h"

#include <stdlib.h>
#include <string.h>

#include "clients/cli/pool.h"

#define METRES_MAX   1e12
#define RADIANCE_MAX 1e30
#define SEED_MAX     9007199254740992.0 /* 2^53 */

static const char summary[] =
    "Bakes one light probe and writes its pictures and result.json into DIR, which is made where\n"
    "absent. The job comes from a document (--request), from flags, or from both: flags win. "
    "Without\n"
    "a probe it is the scene's suggested one.\n\n"
    "  lightprobe render hills.lps --mode lod --face-px 256 --format png,exr -o out\n"
    "  lightprobe render --server http://127.0.0.1:8080 --scene hills --probe 0,120,0 -o out";

enum {
    FLAG_OUTPUT,
    FLAG_REQUEST,
    FLAG_SERVER,
    FLAG_SCENE,
    FLAG_LIGHTING,
    FLAG_PROBE,
    FLAG_MODE,
    FLAG_LEVELS,
    FLAG_FACE_PX,
    FLAG_FACES,
    FLAG_SAMPLES,
    FLAG_ENVIRONMENT,
    FLAG_SEED,
    FLAG_FORMAT,
    FLAG_THREADS,
    FLAG_JSON,
    FLAG_QUIET,
    FLAG_COUNT
};

static enum lp_code check_usage(struct render_options *options, struct lp_error *err)
{
    if (!options->folder)
        return lp_fail(err, LP_INVALID, "-o", "say where the pictures go: -o DIR");
    if (options->file && options->server)
        return lp_fail(err, LP_INVALID, "--server",
                       "give a scene file or a server, not both (a server's scene: --scene NAME)");
    const char *environment = getenv("LIGHTPROBE_SERVER");
    if (!options->file && !options->server && !(environment && *environment))
        return lp_fail(err, LP_INVALID, "", "say what to render: SCENE.lps, or --server URL");
    if (!options->file) {
        options->server = command_server(options->server);
        if (options->threads)
            return lp_fail(err, LP_INVALID, "--threads",
                           "is for scene files: the daemon has its own");
    }
    return LP_OK;
}

static enum lp_code render(const struct render_options *options, struct lp_error *err)
{
    struct lp_progress progress = {0};
    struct reporter reporter;
    struct render_outcome *outcome = calloc(1, sizeof *outcome);
    if (!outcome)
        return lp_fail(err, LP_NO_MEMORY, "", "out of memory");
    enum lp_code code =
        reporter_init(&reporter, &progress, options->quiet ? REPORTER_QUIET : REPORTER_AUTO, err);
    if (code != LP_OK) {
        free(outcome);
        return code;
    }
    code = options->file ? render_local(outcome, options, &progress, err)
                         : render_remote(outcome, options, &progress, err);
    reporter_finish(&reporter);
    if (code == LP_OK && options->json)
        code = command_print(outcome->document, outcome->document_bytes, err);
    else if (code == LP_OK && !options->quiet)
        code = render_print_summary(outcome, options->folder, err);
    free(outcome->document);
    free(outcome);
    return code;
}

int command_render(int argc, char **argv)
{
    struct render_options o = {0};
    struct flag flags[FLAG_COUNT] = {
        [FLAG_OUTPUT] = {.name = "output",
                         .letter = 'o',
                         .value = "DIR",
                         .kind = FLAG_TEXT,
                         .to.text = &o.folder,
                         .help = "the folder for pictures and result.json"},
        [FLAG_REQUEST] = {.name = "request",
                          .value = "JOB.json",
                          .kind = FLAG_TEXT,
                          .to.text = &o.request,
                          .help = "the job's document; - reads standard input"},
        [FLAG_SERVER] = {.name = "server",
                         .value = "URL",
                         .kind = FLAG_TEXT,
                         .to.text = &o.server,
                         .help = "http://HOST:PORT or unix:PATH"},
        [FLAG_SCENE] = {.name = "scene",
                        .value = "NAME",
                        .kind = FLAG_TEXT,
                        .to.text = &o.scene,
                        .help = "a scene of the server; default: its only one"},
        [FLAG_LIGHTING] = {.name = "lighting",
                           .value = "NAME",
                           .kind = FLAG_TEXT,
                           .to.text = &o.lighting,
                           .help = "default albedo"},
        [FLAG_PROBE] = {.name = "probe",
                        .value = "x,y,z",
                        .kind = FLAG_TRIPLE,
                        .to.triple = o.probe_m,
                        .min = -METRES_MAX,
                        .max = METRES_MAX,
                        .help = "where, in metres of the world; default: the suggested place"},
        [FLAG_MODE] = {.name = "mode",
                       .value = "MODE",
                       .kind = FLAG_TEXT,
                       .to.text = &o.mode,
                       .help = "reference or lod"},
        [FLAG_LEVELS] = {.name = "levels",
                         .value = "WHICH",
                         .kind = FLAG_TEXT,
                         .to.text = &o.levels,
                         .help = "cone (default) or fixed"},
        [FLAG_FACE_PX] = {.name = "face-px",
                          .value = "N",
                          .kind = FLAG_U64,
                          .to.u64 = &o.face_px,
                          .min = 1,
                          .max = 4096,
                          .help = "edge of a face in texels; default 64"},
        [FLAG_FACES] = {.name = "faces",
                        .value = "LIST",
                        .kind = FLAG_TEXT,
                        .to.text = &o.faces,
                        .help = "some of +X,-X,+Y,-Y,+Z,-Z; default all"},
        [FLAG_SAMPLES] = {.name = "samples-per-axis",
                          .value = "N",
                          .kind = FLAG_U64,
                          .to.u64 = &o.samples_per_axis,
                          .min = 1,
                          .max = 32,
                          .help = "mode reference: N x N rays a texel; default 4"},
        [FLAG_ENVIRONMENT] = {.name = "environment",
                              .value = "r,g,b",
                              .kind = FLAG_TRIPLE,
                              .to.triple = o.environment,
                              .min = 0,
                              .max = RADIANCE_MAX,
                              .help = "linear radiance of what lies beyond the scene"},
        [FLAG_SEED] = {.name = "seed",
                       .value = "N",
                       .kind = FLAG_U64,
                       .to.u64 = &o.seed,
                       .min = 0,
                       .max = SEED_MAX,
                       .help = "default 0"},
        [FLAG_FORMAT] = {.name = "format",
                         .value = "LIST",
                         .kind = FLAG_TEXT,
                         .to.text = &o.formats,
                         .help = "some of png,exr; default png"},
        [FLAG_THREADS] = {.name = "threads",
                          .value = "N",
                          .kind = FLAG_U64,
                          .to.u64 = &o.threads,
                          .min = 1,
                          .max = POOL_WIDTH_MAX,
                          .help = "on a file; default: all processors"},
        [FLAG_JSON] = {.name = "json",
                       .kind = FLAG_SWITCH,
                       .to.on = &o.json,
                       .help = "print the result's document"},
        [FLAG_QUIET] = {.name = "quiet",
                        .kind = FLAG_SWITCH,
                        .to.on = &o.quiet,
                        .help = "no progress, no summary"},
    };
    struct flag_set set = {
        .usage = "lightprobe render (SCENE.lps | --server URL) -o DIR [flags]",
        .summary = summary,
        .flags = flags,
        .flag_count = FLAG_COUNT,
        .arguments_max = 1,
    };
    struct lp_error err = {0};
    int count = 0;
    enum flags_answer answer = flags_read(&set, argc, argv, &count, &err);
    if (answer != FLAGS_READY)
        return command_after_flags("render", answer, &err);
    o.file = count ? argv[0] : NULL;
    o.face_px_given = flags[FLAG_FACE_PX].given;
    o.samples_given = flags[FLAG_SAMPLES].given;
    o.seed_given = flags[FLAG_SEED].given;
    o.probe_given = flags[FLAG_PROBE].given;
    o.environment_given = flags[FLAG_ENVIRONMENT].given;
    if (check_usage(&o, &err) != LP_OK)
        return command_misused("render", &err);
    return render(&o, &err) == LP_OK ? COMMAND_DONE : command_failed(&err);
}
