/* Where protocol and engine meet: a wire job as the engine's parameters, the engine's answers as
 * wire structs. No sockets, no threads, no files: the daemon and the command line both use it, so
 * that a job gives the same document wherever it runs. (The one file of this folder that
 * clients/cli may include.) */
#ifndef BAKE_H
#define BAKE_H

#include "engine/render.h"
#include "engine/scene_file.h"
#include "protocol/wire.h"

/* Checks a job against a scene and plans it. On failure `*problem` holds fields (pointers into the
 * job's document) and the code is returned. `job` must outlive the plan (it lends the lighting's
 * name). Thread: any. */
enum wire_problem_code bake_plan(struct lp_render_plan *plan, struct wire_problem *problem,
                                 const struct lp_scene *scene, const struct wire_job *job);

/* Position, warnings, counters and film_sha256 of a finished film; pictures are added by the
 * caller. */
void bake_probe(struct wire_probe *probe, const struct lp_render_plan *plan,
                const struct lp_counters *counters, const struct lp_film *film);

/* Storage for a scene's description: `scene.channels` points into it. */
struct bake_scene {
    struct wire_scene scene;
    struct wire_channel channels[LP_CHANNELS_MAX];
};

/* Fills everything but name, state (READY is set), sha256, refs and open_s from an open scene. */
void bake_scene_describe(struct bake_scene *out, const struct lp_scene_file *file);

/* A picture of a film in a layout and format, with its SHA-256. */
struct bake_picture {
    uint8_t *data; /* owned: free() */
    size_t bytes;
    char sha256[WIRE_SHA256_BYTES];
};
LP_MUST_CHECK enum lp_code bake_picture(struct bake_picture *out, const struct lp_film *film,
                                        enum wire_layout layout, enum wire_image image,
                                        struct lp_error *err);

/* Lower-case hex of a SHA-256 into `out`. */
void bake_hex(char out[WIRE_SHA256_BYTES], const uint8_t sha256[LP_SHA256_BYTES]);

/* How many bytes rendering this plan takes at its peak: film, layout, encoder. */
size_t bake_bytes_max(const struct lp_render_plan *plan, const struct wire_job *job);

#endif
