/* The scenes thread: looks at DIR/scenes, verifies what is new, drops what is gone. */
#include "server/scenes_private.h"

#include "server/clock.h"
#include "server/log.h"

#include <dirent.h>
#include <errno.h>
#include <fcntl.h>
#include <inttypes.h>
#include <poll.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/inotify.h>
#include <unistd.h>

#define SCAN_EVERY_NS (2 * CLOCK_NS_PER_S)
/* A bad file that is younger may still be being written. */
#define SETTLE_NS         (1 * CLOCK_NS_PER_S)
#define RETRY_FIRST_NS    (300 * CLOCK_NS_PER_MS)
#define RETRY_LAST_NS     (30 * CLOCK_NS_PER_S)
#define ANNOUNCE_AFTER_NS (1 * CLOCK_NS_PER_S) /* of verifying at start, before "ready" is said */
#define SUFFIX            ".lps"

/* ---- names in the folder -----------------------------------------------------------------------
 */

/* "NAME.lps" to NAME. */
static bool name_of_file(char name[WIRE_NAME_BYTES], const char *file)
{
    size_t n = strlen(file), suffix = strlen(SUFFIX);
    if (n <= suffix || n - suffix >= WIRE_NAME_BYTES || strcmp(file + n - suffix, SUFFIX) != 0)
        return false;
    memcpy(name, file, n - suffix);
    name[n - suffix] = 0;
    return wire_name_ok(name);
}

/* Files that are no scenes: said when the set of them changes, not every two seconds. */
struct ignored {
    uint64_t sum; /* of the names' hashes: the folder's order does not matter */
    size_t count;
    char example[WIRE_NAME_BYTES];
};

static void ignore(struct ignored *ignored, const char *file)
{
    uint64_t hash = UINT64_C(14695981039346656037);
    for (const char *at = file; *at; at++)
        hash = (hash ^ (unsigned char)*at) * UINT64_C(1099511628211);
    ignored->sum += hash;
    ignored->count++;
    snprintf(ignored->example, sizeof ignored->example, "%.100s", file);
}

/* Marks the entries that are there, adds new ones, removes those that are gone. */
static void scan_names(struct scenes *scenes)
{
    int fd = openat(scenes->dir->scenes_fd, ".", O_RDONLY | O_DIRECTORY | O_CLOEXEC);
    DIR *dir = fd < 0 ? NULL : fdopendir(fd);
    if (!dir) {
        log_event(LOG_ERROR, "scenes_unreadable", "error=%s", log_quote(strerror(errno)).text);
        if (fd >= 0)
            close(fd);
        return;
    }
    for (size_t i = 0; i < scenes->count; i++)
        scenes->entries[i]->seen_now = false;
    struct ignored ignored = {0};
    for (struct dirent *entry; (entry = readdir(dir));) {
        char name[WIRE_NAME_BYTES];
        if (strcmp(entry->d_name, ".") == 0 || strcmp(entry->d_name, "..") == 0)
            continue;
        struct scene_entry *known = NULL;
        if (name_of_file(name, entry->d_name)) {
            known = scenes_entry(scenes, name);
            if (!known)
                known = scenes_entry_add(scenes, name); /* NULL: SCENES_MAX */
        }
        if (known)
            known->seen_now = true;
        else
            ignore(&ignored, entry->d_name);
    }
    closedir(dir);
    if (ignored.sum != scenes->ignored && ignored.count > 0)
        log_event(LOG_WARNING, "scene_files_ignored", "count=%zu example=%s expected=NAME.lps",
                  ignored.count, log_quote(ignored.example).text);
    scenes->ignored = ignored.sum;
    for (size_t i = 0; i < scenes->count;) {
        struct scene_entry *entry = scenes->entries[i];
        if (entry->seen_now) {
            i++;
            continue;
        }
        log_event(LOG_INFO, "scene_removed", "scene=%s", entry->name);
        scenes_entry_remove(scenes, entry);
        scenes->stale = true;
    }
}

/* ---- one file ----------------------------------------------------------------------------------
 */

static bool is_transient(enum lp_code code)
{
    return code == LP_IO || code == LP_NO_SPACE || code == LP_NO_MEMORY;
}

/* Whether the file behind `fd` was written so recently that its writer may not have finished, or
 * since it had `identity`: reading it may have taken long. */
static bool is_young(int fd, const struct scene_identity *identity)
{
    struct timespec now;
    struct scene_identity after;
    if (!scene_identity_of(&after, fd))
        return false;
    clock_gettime(CLOCK_REALTIME, &now);
    int64_t age_ns = (int64_t)now.tv_sec * 1000000000 + now.tv_nsec - after.ctime_ns;
    return !scene_identity_equal(&after, identity) || (age_ns >= 0 && age_ns < (int64_t)SETTLE_NS);
}

