/* The scenes that can be rendered: names, states, and the reference-counted resident set. */
#include "server/scenes.h"

#include "server/log.h"
#include "server/scenes_private.h"

#include <errno.h>
#include <inttypes.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/eventfd.h>
#include <sys/inotify.h>
#include <unistd.h>

/* ---- life --------------------------------------------------------------------------------------
 */

static void entry_free(struct scene_entry *entry)
{
    free(entry->text);
    free(entry);
}

static void scenes_free(struct scenes *scenes)
{
    for (size_t i = 0; i < scenes->count; i++)
        entry_free(scenes->entries[i]);
    for (struct scene *scene = scenes->residents, *next; scene; scene = next) {
        next = scene->next;
        lp_scene_file_close(&scene->file);
        free(scene);
    }
    scene_store_destroy(&scenes->store);
    if (scenes->inotify_fd >= 0)
        close(scenes->inotify_fd);
    if (scenes->event_fd >= 0)
        close(scenes->event_fd);
    ending_finish(&scenes->ending);
    pthread_mutex_destroy(&scenes->mutex);
    free(scenes);
}

enum lp_code scenes_start(struct scenes **out, const struct data_dir *dir, int wake_fd,
                          struct lp_error *err)
{
    struct scenes *scenes = calloc(1, sizeof *scenes);
    if (!scenes)
        return lp_fail(err, LP_NO_MEMORY, "scenes", "no memory for the scenes");
    scenes->dir = dir;
    scenes->wake_fd = wake_fd;
    pthread_mutex_init(&scenes->mutex, NULL);
    ending_init(&scenes->ending);
    scenes->event_fd = eventfd(0, EFD_CLOEXEC | EFD_NONBLOCK);
    /* Without inotify (its watches are limited) the regular look every two seconds remains. */
    scenes->inotify_fd = inotify_init1(IN_CLOEXEC | IN_NONBLOCK);
    scenes->store = scene_store_create(dir, &scenes->stop);
    enum lp_code code = LP_OK;
    int failed = 0;
    if (!scenes->store || scenes->event_fd < 0)
        code = lp_fail(err, LP_NO_MEMORY, "scenes", "the scenes cannot be watched");
    else if ((failed = pthread_create(&scenes->thread, NULL, scenes_main, scenes)))
        code = lp_fail(err, LP_NO_MEMORY, "scenes", "its thread cannot be started: %s",
                       strerror(failed));
    if (code) {
        scenes_free(scenes);
        return code;
    }
    *out = scenes;
    return LP_OK;
}

static void scenes_nudge(const struct scenes *scenes)
{
    uint64_t one = 1;
    (void)!write(scenes->event_fd, &one, sizeof one);
}

void scenes_stop(struct scenes *scenes)
{
    atomic_store(&scenes->stop, true);
    scenes_nudge(scenes);
}

bool scenes_join(struct scenes **pointer, uint64_t until_ns)
{
    struct scenes *scenes = *pointer;
    if (!scenes)
        return true;
    if (!ending_wait(&scenes->ending, 1, until_ns))
        return false;
    pthread_join(scenes->thread, NULL);
    scenes_free(scenes);
    *pointer = NULL;
    return true;
}

bool scenes_scanned(const struct scenes *scenes)
{
    return atomic_load(&scenes->scanned);
}

/* ---- documents ---------------------------------------------------------------------------------
 */

/* What an entry shows, as text with `refs` 0. Made here, beside the loop, and once per change:
 * writing a thousand of them takes 10 ms. By the thread that writes the entry, or with the mutex
 * held. NULL: no memory. */
static char *entry_document(const struct scene_entry *entry)
{
    struct wire_scene shown = {.state = entry->state, .open_s = -1};
    if (entry->scene) {
        shown = entry->scene->about.scene;
        shown.refs = 0;
    }
    memcpy(shown.reason, entry->reason, sizeof shown.reason);
    memcpy(shown.name, entry->name, sizeof shown.name);
    return wire_scene_write(&shown);
}

/* Makes the document of a changed entry. Scenes thread, without the mutex. */
static void entry_changed(struct scenes *scenes, struct scene_entry *entry)
{
    char *text = entry_document(entry);
    pthread_mutex_lock(&scenes->mutex);
    char *old = entry->text;
    entry->text = text;
    pthread_mutex_unlock(&scenes->mutex);
    free(old);
}

/* A growing text of known room. */
struct text {
    char *at;
};

static void text_add(struct text *text, const char *from, size_t bytes)
{
    memcpy(text->at, from, bytes);
    text->at += bytes;
}

