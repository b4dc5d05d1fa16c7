/* `lightprobe info`: what a scene file holds. */
#include "clients/cli/command.h"

#include <stdlib.h>
#include <string.h>

#include "clients/cli/scene_info.h"

static void print_info(const struct wire_scene *scene)
{
    char n[2][COMMAND_NUMBER_BYTES];
    printf("%-18s %s\n", "name", scene->name);
    printf("%-18s %s\n", "voxels", command_count(n[0], scene->voxels));
    printf("%-18s %s\n", "nodes", command_count(n[0], scene->nodes));
    printf("%-18s %s (%s)\n", "size", command_bytes(n[0], scene->bytes),
           command_count(n[1], scene->bytes));
    if (scene->voxels)
        printf("%-18s %.2f\n", "bytes per voxel", (double)scene->bytes / (double)scene->voxels);
    printf("%-18s %u\n", "depth", scene->depth);
    printf("%-18s %g m\n", "voxel", scene->voxel_size_m);
    printf("%-18s %s\n", "filter", scene->filter);
    printf("%-18s %g %g %g  to  %g %g %g m\n", "bounds", scene->bounds_min_m[0],
           scene->bounds_min_m[1], scene->bounds_min_m[2], scene->bounds_max_m[0],
           scene->bounds_max_m[1], scene->bounds_max_m[2]);
    for (uint32_t i = 0; i < scene->channel_count; i++)
        printf("%-18s %s (%s, %s)\n", i ? "" : "channels", scene->channels[i].name,
               scene->channels[i].kind, scene->channels[i].encoding);
    printf("%-18s %.9g,%.9g,%.9g m\n", "suggested probe", scene->suggested_probe_m[0],
           scene->suggested_probe_m[1], scene->suggested_probe_m[2]);
    printf("%-18s %.3f ms\n", "opens in", scene->open_s * 1e3);
    printf("%-18s %s\n", "sha256", scene->sha256);
}

int command_info(int argc, char **argv)
{
    bool json = false;
    struct flag flags[] = {
        {.name = "json",
         .kind = FLAG_SWITCH,
         .to.on = &json,
         .help = "the fields of GET /v1/scenes/{name}"},
    };
    struct flag_set set = {
        .usage = "lightprobe info SCENE.lps [--json]",
        .summary = "Checks a scene file and says what it holds.",
        .flags = flags,
        .flag_count = sizeof flags / sizeof flags[0],
        .arguments_min = 1,
        .arguments_max = 1,
    };
    struct lp_error err = {0};
    int count = 0;
    enum flags_answer answer = flags_read(&set, argc, argv, &count, &err);
    if (answer != FLAGS_READY)
        return command_after_flags("info", answer, &err);

    struct lp_scene_file file = {0};
    struct bake_scene info = {0};
    enum lp_code code = scene_info_open(&info, &file, argv[0], &err);
    lp_scene_file_close(&file);
    if (code == LP_OK && json) {
        char *text = wire_scene_write(&info.scene);
        code = text ? command_print(text, strlen(text), &err)
                    : lp_fail(&err, LP_NO_MEMORY, "", "out of memory for the document");
        free(text);
    } else if (code == LP_OK) {
        print_info(&info.scene);
    }
    return code == LP_OK ? COMMAND_DONE : command_failed(&err);
}
