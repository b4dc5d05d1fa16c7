/* Finds the command that the first argument names, and hands over. */
#include "clients/cli/command.h"

#include <string.h>

static const struct command commands[] = {
    {"build", "make a scene file of a height map or a procedural scene", command_build},
    {"info", "what a scene file holds", command_info},
    {"verify", "check every byte of scene files", command_verify},
    {"render", "bake a light probe, from a scene file or through a daemon", command_render},
    {"scenes", "the scenes of a daemon", command_scenes},
    {"stats", "how a daemon is doing", command_stats},
};
#define COMMAND_COUNT (sizeof commands / sizeof commands[0])

/* The contract's commands that later versions bring. */
static const char *const later[] = {"errors", "sh",    "light", "study",  "bench",  "push",
                                    "submit", "watch", "get",   "cancel", "compare"};
#define LATER_COUNT      (sizeof later / sizeof later[0])
#define SUGGEST_DISTANCE 2

static void print_help(FILE *out)
{
    fputs("usage: lightprobe COMMAND [arguments]\n\n"
          "Bakes light probes (cubemaps) of voxel scenes.\n\n",
          out);
    for (size_t i = 0; i < COMMAND_COUNT; i++)
        fprintf(out, "  %-10s %s\n", commands[i].name, commands[i].help);
    fputs("\n`lightprobe COMMAND --help` says more; `lightprobe --version` prints the version.\n",
          out);
}

static int unknown_command(const char *name)
{
    for (size_t i = 0; i < LATER_COUNT; i++) {
        if (strcmp(later[i], name) == 0) {
            fprintf(stderr, "lightprobe: %s: not in this version (%s); see `lightprobe --help`\n",
                    name, LP_VERSION);
            return COMMAND_USAGE;
        }
    }
    const char *nearest = NULL;
    unsigned least = SUGGEST_DISTANCE + 1;
    for (size_t i = 0; i < COMMAND_COUNT; i++) {
        unsigned distance = flags_distance(name, commands[i].name);
        if (distance < least) {
            least = distance;
            nearest = commands[i].name;
        }
    }
    fprintf(stderr, "lightprobe: %.60s: unknown command; %s%s%s\n", name,
            nearest ? "did you mean `lightprobe " : "see `lightprobe --help",
            nearest ? nearest : "", nearest ? "`?" : "`");
    return COMMAND_USAGE;
}

int command_dispatch(int argc, char **argv)
{
    if (argc < 2) {
        fputs("lightprobe: a command is missing; see `lightprobe --help`\n", stderr);
        return COMMAND_USAGE;
    }
    const char *name = argv[1];
    if (strcmp(name, "--help") == 0 || strcmp(name, "-h") == 0 || strcmp(name, "help") == 0) {
        print_help(stdout);
        return COMMAND_DONE;
    }
    if (strcmp(name, "--version") == 0) {
        puts("lightprobe " LP_VERSION);
        return COMMAND_DONE;
    }
    for (size_t i = 0; i < COMMAND_COUNT; i++)
        if (strcmp(commands[i].name, name) == 0)
            return commands[i].run(argc - 1, argv + 1);
    return unknown_command(name);
}
