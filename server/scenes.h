/* The scenes that can be rendered: names, states, and the reference-counted resident set.
 *
 * A thread of its own (lp-scenes) looks at DIR/scenes when it changes and every two seconds,
 * verifies what is new and publishes it; the loop acquires and releases. A file that is replaced
 * keeps serving its old scene until the new one is verified, or found to be bad: then the name is
 * "failed". A passing fault (disk full, no memory, no descriptor) is no verdict on the file: the
 * old scene goes on, a new name stays "loading", both show the reason, and it is tried again. Jobs
 * keep the scene they began with. */
#ifndef SCENES_H
#define SCENES_H

#include "server/bake.h"
#include "server/data_dir.h"

#define SCENES_MAX 1000

/* A resident scene: immutable but for its counts. */
struct scene {
    struct scene *next; /* guarded by the mutex of scenes */
    struct lp_scene_file file;
    struct bake_scene about; /* name and refs are filled in when it is shown */
    uint64_t refs;           /* guarded by the mutex of scenes: jobs that hold it */
    uint32_t names;          /* guarded by the mutex of scenes: names that show it */
};

struct scenes; /* owns the resident scenes and the thread */

/* Starts the thread. `dir` must outlive it; `wake_fd` is an eventfd that is written to when the
 * first scan is done. LP_NO_MEMORY, LP_IO. */
LP_MUST_CHECK enum lp_code scenes_start(struct scenes **out, const struct data_dir *dir,
                                        int wake_fd, struct lp_error *err);
/* Asks the thread to end; long copies give up. Thread: loop or main. */
void scenes_stop(struct scenes *scenes);
/* Waits for it until the monotonic time `until_ns`. True: it ended and everything is freed. */
bool scenes_join(struct scenes **scenes, uint64_t until_ns);

/* Whether the first scan is done, with all scenes open that were verified in an earlier run.
 * Thread: any. */
bool scenes_scanned(const struct scenes *scenes);

/* Holds the scene of a name: WIRE_PROBLEM_NONE, or UNKNOWN_SCENE, SCENE_NOT_READY, SCENE_FAILED
 * with a sentence in `*problem`. Thread: any. */
enum wire_problem_code scenes_acquire(struct scenes *scenes, struct scene **out,
                                      struct wire_problem *problem, const char *name);
void scenes_release(struct scenes *scenes, struct scene **scene);

/* The document of one scene, or of all (name NULL), as text on the heap; NULL: no memory.
 * UNKNOWN_SCENE leaves `*text` NULL and sets `*problem`. Thread: loop. */
enum wire_problem_code scenes_write(struct scenes *scenes, char **text,
                                    struct wire_problem *problem, const char *name);

struct scenes_totals {
    uint64_t ready, loading, failed, bytes;
};
struct scenes_totals scenes_totals(struct scenes *scenes);
/* Up to `room` bytes of names, comma-separated, of scenes that are there. Thread: any. */
void scenes_names(struct scenes *scenes, char *out, size_t room);

#endif