#define REFS_MARK       "\"refs\":" /* nowhere else: in a JSON string its quotes are escaped */
#define REFS_MORE_BYTES 20          /* digits of the largest number */

/* An entry's document with the count of now. With the mutex held. */
static void entry_copy(struct text *text, const struct scene_entry *entry)
{
    const char *rest = entry->text;
    const char *mark = entry->scene ? strstr(rest, REFS_MARK) : NULL;
    if (mark) {
        const char *digit = mark + strlen(REFS_MARK);
        char count[REFS_MORE_BYTES + 1];
        int n = snprintf(count, sizeof count, "%" PRIu64, entry->scene->refs);
        text_add(text, rest, (size_t)(digit - rest));
        text_add(text, count, n > 0 ? (size_t)n : 0);
        rest = digit + 1; /* behind the 0 */
    }
    text_add(text, rest, strlen(rest));
}

/* ---- names -------------------------------------------------------------------------------------
 */

/* Where `name` is or would be. With the mutex held (or on the thread that writes). */
static size_t entry_place(const struct scenes *scenes, const char *name, bool *there)
{
    size_t low = 0, high = scenes->count;
    *there = false;
    while (low < high) {
        size_t middle = (low + high) / 2;
        int order = strcmp(scenes->entries[middle]->name, name);
        if (order == 0) {
            *there = true;
            return middle;
        }
        if (order < 0)
            low = middle + 1;
        else
            high = middle;
    }
    return low;
}

static struct scene_entry *entry_find(const struct scenes *scenes, const char *name)
{
    bool there;
    size_t at = entry_place(scenes, name, &there);
    return there ? scenes->entries[at] : NULL;
}

struct scene_entry *scenes_entry(struct scenes *scenes, const char *name)
{
    pthread_mutex_lock(&scenes->mutex);
    struct scene_entry *entry = entry_find(scenes, name);
    pthread_mutex_unlock(&scenes->mutex);
    return entry;
}

struct scene_entry *scenes_entry_add(struct scenes *scenes, const char *name)
{
    struct scene_entry *entry = calloc(1, sizeof *entry);
    if (!entry)
        return NULL;
    memcpy(entry->name, name, strlen(name) + 1);
    entry->state = WIRE_SCENE_LOADING;
    entry->text = entry_document(entry);
    pthread_mutex_lock(&scenes->mutex);
    bool there, full = scenes->count == SCENES_MAX;
    size_t at = entry_place(scenes, name, &there);
    if (!full) {
        memmove(&scenes->entries[at + 1], &scenes->entries[at],
                (scenes->count - at) * sizeof scenes->entries[0]);
        scenes->entries[at] = entry;
        scenes->count++;
    }
    pthread_mutex_unlock(&scenes->mutex);
    if (full) {
        entry_free(entry);
        return NULL;
    }
    return entry;
}

void scenes_entry_remove(struct scenes *scenes, struct scene_entry *entry)
{
    pthread_mutex_lock(&scenes->mutex);
    bool there;
    size_t at = entry_place(scenes, entry->name, &there);
    if (entry->scene)
        entry->scene->names--;
    memmove(&scenes->entries[at], &scenes->entries[at + 1],
            (scenes->count - at - 1) * sizeof scenes->entries[0]);
    scenes->count--;
    pthread_mutex_unlock(&scenes->mutex);
    entry_free(entry);
}

void scenes_names(struct scenes *scenes, char *out, size_t room)
{
    size_t used = 0;
    out[0] = 0;
    pthread_mutex_lock(&scenes->mutex);
    for (size_t i = 0; i < scenes->count; i++) {
        const char *name = scenes->entries[i]->name;
        size_t n = strlen(name);
        if (used + n + 8 > room) {
            snprintf(out + used, room - used, ", ...");
            break;
        }
        int got = snprintf(out + used, room - used, "%s%s", used ? ", " : "", name);
        used += got > 0 ? (size_t)got : 0;
    }
    pthread_mutex_unlock(&scenes->mutex);
}

/* ---- publishing --------------------------------------------------------------------------------
 */

/* Its document says what is not so any more. With the mutex held. */
static void entry_forget_text(struct scene_entry *entry)
{
    free(entry->text);
    entry->text = NULL;
}

/* With the mutex held. */
static void entry_show(struct scene_entry *entry, struct scene *scene)
{
    if (entry->scene)
        entry->scene->names--;
    scene->names++;
    entry->scene = scene;
    entry->state = WIRE_SCENE_READY;
    entry->reason[0] = 0;
    entry_forget_text(entry);
}

/* With the mutex held. */
static struct scene *resident_find(const struct scenes *scenes, const char *sha256)
{
    struct scene *scene = scenes->residents;
    while (scene && strcmp(scene->about.scene.sha256, sha256) != 0)
        scene = scene->next;
    return scene;
}

