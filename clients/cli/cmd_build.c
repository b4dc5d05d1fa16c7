/* `lightprobe build`: a source becomes a scene file. */
#include "clients/cli/command.h"

#include <errno.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <unistd.h>

#include "clients/cli/pool.h"
#include "clients/cli/reporter.h"
#include "engine/import.h"
#include "engine/scene_file.h"

#define PROCEDURAL "procedural:"
#define LENGTH_MAX 1e9 /* metres */
#define LENGTH_MIN 1e-9

struct build_options {
    const char *source, *out, *color, *filter_text;
    double size_m, height_m, voxel_m;
    uint64_t depth, threads;
    bool json, quiet;
    enum lp_filter filter;
    bool procedural;
    enum lp_procedural which;
};

static const char summary[] =
    "Makes a scene file. SOURCE is a square height map picture (8 or 16 bit; bright is high) or a\n"
    "procedural scene, procedural:room or procedural:sphere.\n\n"
    "  lightprobe build heights.png --color colors.jpg --size-m 8000 --height-m 500 -o hills.lps\n"
    "  lightprobe build procedural:room --depth 6 -o room.lps";

/* Whether `path` can become a file: found out before minutes of work. */
static enum lp_code check_output(const char *path, struct lp_error *err)
{
    char folder[4096];
    const char *slash = strrchr(path, '/');
    int length = slash ? (int)(slash - path) : 0;
    if (slash && length == 0)
        snprintf(folder, sizeof folder, "/");
    else if (slash && (size_t)length < sizeof folder)
        snprintf(folder, sizeof folder, "%.*s", length, path);
    else if (slash)
        return lp_fail(err, LP_INVALID, "--output", "the path is too long");
    else
        snprintf(folder, sizeof folder, ".");
    struct stat status;
    if (stat(folder, &status) != 0)
        return lp_fail(err, LP_IO, folder, "%s: make the folder first, or name another with -o",
                       strerror(errno));
    if (!S_ISDIR(status.st_mode))
        return lp_fail(err, LP_IO, folder, "is no folder: name another with -o");
    if (access(folder, W_OK | X_OK) != 0)
        return lp_fail(err, LP_IO, folder, "%s: name a folder with -o that you may write to",
                       strerror(errno));
    if (stat(path, &status) == 0 && !S_ISREG(status.st_mode))
        return lp_fail(err, LP_IO, path, "is there and is no file: name another with -o");
    return LP_OK;
}

/* What the flags mean together: LP_INVALID is wrong usage. */
static enum lp_code check_usage(struct build_options *options, struct lp_error *err)
{
    size_t length = options->out ? strlen(options->out) : 0;
    if (!options->out)
        return lp_fail(err, LP_INVALID, "-o", "say where the scene file goes: -o SCENE.lps");
    if (length < 5 || strcmp(options->out + length - 4, ".lps") != 0)
        return lp_fail(err, LP_INVALID, "-o", "a scene file's name ends in .lps");
    if (options->filter_text && strcmp(options->filter_text, "mean") == 0)
        options->filter = LP_FILTER_MEAN;
    else if (!options->filter_text || strcmp(options->filter_text, "visible") == 0)
        options->filter = LP_FILTER_VISIBLE;
    else
        return lp_fail(err, LP_INVALID, "--filter", "is mean or visible");
    options->procedural = strncmp(options->source, PROCEDURAL, strlen(PROCEDURAL)) == 0;
    if (options->procedural) {
        if (!lp_procedural_named(&options->which, options->source + strlen(PROCEDURAL)))
            return lp_fail(err, LP_INVALID, options->source,
                           "unknown; there are procedural:room and procedural:sphere");
        if (options->color || options->height_m > 0 || options->voxel_m > 0)
            return lp_fail(err, LP_INVALID, options->source,
                           "--color, --height-m and --voxel-m are for height maps");
        return LP_OK;
    }
    if (!(options->size_m > 0))
        return lp_fail(err, LP_INVALID, "--size-m", "say how many metres wide the area is");
    if (!(options->height_m > 0))
        return lp_fail(err, LP_INVALID, "--height-m",
                       "say how many metres high the brightest value is");
    return LP_OK;
}

