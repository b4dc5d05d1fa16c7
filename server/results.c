/* Result files: content-addressed, counted, bounded; nothing is accepted that cannot be kept. */
#include "server/results.h"

#include "server/data_dir.h"

#include <dirent.h>
#include <errno.h>
#include <fcntl.h>
#include <pthread.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <unistd.h>

#define RESULTS_BUCKETS 4096 /* a power of two */

enum file_state { FILE_WRITING, FILE_THERE, FILE_DOOMED, FILE_UNLINKING };

struct result_file {
    struct result_file *next;                          /* of its bucket */
    struct result_file *doomed_next, *doomed_previous; /* DOOMED */
    char key[RESULTS_KEY_BYTES];
    enum file_state state;
    uint32_t refs;
    uint64_t bytes; /* rounded up to blocks */
};

struct results {
    int folder_fd;
    uint64_t limit_bytes;
    pthread_mutex_t mutex;
    pthread_cond_t settled;                       /* a file left WRITING or UNLINKING */
    struct result_file *buckets[RESULTS_BUCKETS]; /* guarded by mutex, the files too */
    struct result_file *doomed;                   /* guarded by mutex: files in DOOMED */
    uint64_t unlinking;                           /* guarded by mutex: files in UNLINKING */
    uint64_t files, used_bytes, reserved_bytes;   /* guarded by mutex: all files there are */
    uint64_t free_bytes; /* guarded by mutex: of them, those in DOOMED and UNLINKING */
};

/* Keys begin with a hash, so their first characters spread well. */
static struct result_file **bucket_of(struct results *results, const char *key)
{
    uint32_t index = 2166136261u;
    for (int i = 0; i < 16 && key[i]; i++)
        index = (index ^ (unsigned char)key[i]) * 16777619u;
    return &results->buckets[(index ^ index >> 16) & (RESULTS_BUCKETS - 1)];
}

static struct result_file *file_find(struct results *results, const char *key)
{
    struct result_file *file = *bucket_of(results, key);
    while (file && strcmp(file->key, key) != 0)
        file = file->next;
    return file;
}

static void file_forget(struct results *results, struct result_file *file)
{
    struct result_file **at = bucket_of(results, file->key);
    while (*at != file)
        at = &(*at)->next;
    *at = file->next;
    results->files--;
    results->used_bytes -= file->bytes;
    if (file->state == FILE_UNLINKING) {
        results->unlinking--;
        results->free_bytes -= file->bytes;
    }
    free(file);
}

static void file_doom(struct results *results, struct result_file *file)
{
    file->state = FILE_DOOMED;
    file->doomed_previous = NULL;
    file->doomed_next = results->doomed;
    if (file->doomed_next)
        file->doomed_next->doomed_previous = file;
    results->doomed = file;
    results->free_bytes += file->bytes; /* room for others from now on: they unlink it first */
}

/* Out of the list of doomed files, to be used again or unlinked. */
static void file_undoom(struct results *results, struct result_file *file)
{
    if (file->doomed_previous)
        file->doomed_previous->doomed_next = file->doomed_next;
    else
        results->doomed = file->doomed_next;
    if (file->doomed_next)
        file->doomed_next->doomed_previous = file->doomed_previous;
}

/* Unlinks one doomed file. Called and left with the mutex held, without it in between. */
static void doomed_unlink(struct results *results)
{
    struct result_file *file = results->doomed;
    file_undoom(results, file);
    file->state = FILE_UNLINKING;
    results->unlinking++;
    pthread_mutex_unlock(&results->mutex);
    (void)unlinkat(results->folder_fd, file->key, 0);
    pthread_mutex_lock(&results->mutex);
    file_forget(results, file);
    pthread_cond_broadcast(&results->settled);
}

static enum lp_code folder_clear(int folder_fd, struct lp_error *err)
{
    int fd = openat(folder_fd, ".", O_RDONLY | O_DIRECTORY | O_CLOEXEC);
    DIR *dir = fd < 0 ? NULL : fdopendir(fd);
    if (!dir) {
        enum lp_code code = data_fail_errno(err, "results", "the folder cannot be read", errno);
        if (fd >= 0)
            close(fd);
        return code;
    }
    for (struct dirent *entry; (entry = readdir(dir));) {
        const char *dot = strrchr(entry->d_name, '.');
        bool ours = strncmp(entry->d_name, DATA_TEMP_PREFIX, strlen(DATA_TEMP_PREFIX)) == 0 ||
                    (dot && dot - entry->d_name == WIRE_SHA256_BYTES - 1);
        if (ours)
            (void)unlinkat(folder_fd, entry->d_name, 0);
    }
    closedir(dir);
    return LP_OK;
}

enum lp_code results_create(struct results **out, int folder_fd, uint64_t limit_bytes,
                            struct lp_error *err)
{
    enum lp_code code = folder_clear(folder_fd, err);
    if (code)
        return code;
    struct results *results = calloc(1, sizeof *results);
    if (!results)
        return lp_fail(err, LP_NO_MEMORY, "results", "no memory for the table of results");
    results->folder_fd = folder_fd;
    results->limit_bytes = limit_bytes;
    pthread_mutex_init(&results->mutex, NULL);
    pthread_cond_init(&results->settled, NULL);
    *out = results;
    return LP_OK;
}

