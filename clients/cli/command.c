/* How commands speak to people: failures as one line, numbers with units. */
#include "clients/cli/command.h"

#include <errno.h>
#include <stdarg.h>
#include <stdlib.h>
#include <string.h>
#include <time.h>

#define SERVER_DEFAULT "http://127.0.0.1:8080"

static void print_error(const char *command, const struct lp_error *err)
{
    const char *text = err->text[0] ? err->text : lp_code_text(err->code);
    fprintf(stderr, "lightprobe%s%s: %s%s%s\n", command ? " " : "", command ? command : "",
            err->where, err->where[0] ? ": " : "", text);
}

int command_failed(const struct lp_error *err)
{
    print_error(NULL, err);
    return COMMAND_FAILED;
}

int command_misused(const char *name, const struct lp_error *err)
{
    print_error(name, err);
    return COMMAND_USAGE;
}

int command_after_flags(const char *name, enum flags_answer answer, const struct lp_error *err)
{
    return answer == FLAGS_HELP ? COMMAND_DONE : command_misused(name, err);
}

enum lp_code command_take_lpc(struct lp_error *err, const struct lpc_error *from)
{
    static const struct {
        enum lpc_code from;
        enum lp_code to;
    } codes[] = {
        {LPC_INVALID, LP_INVALID},     {LPC_LIMIT, LP_LIMIT},         {LPC_NO_MEMORY, LP_NO_MEMORY},
        {LPC_CANCELLED, LP_CANCELLED}, {LPC_REFUSED, LP_UNSUPPORTED},
    };
    enum lp_code code = LP_IO;
    for (size_t i = 0; i < sizeof codes / sizeof codes[0]; i++)
        if (codes[i].from == from->code)
            code = codes[i].to;
    return lp_fail(err, code, "", "%s", from->text);
}

enum lp_code command_take_problem(struct lp_error *err, const char *where,
                                  const struct wire_problem *problem)
{
    char text[LP_ERROR_TEXT_BYTES];
    size_t used = 0;
    /* The detail sums up the first offender: it is said only where there are none. */
    if (problem->error_count == 0)
        snprintf(text, sizeof text, "%.*s", (int)sizeof text - 1, problem->detail);
    for (uint32_t i = 0; i < problem->error_count && used < sizeof text; i++) {
        const struct wire_field_error *one = &problem->errors[i];
        int length = snprintf(text + used, sizeof text - used, "%s%s: %s", i ? "; " : "",
                              one->pointer[0] ? one->pointer : "the document", one->detail);
        used += length < 0 ? 0 : (size_t)length;
    }
    return lp_fail(err, LP_INVALID, where, "%s", text);
}

const char *command_server(const char *flag)
{
    if (flag)
        return flag;
    const char *environment = getenv("LIGHTPROBE_SERVER");
    return environment && *environment ? environment : SERVER_DEFAULT;
}

enum lp_code command_print(const char *text, size_t bytes, struct lp_error *err)
{
    bool ends = bytes && text[bytes - 1] == '\n';
    if (fwrite(text, 1, bytes, stdout) != bytes || (!ends && putchar('\n') == EOF) ||
        fflush(stdout) != 0)
        return lp_fail(err, LP_IO, "standard output", "cannot be written: %s", strerror(errno));
    return LP_OK;
}

const char *command_count(char out[COMMAND_NUMBER_BYTES], uint64_t value)
{
    char digits[24];
    int length = snprintf(digits, sizeof digits, "%llu", (unsigned long long)value);
    char *at = out;
    for (int i = 0; i < length; i++) {
        if (i > 0 && (length - i) % 3 == 0)
            *at++ = ',';
        *at++ = digits[i];
    }
    *at = '\0';
    return out;
}

const char *command_bytes(char out[COMMAND_NUMBER_BYTES], uint64_t bytes)
{
    static const char *const units[] = {"bytes", "kB", "MB", "GB", "TB", "PB", "EB"};
    double value = (double)bytes;
    size_t unit = 0;
    while (value >= 1000 && unit + 1 < sizeof units / sizeof units[0]) {
        value /= 1000;
        unit++;
    }
    snprintf(out, COMMAND_NUMBER_BYTES, unit ? "%.3g %s" : "%.0f %s", value, units[unit]);
    return out;
}

double command_seconds(void)
{
    struct timespec now;
    clock_gettime(CLOCK_MONOTONIC, &now);
    return (double)now.tv_sec + (double)now.tv_nsec * 1e-9;
}

bool command_scene_name(char name[WIRE_NAME_BYTES], const char *path)
{
    const char *slash = strrchr(path, '/');
    const char *file = slash ? slash + 1 : path;
    size_t length = strlen(file);
    if (length > 4 && strcmp(file + length - 4, ".lps") == 0)
        length -= 4;
    bool fits = length < WIRE_NAME_BYTES;
    snprintf(name, WIRE_NAME_BYTES, "%.*s", fits ? (int)length : WIRE_NAME_BYTES - 1, file);
    return fits && wire_name_ok(name);
}