bool scenes_publish_resident(struct scenes *scenes, struct scene_entry *entry, const char *sha256)
{
    pthread_mutex_lock(&scenes->mutex);
    struct scene *scene = resident_find(scenes, sha256);
    if (scene)
        entry_show(entry, scene);
    pthread_mutex_unlock(&scenes->mutex);
    if (scene)
        entry_changed(scenes, entry);
    return scene != NULL;
}

bool scenes_publish(struct scenes *scenes, struct scene_entry *entry, struct lp_scene_file *file,
                    const char *sha256, double open_s)
{
    if (scenes_publish_resident(scenes, entry, sha256)) {
        lp_scene_file_close(file);
        return true;
    }
    struct scene *scene = calloc(1, sizeof *scene);
    if (!scene) {
        lp_scene_file_close(file);
        return false;
    }
    scene->file = *file;
    *file = (struct lp_scene_file){0};
    bake_scene_describe(&scene->about, &scene->file);
    memcpy(scene->about.scene.sha256, sha256, WIRE_SHA256_BYTES);
    scene->about.scene.open_s = open_s;
    pthread_mutex_lock(&scenes->mutex);
    scene->next = scenes->residents;
    scenes->residents = scene;
    entry_show(entry, scene);
    pthread_mutex_unlock(&scenes->mutex);
    entry_changed(scenes, entry);
    return true;
}

void scenes_fail(struct scenes *scenes, struct scene_entry *entry, const char *reason)
{
    pthread_mutex_lock(&scenes->mutex);
    if (entry->scene)
        entry->scene->names--;
    entry->scene = NULL;
    entry->state = WIRE_SCENE_FAILED;
    snprintf(entry->reason, sizeof entry->reason, "%s", reason);
    entry_forget_text(entry);
    pthread_mutex_unlock(&scenes->mutex);
    entry_changed(scenes, entry);
}

void scenes_delay(struct scenes *scenes, struct scene_entry *entry, const char *reason)
{
    pthread_mutex_lock(&scenes->mutex);
    entry->state = entry->scene ? WIRE_SCENE_READY : WIRE_SCENE_LOADING;
    snprintf(entry->reason, sizeof entry->reason, "%s", reason);
    entry_forget_text(entry);
    pthread_mutex_unlock(&scenes->mutex);
    entry_changed(scenes, entry);
}

bool scenes_collect(struct scenes *scenes)
{
    struct scene *free_list = NULL;
    pthread_mutex_lock(&scenes->mutex);
    for (struct scene **at = &scenes->residents; *at;) {
        struct scene *scene = *at;
        if (scene->refs > 0 || scene->names > 0) {
            at = &scene->next;
            continue;
        }
        *at = scene->next;
        scene->next = free_list;
        free_list = scene;
    }
    pthread_mutex_unlock(&scenes->mutex);
    bool some = free_list != NULL;
    for (struct scene *scene = free_list, *next; scene; scene = next) {
        next = scene->next;
        log_event(LOG_INFO, "scene_closed", "sha256=%s bytes=%zu", scene->about.scene.sha256,
                  scene->file.bytes);
        lp_scene_file_close(&scene->file);
        free(scene);
    }
    return some;
}

size_t scenes_resident_hashes(struct scenes *scenes, char (**out)[WIRE_SHA256_BYTES])
{
    /* Only this thread adds residents, so they cannot become more between the two looks. */
    size_t room = 0, count = 0;
    pthread_mutex_lock(&scenes->mutex);
    for (const struct scene *scene = scenes->residents; scene; scene = scene->next)
        room++;
    pthread_mutex_unlock(&scenes->mutex);
    *out = calloc(room ? room : 1, sizeof **out);
    if (!*out)
        return SIZE_MAX;
    pthread_mutex_lock(&scenes->mutex);
    for (const struct scene *scene = scenes->residents; scene && count < room; scene = scene->next)
        memcpy((*out)[count++], scene->about.scene.sha256, WIRE_SHA256_BYTES);
    pthread_mutex_unlock(&scenes->mutex);
    return count;
}

/* ---- the loop's side ---------------------------------------------------------------------------
 */

static enum wire_problem_code unknown(struct scenes *scenes, struct wire_problem *problem,
                                      const char *name)
{
    char known[192];
    if (!wire_name_ok(name))
        return wire_problem_set(problem, WIRE_PROBLEM_UNKNOWN_SCENE,
                                "a scene's name has 1 to 100 characters of A-Z a-z 0-9 . _ - and "
                                "begins with a letter or digit");
    scenes_names(scenes, known, sizeof known);
    return wire_problem_set(problem, WIRE_PROBLEM_UNKNOWN_SCENE,
                            known[0] ? "there is no scene \"%s\"; there are: %s"
                                     : "there is no scene \"%s\": the scenes folder is empty%s",
                            name, known);
}

