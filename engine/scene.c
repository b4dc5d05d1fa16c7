/* A scene's lightings and its two spaces. */
#include "engine/scene.h"

#include <string.h>

const char *lp_filter_text(enum lp_filter filter)
{
    switch (filter) {
    case LP_FILTER_VISIBLE:
        return "visible";
    case LP_FILTER_MEAN:
        return "mean";
    }
    return "unknown";
}

const struct lp_channel *lp_scene_lighting(const struct lp_scene *scene, const char *name)
{
    for (uint32_t i = 0; i < scene->channel_count; i++) {
        const struct lp_channel *channel = &scene->channels[i];
        bool shades = channel->kind == LP_CHANNEL_ALBEDO || channel->kind == LP_CHANNEL_RADIANCE;
        if (shades && strcmp(channel->name, name) == 0)
            return channel;
    }
    return NULL;
}

void lp_scene_to_octree(double out_os[3], const struct lp_scene *scene, const double point_ws[3])
{
    for (int a = 0; a < 3; a++)
        out_os[a] = (point_ws[a] - scene->origin_m[a]) / scene->voxel_size_m;
}

void lp_scene_to_world(double out_ws[3], const struct lp_scene *scene, const double point_os[3])
{
    for (int a = 0; a < 3; a++)
        out_ws[a] = scene->origin_m[a] + point_os[a] * scene->voxel_size_m;
}