static void entry_failed(struct scenes *scenes, struct scene_entry *entry, enum lp_code code,
                         const struct lp_error *error, bool young)
{
    uint64_t now = clock_ns();
    bool again = young || is_transient(code);
    entry->settled = !again;
    entry->delay_ns = entry->delay_ns ? 2 * entry->delay_ns : RETRY_FIRST_NS;
    if (young && entry->delay_ns > SETTLE_NS)
        entry->delay_ns = SETTLE_NS;
    if (entry->delay_ns > RETRY_LAST_NS)
        entry->delay_ns = RETRY_LAST_NS;
    entry->retry_ns = now + entry->delay_ns;
    if (young && !is_transient(code)) /* it stays what it was: loading, or the old scene */
        return;
    char reason[512];
    /* A place inside of the file helps; a path of our own folders does not. */
    bool inside = error->where[0] && !strchr(error->where, '/');
    snprintf(reason, sizeof reason, "scenes/%s%s: %.110s%s%.255s", entry->name, SUFFIX,
             inside ? error->where : "", inside ? ": " : "", error->text);
    if (is_transient(code)) { /* no verdict on the file */
        if (strcmp(entry->reason, reason) == 0)
            return; /* said and shown already */
        log_event(LOG_WARNING, "scene_delayed", "scene=%s serving=%s reason=%s", entry->name,
                  entry->scene ? "old" : "nothing", log_quote(reason).text);
        scenes_delay(scenes, entry, reason);
        return;
    }
    log_event(LOG_WARNING, "scene_failed", "scene=%s reason=%s", entry->name,
              log_quote(reason).text);
    scenes_fail(scenes, entry, reason);
    scenes->stale = true;
}

static void entry_ready(struct scenes *scenes, struct scene_entry *entry,
                        struct lp_scene_file *file, const char *sha256, const char *how,
                        uint64_t begin_ns)
{
    double open_s = clock_seconds(clock_ns() - begin_ns);
    size_t bytes = file->bytes;
    if (!scenes_publish(scenes, entry, file, sha256, open_s)) {
        struct lp_error error = {0};
        enum lp_code code = lp_fail(&error, LP_NO_MEMORY, entry->name, "no memory for the scene");
        entry_failed(scenes, entry, code, &error, false);
        return;
    }
    entry->settled = true;
    entry->delay_ns = 0;
    scenes->stale = true; /* it may have replaced another */
    log_event(LOG_INFO, "scene_ready", "scene=%s sha256=%s bytes=%zu %s open_s=%.6f", entry->name,
              sha256, bytes, how, open_s);
}

enum pass {
    PASS_KNOWN, /* only what an earlier run verified: microseconds each */
    PASS_ALL
};

/* Looks at one entry's file and does what it asks for. */
static void entry_look(struct scenes *scenes, struct scene_entry *entry, enum pass pass)
{
    struct scene_identity identity;
    struct lp_error error = {0};
    struct lp_scene_file file = {0};
    char sha256[WIRE_SHA256_BYTES];
    char file_name[WIRE_NAME_BYTES + sizeof SUFFIX];
    int fd = -1;
    snprintf(file_name, sizeof file_name, "%s%s", entry->name, SUFFIX);
    uint64_t begin_ns = clock_ns();
    if (!entry->settled && entry->retry_ns > begin_ns)
        return;
    enum lp_code code = scene_store_source(scenes->store, &fd, &identity, file_name, &error);
    if (code == LP_NOT_FOUND)
        return; /* the next scan of the names sees it */
    if (code) {
        /* A link stays a link: said once. */
        if (!entry->settled || (entry->scene && !is_transient(code)))
            entry_failed(scenes, entry, code, &error, false);
        return;
    }
    if (entry->settled && scene_identity_equal(&identity, &entry->seen))
        goto out;
    if (!scene_identity_equal(&identity, &entry->seen))
        entry->delay_ns = 0;
    const char *known = scene_store_known(scenes->store, &identity);
    if (known) {
        memcpy(sha256, known, sizeof sha256);
        code = scene_store_open(scenes->store, &file, sha256, &error);
        if (!code) {
            entry->seen = identity;
            entry_ready(scenes, entry, &file, sha256, "verified=before", begin_ns);
            goto out;
        }
        error = (struct lp_error){0}; /* whatever is wrong with the copy: make a new one */
    }
    if (pass == PASS_KNOWN)
        goto out;
    entry->seen = identity;
    code = scene_store_adopt(scenes->store, &file, sha256, fd, &identity, &error);
    if (!code)
        entry_ready(scenes, entry, &file, sha256, "verified=now", begin_ns);
    else if (code != LP_CANCELLED)
        entry_failed(scenes, entry, code, &error, is_young(fd, &identity));
out:
    close(fd);
}

