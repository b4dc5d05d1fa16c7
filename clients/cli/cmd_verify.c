/* `lightprobe verify`: checks every byte of scene files. */
#include "clients/cli/command.h"

#include <limits.h>
#include <stdlib.h>
#include <string.h>

#include "engine/scene_file.h"

static enum lp_code print_json(const char *path, const struct lp_scene *scene,
                               const struct lp_error *defect, struct lp_error *err)
{
    struct wire_doc *doc = wire_doc_begin();
    wire_doc_text(doc, "file", path);
    wire_doc_bool(doc, "ok", defect->code == LP_OK);
    if (defect->code == LP_OK) {
        wire_doc_u64(doc, "voxels", scene->tree.level_count[0]);
        wire_doc_u64(doc, "nodes", scene->tree.node_count);
    } else {
        wire_doc_text(doc, "where", defect->where);
        wire_doc_text(doc, "defect", defect->text);
    }
    char *text = wire_doc_end(doc);
    enum lp_code code = text ? command_print(text, strlen(text), err)
                             : lp_fail(err, LP_NO_MEMORY, "", "out of memory for the document");
    free(text);
    return code;
}

static void print_line(const char *path, const struct lp_scene *scene,
                       const struct lp_error *defect)
{
    char n[2][COMMAND_NUMBER_BYTES];
    if (defect->code == LP_OK) {
        printf("%s: ok, %s voxels, %s nodes, depth %u, %u channel%s\n", path,
               command_count(n[0], scene->tree.level_count[0]),
               command_count(n[1], scene->tree.node_count), scene->tree.depth, scene->channel_count,
               scene->channel_count == 1 ? "" : "s");
        return;
    }
    /* Where the defect's place is the file itself, it is not said twice. */
    bool same = defect->where[0] == '\0' || strcmp(defect->where, path) == 0;
    printf("%s: %s%s%s\n", path, same ? "" : defect->where, same ? "" : ": ", defect->text);
}

int command_verify(int argc, char **argv)
{
    bool json = false;
    struct flag flags[] = {
        {.name = "json",
         .kind = FLAG_SWITCH,
         .to.on = &json,
         .help = "one JSON object a line, one line a file"},
    };
    struct flag_set set = {
        .usage = "lightprobe verify SCENE.lps... [--json]",
        .summary = "Reads every byte of scene files: checksums, then the tree's invariants. One\n"
                   "line a file; exit 1 when any is bad.",
        .flags = flags,
        .flag_count = sizeof flags / sizeof flags[0],
        .arguments_min = 1,
        .arguments_max = INT_MAX,
    };
    struct lp_error err = {0};
    int count = 0;
    enum flags_answer answer = flags_read(&set, argc, argv, &count, &err);
    if (answer != FLAGS_READY)
        return command_after_flags("verify", answer, &err);

    int status = COMMAND_DONE;
    for (int i = 0; i < count; i++) {
        struct lp_scene_file file = {0};
        struct lp_error defect = {0};
        if (lp_scene_file_open(&file, argv[i], LP_TRUST_NOTHING, &defect) != LP_OK)
            status = COMMAND_FAILED;
        enum lp_code code = LP_OK;
        if (json)
            code = print_json(argv[i], &file.scene, &defect, &err);
        else
            print_line(argv[i], &file.scene, &defect);
        lp_scene_file_close(&file);
        if (code != LP_OK)
            return command_failed(&err);
    }
    return status;
}
