/* A scene file described as the daemon describes its scenes. */
#ifndef SCENE_INFO_H
#define SCENE_INFO_H

#include "server/bake.h"

/* Opens and fully verifies `path` and fills `out`: name, state, sha256 of the file, open_s (how
 * long it takes to open once it is trusted). The file stays open in `*file`:
 * lp_scene_file_close. `out` keeps nothing of it. */
LP_MUST_CHECK enum lp_code scene_info_open(struct bake_scene *out, struct lp_scene_file *file,
                                           const char *path, struct lp_error *err);

#endif
