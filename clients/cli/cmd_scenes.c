/* `lightprobe scenes`: the scenes of a daemon as a table. */
#include "clients/cli/command.h"

#include <string.h>

#include "protocol/read.h"

static const char *count_field(char out[COMMAND_NUMBER_BYTES], const struct wire_value *scene,
                               const char *name)
{
    uint64_t value;
    if (!wire_read_u64(&value, wire_read_get(scene, name)))
        return "-";
    return command_count(out, value);
}

static const char *text_field(const struct wire_value *scene, const char *name)
{
    const char *text = wire_read_text(wire_read_get(scene, name));
    return text ? text : "";
}

static enum lp_code print_table(const struct lpc_answer *answer, const char *server,
                                struct lp_error *err)
{
    struct wire_read *read = wire_read_open(answer->body, answer->bytes);
    const struct wire_value *scenes = wire_read_get(wire_read_root(read), "scenes");
    if (!wire_read_is_array(scenes)) {
        wire_read_close(&read);
        return lp_fail(err, LP_IO, server,
                       "the answer has no list \"scenes\": does a lightprobe daemon listen there?");
    }
    if (wire_read_count(scenes) == 0)
        puts("no scenes; put a .lps file into the daemon's scenes folder");
    else
        printf("%-24s %-9s %14s %6s %10s %12s\n", "NAME", "STATE", "VOXELS", "DEPTH", "VOXEL",
               "SIZE");
    for (const struct wire_value *scene = wire_read_first(scenes); scene;
         scene = wire_read_next(scene)) {
        char n[2][COMMAND_NUMBER_BYTES], voxel[COMMAND_NUMBER_BYTES] = "-",
                                         size[COMMAND_NUMBER_BYTES] = "-";
        double voxel_m;
        uint64_t bytes;
        if (wire_read_f64(&voxel_m, wire_read_get(scene, "voxel_size_m")))
            snprintf(voxel, sizeof voxel, "%.4g m", voxel_m);
        if (wire_read_u64(&bytes, wire_read_get(scene, "bytes")))
            command_bytes(size, bytes);
        const char *reason = text_field(scene, "reason");
        printf("%-24s %-9s %14s %6s %10s %12s%s%s\n", text_field(scene, "name"),
               text_field(scene, "state"), count_field(n[0], scene, "voxels"),
               count_field(n[1], scene, "depth"), voxel, size, *reason ? "  " : "", reason);
    }
    wire_read_close(&read);
    return LP_OK;
}

int command_scenes(int argc, char **argv)
{
    bool json = false;
    const char *server = NULL;
    struct flag flags[] = {
        {.name = "server",
         .value = "URL",
         .kind = FLAG_TEXT,
         .to.text = &server,
         .help = "http://HOST:PORT or unix:PATH; default $LIGHTPROBE_SERVER or 127.0.0.1:8080"},
        {.name = "json", .kind = FLAG_SWITCH, .to.on = &json, .help = "the daemon's own document"},
    };
    struct flag_set set = {
        .usage = "lightprobe scenes [--server URL] [--json]",
        .summary = "Lists the scenes of a daemon.",
        .flags = flags,
        .flag_count = sizeof flags / sizeof flags[0],
    };
    struct lp_error err = {0};
    int count = 0;
    enum flags_answer answer = flags_read(&set, argc, argv, &count, &err);
    if (answer != FLAGS_READY)
        return command_after_flags("scenes", answer, &err);

    struct lpc_client *client = NULL;
    struct lpc_answer got = {0};
    struct lpc_error trouble = {0};
    const struct lpc_options options = {.server = command_server(server)};
    enum lp_code code = LP_OK;
    if (lpc_client_create(&client, &options, &trouble) != LPC_OK ||
        lpc_scenes(client, &got, &trouble) != LPC_OK)
        code = command_take_lpc(&err, &trouble);
    else if (json)
        code = command_print(got.body, got.bytes, &err);
    else
        code = print_table(&got, options.server, &err);
    lpc_answer_finish(&got);
    lpc_client_destroy(&client);
    return code == LP_OK ? COMMAND_DONE : command_failed(&err);
}
