/* What a command of the program is, and how commands speak to people. */
#ifndef COMMAND_H
#define COMMAND_H

#include "clients/c/lpc.h"
#include "clients/cli/flags.h"
#include "protocol/wire.h"

/* Exit statuses. */
enum {
    COMMAND_DONE = 0,
    COMMAND_FAILED = 1, /* one line on standard error: what, where, what to do */
    COMMAND_USAGE = 2   /* wrong usage, likewise */
};

struct command {
    const char *name;
    const char *help; /* one line */
    /* argv[0] is the command's name. Returns the exit status. */
    int (*run)(int argc, char **argv);
};

/* Runs the command that argv[1] names; the program's whole main. */
int command_dispatch(int argc, char **argv);

int command_build(int argc, char **argv);
int command_info(int argc, char **argv);
int command_verify(int argc, char **argv);
int command_render(int argc, char **argv);
int command_scenes(int argc, char **argv);
int command_stats(int argc, char **argv);

/* Prints a failure to standard error and returns COMMAND_FAILED. */
int command_failed(const struct lp_error *err);
/* The same for wrong usage of command `name`: COMMAND_USAGE. */
int command_misused(const char *name, const struct lp_error *err);
/* What a command returns after flags_read said something else than FLAGS_READY. */
int command_after_flags(const char *name, enum flags_answer answer, const struct lp_error *err);

/* A failure of the client library as the engine's kind of record. */
enum lp_code command_take_lpc(struct lp_error *err, const struct lpc_error *from);
/* A problem of the protocol, offenders and all, as one sentence about `where`. */
enum lp_code command_take_problem(struct lp_error *err, const char *where,
                                  const struct wire_problem *problem);

/* The server to ask: `flag` (may be NULL), else the environment's LIGHTPROBE_SERVER, else
 * http://127.0.0.1:8080. */
const char *command_server(const char *flag);

/* Writes a document and a line's end to standard output; LP_IO when that fails (a full disk). */
LP_MUST_CHECK enum lp_code command_print(const char *text, size_t bytes, struct lp_error *err);

/* ---- numbers for people ------------------------------------------------------------------------
 */

#define COMMAND_NUMBER_BYTES 40
/* "12,345,678" */
const char *command_count(char out[COMMAND_NUMBER_BYTES], uint64_t value);
/* "12.3 MB": powers of ten */
const char *command_bytes(char out[COMMAND_NUMBER_BYTES], uint64_t bytes);

/* Seconds of a clock that only goes forward. */
double command_seconds(void);

/* The scene's name that a path stands for: the file's name without ".lps". False when that cannot
 * be a scene's name; `name` is then what there is of it, cut to fit. */
bool command_scene_name(char name[WIRE_NAME_BYTES], const char *path);

#endif