/* ---- the thread --------------------------------------------------------------------------------
 */

static void announce(struct scenes *scenes)
{
    uint64_t one = 1;
    if (atomic_exchange(&scenes->scanned, true))
        return;
    (void)!write(scenes->wake_fd, &one, sizeof one);
}

static void scan(struct scenes *scenes)
{
    scan_names(scenes);
    /* Only this thread changes the array, so that it may read it without the mutex. */
    for (size_t i = 0; i < scenes->count && !atomic_load(&scenes->stop); i++)
        entry_look(scenes, scenes->entries[i], PASS_KNOWN);
    uint64_t begin_ns = clock_ns();
    for (size_t i = 0; i < scenes->count && !atomic_load(&scenes->stop); i++) {
        if (clock_ns() - begin_ns > ANNOUNCE_AFTER_NS)
            announce(scenes);
        entry_look(scenes, scenes->entries[i], PASS_ALL);
    }
    announce(scenes);
}

static void save(struct scenes *scenes)
{
    struct lp_error error = {0};
    if (scene_store_save(scenes->store, &error))
        log_event(LOG_WARNING, "verified_not_saved", "error=%s", log_quote(error.text).text);
    else
        scenes->stale = false;
}

/* Copies and memories of scenes that nobody uses any more. */
static void tidy(struct scenes *scenes)
{
    if (scenes_collect(scenes))
        scenes->stale = true;
    if (!scenes->stale || atomic_load(&scenes->stop))
        return;
    char(*hashes)[WIRE_SHA256_BYTES] = NULL;
    size_t count = scenes_resident_hashes(scenes, &hashes);
    if (count == SIZE_MAX)
        return;
    scene_store_sweep(scenes->store, (const char(*)[WIRE_SHA256_BYTES])hashes, count);
    free(hashes);
    save(scenes);
}

/* When something has to be tried again at the latest. */
static uint64_t next_look_ns(const struct scenes *scenes, uint64_t scanned_ns)
{
    uint64_t next = scanned_ns + SCAN_EVERY_NS;
    for (size_t i = 0; i < scenes->count; i++)
        if (!scenes->entries[i]->settled && scenes->entries[i]->retry_ns < next)
            next = scenes->entries[i]->retry_ns;
    return next;
}

static void events_read(int fd)
{
    char sink[4096];
    while (fd >= 0 && read(fd, sink, sizeof sink) > 0)
        continue;
}

void *scenes_main(void *argument)
{
    struct scenes *scenes = argument;
    pthread_setname_np(pthread_self(), "lp-scenes");
    if (scenes->inotify_fd >= 0) {
        char path[DATA_DIR_PATH_BYTES + 16];
        snprintf(path, sizeof path, "%s/scenes", scenes->dir->path);
        if (inotify_add_watch(scenes->inotify_fd, path,
                              IN_CLOSE_WRITE | IN_MOVED_TO | IN_MOVED_FROM | IN_DELETE |
                                  IN_ONLYDIR) < 0)
            log_event(LOG_WARNING, "scenes_not_watched", "error=%s look_every_s=2",
                      log_quote(strerror(errno)).text);
    }
    scenes->stale = true; /* what crashes left */
    while (!atomic_load(&scenes->stop)) {
        scan(scenes);
        uint64_t scanned_ns = clock_ns();
        tidy(scenes);
        for (;;) {
            uint64_t now = clock_ns(), next = next_look_ns(scenes, scanned_ns);
            struct pollfd fds[] = {{.fd = scenes->event_fd, .events = POLLIN},
                                   {.fd = scenes->inotify_fd, .events = POLLIN}};
            int wait_ms = next > now ? (int)((next - now) / CLOCK_NS_PER_MS) + 1 : 0;
            int got = poll(fds, 2, wait_ms);
            events_read(scenes->event_fd);
            if (got <= 0 || atomic_load(&scenes->stop) || fds[1].revents)
                break;
            tidy(scenes); /* a scene lost its last job */
        }
        events_read(scenes->inotify_fd);
    }
    save(scenes);     /* what was verified since the last look need not be verified again */
    announce(scenes); /* nobody shall wait for a scan that does not come */
    ending_note(&scenes->ending);
    return NULL;
}
