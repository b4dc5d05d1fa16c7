/* The documents of one scene and of all scenes. */
#include "protocol/tree.h"

#include <string.h>

static const char *state_text(enum wire_scene_state state)
{
    switch (state) {
    case WIRE_SCENE_LOADING:
        return "loading";
    case WIRE_SCENE_IMPORTING:
        return "importing";
    case WIRE_SCENE_READY:
        return "ready";
    case WIRE_SCENE_FAILED:
        break;
    }
    return "failed";
}

static bool is_lighting(const struct wire_channel *channel)
{
    return strcmp(channel->kind, "albedo") == 0 || strcmp(channel->kind, "radiance") == 0;
}

static void write_channels(struct wire_tree *tree, const struct wire_scene *scene)
{
    wire_tree_open_list(tree, "lightings");
    for (uint32_t i = 0; i < scene->channel_count; i++)
        if (is_lighting(&scene->channels[i]))
            wire_tree_text(tree, NULL, scene->channels[i].name);
    wire_tree_close(tree);
    wire_tree_open_list(tree, "channels");
    for (uint32_t i = 0; i < scene->channel_count; i++) {
        wire_tree_open(tree, NULL);
        wire_tree_text(tree, "name", scene->channels[i].name);
        wire_tree_text(tree, "kind", scene->channels[i].kind);
        wire_tree_text(tree, "encoding", scene->channels[i].encoding);
        wire_tree_close(tree);
    }
    wire_tree_close(tree);
}

/* The fields of one scene into the object that is open. */
static void write_scene(struct wire_tree *tree, const struct wire_scene *scene)
{
    wire_tree_text(tree, "name", scene->name);
    wire_tree_text(tree, "state", state_text(scene->state));
    if (scene->reason[0])
        wire_tree_text(tree, "reason", scene->reason);
    if (scene->state != WIRE_SCENE_READY)
        return;
    wire_tree_u64(tree, "voxels", scene->voxels);
    wire_tree_u64(tree, "nodes", scene->nodes);
    wire_tree_u64(tree, "bytes", scene->bytes);
    wire_tree_u64(tree, "depth", scene->depth);
    wire_tree_text(tree, "filter", scene->filter);
    wire_tree_f64(tree, "voxel_size_m", scene->voxel_size_m);
    wire_tree_open(tree, "bounds_m");
    wire_tree_vec3(tree, "min", scene->bounds_min_m);
    wire_tree_vec3(tree, "max", scene->bounds_max_m);
    wire_tree_close(tree);
    write_channels(tree, scene);
    wire_tree_text(tree, "sha256", scene->sha256);
    wire_tree_u64(tree, "refs", scene->refs);
    wire_tree_vec3(tree, "suggested_probe", scene->suggested_probe_m);
    if (scene->open_s >= 0)
        wire_tree_f64(tree, "open_seconds", scene->open_s);
}

char *wire_scene_write(const struct wire_scene *scene)
{
    struct wire_tree tree;
    wire_tree_begin(&tree);
    write_scene(&tree, scene);
    return wire_tree_end(&tree);
}

char *wire_scenes_write(const struct wire_scene *scenes, size_t count)
{
    struct wire_tree tree;
    wire_tree_begin(&tree);
    wire_tree_open_list(&tree, "scenes");
    for (size_t i = 0; i < count; i++) {
        wire_tree_open(&tree, NULL);
        write_scene(&tree, &scenes[i]);
        wire_tree_close(&tree);
    }
    wire_tree_close(&tree);
    return wire_tree_end(&tree);
}
