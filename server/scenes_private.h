/* What scenes.c (the registry) and scenes_scan.c (its thread) share. */
#ifndef SCENES_PRIVATE_H
#define SCENES_PRIVATE_H

#include "server/ending.h"
#include "server/scene_store.h"
#include "server/scenes.h"

#include <pthread.h>

/* A name and what it stands for. */
struct scene_entry {
    char name[WIRE_NAME_BYTES]; /* never changes */

    /* Guarded by the mutex of scenes; written by the scenes thread only. */
    enum wire_scene_state state;
    char reason[512];
    struct scene *scene; /* READY */
    char *text;          /* owned: its document, refs 0; NULL: to be made */

    /* Scenes thread only. */
    bool seen_now;              /* in this scan */
    bool settled;               /* nothing to do while the file keeps its identity */
    struct scene_identity seen; /* of the last attempt */
    uint64_t retry_ns, delay_ns;
};

struct scenes {
    const struct data_dir *dir;
    int wake_fd;  /* the loop's */
    int event_fd; /* ours: stop, or a scene lost its last user */
    int inotify_fd;
    pthread_t thread;
    struct ending ending;
    atomic_bool stop, scanned;

    pthread_mutex_t mutex;
    struct scene_entry *entries[SCENES_MAX]; /* guarded by mutex: sorted by name */
    size_t count;                            /* guarded by mutex */
    struct scene *residents;                 /* guarded by mutex */

    /* Scenes thread only. */
    struct scene_store *store;
    uint64_t ignored; /* hash of the ignored names: they are logged when they change */
    bool stale;       /* copies may have lost their user */
};

/* The body of the thread. */
void *scenes_main(void *scenes);

/* Below: scenes thread only; they take the mutex themselves. */
struct scene_entry *scenes_entry(struct scenes *scenes, const char *name); /* NULL: none */
struct scene_entry *scenes_entry_add(struct scenes *scenes, const char *name);
void scenes_entry_remove(struct scenes *scenes, struct scene_entry *entry);
/* Makes `name` stand for a scene file, which is taken over. False: no memory, it is closed. */
bool scenes_publish(struct scenes *scenes, struct scene_entry *entry, struct lp_scene_file *file,
                    const char *sha256, double open_s);
/* Points `name` at a scene that is resident already; false where it is not. */
bool scenes_publish_resident(struct scenes *scenes, struct scene_entry *entry, const char *sha256);
/* The file is bad: no scene is shown any more. */
void scenes_fail(struct scenes *scenes, struct scene_entry *entry, const char *reason);
/* The file cannot be taken in just now: what was shown stays, with the reason. */
void scenes_delay(struct scenes *scenes, struct scene_entry *entry, const char *reason);
/* Unmaps scenes without names and jobs; true if there were some. */
bool scenes_collect(struct scenes *scenes);
/* The hashes of all residents; `*out` is the caller's. Returns the count; SIZE_MAX: no memory. */
size_t scenes_resident_hashes(struct scenes *scenes, char (**out)[WIRE_SHA256_BYTES]);

#endif