/* Four fifths of the machine's memory: beyond that the system would end us, or somebody else. */
static uint64_t memory_limit_bytes(void)
{
    long pages = sysconf(_SC_PHYS_PAGES), page_bytes = sysconf(_SC_PAGESIZE);
    return pages > 0 && page_bytes > 0 ? (uint64_t)pages / 5 * 4 * (uint64_t)page_bytes : 0;
}

static enum lp_code import_source(void **bytes, size_t *byte_count,
                                  const struct build_options *options, struct pool *pool,
                                  struct lp_progress *progress, struct lp_error *err)
{
    if (options->procedural) {
        const struct lp_procedural_params params = {
            .which = options->which,
            .size_m = options->size_m,
            .depth = (uint8_t)options->depth,
            .filter = options->filter,
            .executor = pool_executor(pool),
            .progress = progress,
        };
        return lp_import_procedural(bytes, byte_count, &params, err);
    }
    const struct lp_heightmap_params params = {
        .height_path = options->source,
        .color_path = options->color,
        .size_m = options->size_m,
        .height_m = options->height_m,
        .voxel_m = options->voxel_m,
        .depth = (uint8_t)options->depth,
        .filter = options->filter,
        .memory_limit_bytes = memory_limit_bytes(),
        .executor = pool_executor(pool),
        .progress = progress,
    };
    return lp_import_heightmap(bytes, byte_count, &params, err);
}

static enum lp_code print_summary(const struct build_options *options, const void *bytes,
                                  size_t byte_count, double seconds, struct lp_error *err)
{
    struct lp_scene scene;
    enum lp_code code = lp_scene_view(&scene, bytes, byte_count, LP_TRUST_CONTENT, err);
    if (code != LP_OK)
        return code;
    uint64_t voxels = scene.tree.level_count[0];
    double per_voxel = voxels ? (double)byte_count / (double)voxels : 0;
    if (options->json) {
        struct wire_doc *doc = wire_doc_begin();
        wire_doc_text(doc, "file", options->out);
        wire_doc_u64(doc, "voxels", voxels);
        wire_doc_u64(doc, "nodes", scene.tree.node_count);
        wire_doc_u64(doc, "depth", scene.tree.depth);
        wire_doc_f64(doc, "voxel_size_m", scene.voxel_size_m);
        wire_doc_u64(doc, "bytes", byte_count);
        wire_doc_f64(doc, "bytes_per_voxel", per_voxel);
        wire_doc_f64(doc, "seconds", seconds);
        char *text = wire_doc_end(doc);
        if (!text)
            return lp_fail(err, LP_NO_MEMORY, "", "out of memory for the summary");
        code = command_print(text, strlen(text), err);
        free(text);
        return code;
    }
    if (options->quiet)
        return LP_OK;
    char n[4][COMMAND_NUMBER_BYTES];
    printf("%s: %s voxels, %s nodes, depth %u, voxel %g m, %s (%s bytes, %.2f a voxel), %.2f s\n",
           options->out, command_count(n[0], voxels), command_count(n[1], scene.tree.node_count),
           scene.tree.depth, scene.voxel_size_m, command_bytes(n[2], byte_count),
           command_count(n[3], byte_count), per_voxel, seconds);
    return LP_OK;
}

