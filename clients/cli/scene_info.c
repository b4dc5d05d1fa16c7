/* A scene file described as the daemon describes its scenes. */
#include "clients/cli/scene_info.h"

#include "clients/cli/command.h"

#include <string.h>

enum lp_code scene_info_open(struct bake_scene *out, struct lp_scene_file *file, const char *path,
                             struct lp_error *err)
{
    struct lp_scene_file opened = {0};
    struct lp_error defect = {0};
    enum lp_code code = lp_scene_file_open(&opened, path, LP_TRUST_NOTHING, &defect);
    if (code != LP_OK && strcmp(defect.where, path) == 0)
        return lp_fail(err, code, path, "%s", defect.text);
    if (code != LP_OK) /* the place of a defect is inside of the file: name that too */
        return lp_fail(err, code, path, "%s: %.200s", defect.where, defect.text);
    /* How long a verified file takes to open: tried, and dropped again, since somebody may have
     * replaced the file meanwhile. */
    struct lp_scene_file again = {0};
    double start = command_seconds();
    enum lp_code timed = lp_scene_file_open(&again, path, LP_TRUST_CONTENT, &defect);
    double open_s = timed == LP_OK ? command_seconds() - start : -1;
    lp_scene_file_close(&again);
    uint8_t digest[LP_SHA256_BYTES];
    lp_sha256(digest, opened.map, opened.bytes);
    bake_scene_describe(out, &opened);
    (void)command_scene_name(out->scene.name, path);
    bake_hex(out->scene.sha256, digest);
    out->scene.refs = 0;
    out->scene.open_s = open_s;
    *file = opened;
    return LP_OK;
}
