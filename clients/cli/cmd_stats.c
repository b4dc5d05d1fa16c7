/* `lightprobe stats`: how a daemon is doing. */
#include "clients/cli/command.h"

#include <stdlib.h>
#include <string.h>

#include "protocol/read.h"

#define PATH_BYTES  256
#define NESTING_MAX 8

/* Prints one line for each leaf: the document is the daemon's to extend, so nothing here knows its
 * fields. */
static void print_leaves(const struct wire_value *value, const char *path, unsigned nesting)
{
    size_t index = 0;
    if (nesting < NESTING_MAX && wire_read_count(value) > 0) {
        for (const struct wire_value *child = wire_read_first(value); child;
             child = wire_read_next(child), index++) {
            char longer[PATH_BYTES], number[24];
            const char *key = wire_read_key(child);
            snprintf(number, sizeof number, "%zu", index);
            snprintf(longer, sizeof longer, "%s%s%s", path, *path ? "." : "", key ? key : number);
            print_leaves(child, longer, nesting + 1);
        }
        return;
    }
    char count[COMMAND_NUMBER_BYTES];
    uint64_t u64;
    double f64;
    const char *text = wire_read_text(value);
    if (text) {
        printf("%-36s %s\n", path, text);
    } else if (wire_read_u64(&u64, value)) {
        printf("%-36s %s\n", path, command_count(count, u64));
    } else if (wire_read_f64(&f64, value)) {
        printf("%-36s %.6g\n", path, f64);
    } else {
        char *other = wire_read_print(value);
        printf("%-36s %s\n", path, other ? other : "");
        free(other);
    }
}

int command_stats(int argc, char **argv)
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
        .usage = "lightprobe stats [--server URL] [--json]",
        .summary = "Prints a daemon's statistics.",
        .flags = flags,
        .flag_count = sizeof flags / sizeof flags[0],
    };
    struct lp_error err = {0};
    int count = 0;
    enum flags_answer answer = flags_read(&set, argc, argv, &count, &err);
    if (answer != FLAGS_READY)
        return command_after_flags("stats", answer, &err);

    struct lpc_client *client = NULL;
    struct lpc_answer got = {0};
    struct lpc_error trouble = {0};
    struct wire_read *read = NULL;
    const struct lpc_options options = {.server = command_server(server)};
    enum lp_code code = LP_OK;
    if (lpc_client_create(&client, &options, &trouble) != LPC_OK ||
        lpc_stats(client, &got, &trouble) != LPC_OK) {
        code = command_take_lpc(&err, &trouble);
    } else if (json) {
        code = command_print(got.body, got.bytes, &err);
    } else {
        read = wire_read_open(got.body, got.bytes);
        if (wire_read_is_object(wire_read_root(read)))
            print_leaves(wire_read_root(read), "", 0);
        else
            code = lp_fail(&err, LP_IO, options.server,
                           "the answer is no document: does a lightprobe daemon listen there?");
    }
    wire_read_close(&read);
    lpc_answer_finish(&got);
    lpc_client_destroy(&client);
    return code == LP_OK ? COMMAND_DONE : command_failed(&err);
}