static enum lp_code build(const struct build_options *options, struct lp_error *err)
{
    struct lp_progress progress = {0};
    struct reporter reporter;
    struct pool *pool = NULL;
    void *bytes = NULL;
    size_t byte_count = 0;
    double start = command_seconds();
    enum lp_code code = check_output(options->out, err);
    if (code != LP_OK)
        return code;
    code =
        reporter_init(&reporter, &progress, options->quiet ? REPORTER_QUIET : REPORTER_AUTO, err);
    if (code != LP_OK)
        return code;
    code = pool_create(&pool, (uint32_t)options->threads, err);
    if (code == LP_OK)
        code = import_source(&bytes, &byte_count, options, pool, &progress, err);
    if (code == LP_OK && lp_progress_cancelled(&progress))
        code = lp_fail(err, LP_CANCELLED, "", "cancelled");
    if (code == LP_OK) {
        lp_progress_phase(&progress, "writing the file", 0);
        code = lp_scene_file_write(options->out, bytes, byte_count, err);
    }
    pool_destroy(&pool);
    reporter_finish(&reporter);
    if (code == LP_CANCELLED) {
        *err = (struct lp_error){0};
        lp_fail(err, LP_CANCELLED, options->out, "cancelled; nothing was written");
    }
    if (code == LP_OK)
        code = print_summary(options, bytes, byte_count, command_seconds() - start, err);
    free(bytes);
    return code;
}

int command_build(int argc, char **argv)
{
    struct build_options options = {0};
    struct flag flags[] = {
        {.name = "output",
         .letter = 'o',
         .value = "SCENE.lps",
         .kind = FLAG_TEXT,
         .help = "the file to write; its folder must be there",
         .to.text = &options.out},
        {.name = "color",
         .value = "FILE",
         .kind = FLAG_TEXT,
         .help = "picture of the same square, sRGB; default: grey by height",
         .to.text = &options.color},
        {.name = "size-m",
         .value = "X",
         .kind = FLAG_F64,
         .min = LENGTH_MIN,
         .max = LENGTH_MAX,
         .help = "edge of the area in metres (procedural: default 8)",
         .to.f64 = &options.size_m},
        {.name = "height-m",
         .value = "H",
         .kind = FLAG_F64,
         .min = LENGTH_MIN,
         .max = LENGTH_MAX,
         .help = "height in metres of the brightest value the format holds",
         .to.f64 = &options.height_m},
        {.name = "voxel-m",
         .value = "V",
         .kind = FLAG_F64,
         .min = LENGTH_MIN,
         .max = LENGTH_MAX,
         .help = "edge of a voxel in metres; default: size / 2^depth",
         .to.f64 = &options.voxel_m},
        {.name = "depth",
         .value = "D",
         .kind = FLAG_U64,
         .min = 1,
         .max = LP_HEIGHTMAP_DEPTH_MAX,
         .help = "the scene has 2^D voxels a side; 1 to 14, procedural 3 to 11; default 10",
         .to.u64 = &options.depth},
        {.name = "filter",
         .value = "KIND",
         .kind = FLAG_TEXT,
         .help = "colours of coarse nodes: visible (default) or mean",
         .to.text = &options.filter_text},
        {.name = "threads",
         .value = "N",
         .kind = FLAG_U64,
         .min = 1,
         .max = POOL_WIDTH_MAX,
         .help = "default: all processors",
         .to.u64 = &options.threads},
        {.name = "json",
         .kind = FLAG_SWITCH,
         .help = "the summary as JSON",
         .to.on = &options.json},
        {.name = "quiet",
         .kind = FLAG_SWITCH,
         .help = "no progress, no summary",
         .to.on = &options.quiet},
    };
    struct flag_set set = {
        .usage = "lightprobe build SOURCE -o SCENE.lps [flags]",
        .summary = summary,
        .flags = flags,
        .flag_count = sizeof flags / sizeof flags[0],
        .arguments_min = 1,
        .arguments_max = 1,
    };
    struct lp_error err = {0};
    int count = 0;
    enum flags_answer answer = flags_read(&set, argc, argv, &count, &err);
    if (answer != FLAGS_READY)
        return command_after_flags("build", answer, &err);
    options.source = argv[0];
    if (check_usage(&options, &err) != LP_OK)
        return command_misused("build", &err);
    return build(&options, &err) == LP_OK ? COMMAND_DONE : command_failed(&err);
}
