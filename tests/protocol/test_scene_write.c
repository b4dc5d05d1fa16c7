/* Scene documents: all fields when ready, name, state and reason otherwise. */
#include "protocol/wire.h"
#include "tests/harness/test.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

static const struct wire_channel channels[] = {{"albedo", "albedo", "srgb8"},
                                               {"noon", "radiance", "rgb9e5"},
                                               {"emission", "emission", "rgb9e5"},
                                               {"normal", "normal", "oct16"}};

static struct wire_scene example(void)
{
    return (struct wire_scene){.name = "duned",
                               .state = WIRE_SCENE_READY,
                               .voxels = 5000000000,
                               .nodes = 6,
                               .bytes = 7,
                               .depth = 11,
                               .filter = "visible",
                               .voxel_size_m = 0.1,
                               .bounds_min_m = {-1, 0, -2.5},
                               .bounds_max_m = {1, 3, 2.5},
                               .channel_count = 4,
                               .channels = channels,
                               .sha256 = "abc",
                               .refs = 2,
                               .suggested_probe_m = {0, 1.7, 0},
                               .open_s = 0.004};
}

TEST(ready_scenes_show_everything)
{
    struct wire_scene scene = example();
    char *text = wire_scene_write(&scene);
    CHECK_STR(
        text,
        "{\"name\":\"duned\",\"state\":\"ready\",\"voxels\":5000000000,\"nodes\":6,\"bytes\":7,"
        "\"depth\":11,\"filter\":\"visible\",\"voxel_size_m\":0.1,\"bounds_m\":{\"min\":[-1,0,"
        "-2.5],\"max\":[1,3,2.5]},\"lightings\":[\"albedo\",\"noon\"],\"channels\":[{\"name\":"
        "\"albedo\",\"kind\":\"albedo\",\"encoding\":\"srgb8\"},{\"name\":\"noon\",\"kind\":"
        "\"radiance\",\"encoding\":\"rgb9e5\"},{\"name\":\"emission\",\"kind\":\"emission\","
        "\"encoding\":\"rgb9e5\"},{\"name\":\"normal\",\"kind\":\"normal\",\"encoding\":"
        "\"oct16\"}],\"sha256\":\"abc\",\"refs\":2,\"suggested_probe\":[0,1.7,0],"
        "\"open_seconds\":0.004}");
    free(text);
    scene.open_s = 0;
    text = wire_scene_write(&scene);
    CHECK_HAS(text, "\"open_seconds\":0}");
    free(text);
    scene.open_s = -1;
    text = wire_scene_write(&scene);
    CHECK(!strstr(text, "open_seconds"));
    free(text);
}

TEST(other_scenes_show_their_state)
{
    struct wire_scene scene = example();
    snprintf(scene.reason, sizeof scene.reason, "wide node 3: the mask is 0");
    static const struct {
        enum wire_scene_state state;
        const char *text;
    } cases[] = {
        {WIRE_SCENE_LOADING,
         "{\"name\":\"duned\",\"state\":\"loading\",\"reason\":\"wide node 3: the mask is 0\"}"},
        {WIRE_SCENE_IMPORTING,
         "{\"name\":\"duned\",\"state\":\"importing\",\"reason\":\"wide node 3: the mask is 0\"}"},
        {WIRE_SCENE_FAILED,
         "{\"name\":\"duned\",\"state\":\"failed\",\"reason\":\"wide node 3: the "
         "mask is 0\"}"},
    };
    for (size_t i = 0; i < 3; i++) {
        scene.state = cases[i].state;
        char *text = wire_scene_write(&scene);
        CHECK_STR(text, cases[i].text);
        free(text);
    }
}

TEST(list_of_scenes)
{
    char *text = wire_scenes_write(NULL, 0);
    CHECK_STR(text, "{\"scenes\":[]}");
    free(text);
    struct wire_scene scenes[2] = {example(), example()};
    scenes[0].state = WIRE_SCENE_LOADING;
    text = wire_scenes_write(scenes, 2);
    CHECK_HAS(text, "{\"scenes\":[{\"name\":\"duned\",\"state\":\"loading\"},{\"name\":\"duned\","
                    "\"state\":\"ready\",\"voxels\":5000000000,");
    free(text);
}
