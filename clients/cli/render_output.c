/* What `lightprobe render` leaves behind: the folder, the document, the summary for people. */
#include "clients/cli/render.h"

#include <errno.h>
#include <string.h>
#include <sys/stat.h>

#include "protocol/read.h"

#define PATH_BYTES 1024

enum lp_code render_make_folder(const char *folder, struct lp_error *err)
{
    struct stat status;
    if (mkdir(folder, 0777) == 0)
        return LP_OK;
    int reason = errno;
    if (reason == EEXIST && stat(folder, &status) == 0 && S_ISDIR(status.st_mode))
        return LP_OK;
    if (reason == EEXIST)
        return lp_fail(err, LP_IO, folder, "is there and is no folder: name another with -o");
    return lp_fail(err, LP_IO, folder, "the folder cannot be made: %s", strerror(reason));
}

enum lp_code render_write_document(const struct render_options *options, const char *text,
                                   size_t bytes, struct lp_error *err)
{
    char path[PATH_BYTES];
    struct lpc_error trouble = {0};
    int length = snprintf(path, sizeof path, "%s/result.json", options->folder);
    if (length < 0 || (size_t)length >= sizeof path)
        return lp_fail(err, LP_LIMIT, "-o", "the folder's path is too long");
    if (lpc_file_write(path, text, bytes, &trouble) != LPC_OK)
        return command_take_lpc(err, &trouble);
    return LP_OK;
}

static void print_count(const struct wire_value *counters, const char *name, const char *label)
{
    uint64_t value;
    char n[COMMAND_NUMBER_BYTES];
    if (wire_read_u64(&value, wire_read_get(counters, name)))
        printf("%-18s %s\n", label, command_count(n, value));
}

static void print_number(const struct wire_value *object, const char *name, const char *label,
                         const char *unit)
{
    double value;
    if (wire_read_f64(&value, wire_read_get(object, name)))
        printf("%-18s %.4g%s\n", label, value, unit);
}

static void print_histogram(const struct wire_value *classes, const char *label)
{
    if (wire_read_count(classes) == 0)
        return;
    printf("%-18s", label);
    for (const struct wire_value *one = wire_read_first(classes); one; one = wire_read_next(one)) {
        uint64_t value;
        char n[COMMAND_NUMBER_BYTES];
        if (wire_read_u64(&value, one))
            printf(" %s: %s ", wire_read_key(one), command_count(n, value));
    }
    putchar('\n');
}

static void print_probe(const struct wire_value *probe)
{
    const struct wire_value *counters = wire_read_get(probe, "counters");
    const struct wire_value *axis = wire_read_first(wire_read_get(probe, "position"));
    const char *film = wire_read_text(wire_read_get(probe, "film_sha256"));
    printf("%-18s ", "probe");
    for (int i = 0; axis && i < 3; i++, axis = wire_read_next(axis)) {
        double metres = 0;
        (void)wire_read_f64(&metres, axis);
        printf("%s%.9g", i ? "," : "", metres);
    }
    puts(" m");
    const struct wire_value *warnings = wire_read_get(probe, "warnings");
    for (const struct wire_value *one = wire_read_first(warnings); one; one = wire_read_next(one))
        printf("%-18s %s\n", "warning", wire_read_text(one) ? wire_read_text(one) : "");
    print_count(counters, "rays", "rays");
    print_count(counters, "rays_hit", "rays that hit");
    print_number(counters, "rays_per_pixel", "rays a pixel", "");
    print_count(counters, "traversal_steps", "traversal steps");
    print_count(counters, "pixels", "pixels");
    print_count(counters, "pixels_background", "background");
    print_histogram(wire_read_get(counters, "pixels_by_rays"), "pixels by rays");
    print_histogram(wire_read_get(counters, "pixels_by_level"), "pixels by level");
    if (film)
        printf("%-18s %s\n", "film_sha256", film);
}

enum lp_code render_print_summary(const struct render_outcome *outcome, const char *folder,
                                  struct lp_error *err)
{
    struct wire_read *read = wire_read_open(outcome->document, outcome->document_bytes);
    const struct wire_value *root = wire_read_root(read);
    const struct wire_value *probes = wire_read_get(root, "probes");
    if (!wire_read_is_array(probes)) {
        wire_read_close(&read);
        return lp_fail(err, LP_IO, folder, "result.json has no list \"probes\"");
    }
    const char *scene = wire_read_text(wire_read_get(wire_read_get(root, "scene"), "name"));
    printf("%-18s %s\n", "scene", scene ? scene : "");
    for (const struct wire_value *one = wire_read_first(probes); one; one = wire_read_next(one))
        print_probe(one);
    print_number(wire_read_get(root, "seconds"), "render", "render", " s");
    print_number(wire_read_get(root, "seconds"), "encode", "encode", " s");
    for (uint32_t i = 0; i < outcome->pictures.count; i++) {
        char n[COMMAND_NUMBER_BYTES];
        printf("%-18s %s (%s)\n", "picture", outcome->pictures.list[i].path,
               command_bytes(n, outcome->pictures.list[i].bytes));
    }
    printf("%-18s %s/result.json\n", "document", folder);
    wire_read_close(&read);
    return LP_OK;
}