void results_destroy(struct results **pointer)
{
    struct results *results = *pointer;
    if (!results)
        return;
    for (size_t i = 0; i < RESULTS_BUCKETS; i++) {
        for (struct result_file *file = results->buckets[i], *next; file; file = next) {
            next = file->next;
            (void)unlinkat(results->folder_fd, file->key, 0);
            free(file);
        }
    }
    pthread_cond_destroy(&results->settled);
    pthread_mutex_destroy(&results->mutex);
    free(results);
    *pointer = NULL;
}

bool results_reserve(struct results *results, uint64_t bytes)
{
    pthread_mutex_lock(&results->mutex);
    uint64_t taken = results->used_bytes - results->free_bytes + results->reserved_bytes;
    bool fits = taken <= results->limit_bytes && bytes <= results->limit_bytes - taken;
    if (fits)
        results->reserved_bytes += bytes;
    pthread_mutex_unlock(&results->mutex);
    return fits;
}

void results_settle(struct results *results, uint64_t bytes)
{
    pthread_mutex_lock(&results->mutex);
    results->reserved_bytes -= bytes;
    pthread_mutex_unlock(&results->mutex);
}

/* Whether a file of `bytes` would bring the folder over its limit, with files in it that are on
 * their way out. */
static bool must_unlink(const struct results *results, uint64_t bytes)
{
    uint64_t left =
        results->used_bytes < results->limit_bytes ? results->limit_bytes - results->used_bytes : 0;
    return bytes > left && (results->doomed || results->unlinking > 0);
}

/* Finds the file to refer to, or makes a new one in WRITING and sets `*fresh`; waits while another
 * thread writes or unlinks it, and unlinks doomed files that stand in the way of the limit.
 * NULL: no memory. Called and left with the mutex held. */
static struct result_file *file_claim(struct results *results, const char *key, size_t bytes,
                                      bool *fresh)
{
    struct result_file *file;
    uint64_t rounded =
        ((uint64_t)bytes + RESULTS_BLOCK_BYTES - 1) & ~(uint64_t)(RESULTS_BLOCK_BYTES - 1);
    for (;;) {
        file = file_find(results, key);
        bool busy = file && (file->state == FILE_WRITING || file->state == FILE_UNLINKING);
        if (!busy && (file || !must_unlink(results, rounded)))
            break;
        if (!busy && results->doomed)
            doomed_unlink(results);
        else
            pthread_cond_wait(&results->settled, &results->mutex);
    }
    *fresh = !file;
    if (file) {
        if (file->state == FILE_DOOMED) {
            file_undoom(results, file);
            file->state = FILE_THERE;
            results->free_bytes -= file->bytes;
        }
        file->refs++;
        return file;
    }
    file = calloc(1, sizeof *file);
    if (!file)
        return NULL;
    memcpy(file->key, key, strlen(key) + 1);
    file->state = FILE_WRITING;
    file->refs = 1;
    file->bytes = rounded;
    struct result_file **bucket = bucket_of(results, key);
    file->next = *bucket;
    *bucket = file;
    results->files++;
    results->used_bytes += file->bytes;
    return file;
}

enum lp_code results_put(struct results *results, char key[RESULTS_KEY_BYTES], const char *sha256,
                         const char *extension, const void *data, size_t bytes,
                         struct lp_error *err)
{
    char name[RESULTS_KEY_BYTES];
    bool fresh;
    snprintf(name, sizeof name, "%.64s.%.6s", sha256, extension);
    pthread_mutex_lock(&results->mutex);
    struct result_file *file = file_claim(results, name, bytes, &fresh);
    pthread_mutex_unlock(&results->mutex);
    if (!file)
        return lp_fail(err, LP_NO_MEMORY, name, "no memory to keep the result");
    enum lp_code code = LP_OK;
    if (fresh) {
        code = data_file_write(results->folder_fd, name, data, bytes, DATA_SYNC_NONE, err);
        pthread_mutex_lock(&results->mutex);
        if (code)
            file_forget(results, file); /* nobody else refers to it: they wait while WRITING */
        else
            file->state = FILE_THERE;
        pthread_cond_broadcast(&results->settled);
        pthread_mutex_unlock(&results->mutex);
    }
    if (!code)
        memcpy(key, name, sizeof name);
    return code;
}

bool results_drop(struct results *results, const char *key)
{
    pthread_mutex_lock(&results->mutex);
    struct result_file *file = file_find(results, key);
    if (file && file->refs > 0 && --file->refs == 0)
        file_doom(results, file);
    bool doomed = results->doomed != NULL;
    pthread_mutex_unlock(&results->mutex);
    return doomed;
}

void results_sweep(struct results *results)
{
    pthread_mutex_lock(&results->mutex);
    while (results->doomed)
        doomed_unlink(results);
    pthread_mutex_unlock(&results->mutex);
}

int results_open(const struct results *results, const char *key, uint64_t *bytes)
{
    struct stat about;
    int fd = openat(results->folder_fd, key, O_RDONLY | O_CLOEXEC | O_NOFOLLOW);
    if (fd < 0)
        return -1;
    if (fstat(fd, &about) < 0 || !S_ISREG(about.st_mode)) {
        close(fd);
        return -1;
    }
    *bytes = (uint64_t)about.st_size;
    return fd;
}

struct results_usage results_usage(struct results *results)
{
    pthread_mutex_lock(&results->mutex);
    struct results_usage usage = {.files = results->files,
                                  .used_bytes = results->used_bytes,
                                  .reserved_bytes = results->reserved_bytes,
                                  .limit_bytes = results->limit_bytes};
    pthread_mutex_unlock(&results->mutex);
    return usage;
}