enum wire_problem_code scenes_acquire(struct scenes *scenes, struct scene **out,
                                      struct wire_problem *problem, const char *name)
{
    enum wire_scene_state state = WIRE_SCENE_LOADING;
    char reason[256];
    reason[0] = 0;
    struct scene *scene = NULL;
    pthread_mutex_lock(&scenes->mutex);
    const struct scene_entry *entry = entry_find(scenes, name);
    if (entry) {
        state = entry->state;
        scene = entry->scene;
        snprintf(reason, sizeof reason, "%.255s", entry->reason);
        if (scene)
            scene->refs++;
    }
    pthread_mutex_unlock(&scenes->mutex);
    if (!entry)
        return unknown(scenes, problem, name);
    if (scene) {
        *out = scene;
        return WIRE_PROBLEM_NONE;
    }
    if (state == WIRE_SCENE_FAILED)
        return wire_problem_set(problem, WIRE_PROBLEM_SCENE_FAILED, "scene \"%s\": %s", name,
                                reason);
    return wire_problem_set(problem, WIRE_PROBLEM_SCENE_NOT_READY,
                            reason[0] ? "scene \"%s\" cannot be opened yet and is tried again: %s"
                                      : "scene \"%s\" is being verified; try again soon%s",
                            name, reason);
}

void scenes_release(struct scenes *scenes, struct scene **pointer)
{
    struct scene *scene = *pointer;
    if (!scene)
        return;
    pthread_mutex_lock(&scenes->mutex);
    bool last = --scene->refs == 0 && scene->names == 0;
    pthread_mutex_unlock(&scenes->mutex);
    *pointer = NULL;
    if (last)
        scenes_nudge(scenes); /* unmapping a large scene takes time: not on this thread */
}

/* The room for the documents of `count` entries, making those that are missing (memory ran out
 * when they changed, or it is just now being done); 0: no memory. With the mutex held. */
static size_t entries_room(struct scene_entry **entries, size_t count)
{
    size_t room = 1;
    for (size_t i = 0; i < count; i++) {
        if (!entries[i]->text)
            entries[i]->text = entry_document(entries[i]);
        if (!entries[i]->text)
            return 0;
        room += strlen(entries[i]->text) + REFS_MORE_BYTES + 1; /* and a comma */
    }
    return room;
}

enum wire_problem_code scenes_write(struct scenes *scenes, char **text,
                                    struct wire_problem *problem, const char *name)
{
    static const char head[] = "{\"scenes\":[", tail[] = "]}";
    *text = NULL;
    pthread_mutex_lock(&scenes->mutex);
    struct scene_entry *one = name ? entry_find(scenes, name) : NULL;
    struct scene_entry **entries = name ? &one : scenes->entries;
    size_t count = name ? one != NULL : scenes->count;
    size_t room = entries_room(entries, count);
    *text = room ? malloc(room + sizeof head + sizeof tail) : NULL;
    if (*text && (one || !name)) {
        struct text out = {*text};
        if (!name)
            text_add(&out, head, strlen(head));
        for (size_t i = 0; i < count; i++) {
            if (i > 0)
                text_add(&out, ",", 1);
            entry_copy(&out, entries[i]);
        }
        if (!name)
            text_add(&out, tail, strlen(tail));
        text_add(&out, "", 1);
    }
    pthread_mutex_unlock(&scenes->mutex);
    if (!*text)
        return wire_problem_set(problem, WIRE_PROBLEM_INTERNAL, "no memory for the list of scenes");
    if (name && !one) {
        free(*text);
        *text = NULL;
        return unknown(scenes, problem, name);
    }
    return WIRE_PROBLEM_NONE;
}

struct scenes_totals scenes_totals(struct scenes *scenes)
{
    struct scenes_totals totals = {0};
    pthread_mutex_lock(&scenes->mutex);
    for (size_t i = 0; i < scenes->count; i++) {
        totals.ready += scenes->entries[i]->state == WIRE_SCENE_READY;
        totals.loading += scenes->entries[i]->state == WIRE_SCENE_LOADING;
        totals.failed += scenes->entries[i]->state == WIRE_SCENE_FAILED;
    }
    for (const struct scene *scene = scenes->residents; scene; scene = scene->next)
        totals.bytes += scene->file.bytes;
    pthread_mutex_unlock(&scenes->mutex);
    return totals;
}
