/* Scene files on the disk: operators' files in, our own checked and immutable copies out. */
#include "server/scene_store.h"

#include "server/bake.h"

#include <dirent.h>
#include <errno.h>
#include <fcntl.h>
#include <inttypes.h>
#include <linux/fs.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/ioctl.h>
#include <sys/stat.h>
#include <unistd.h>

#define COPY_BLOCK_BYTES   (1u << 20)
#define CHANGED_TEXT       "the file changed while it was read"
#define VERIFIED_NAME      "verified"
#define VERIFIED_BYTES_MAX (1u << 20)
#define VERIFIED_HEAD      "lightprobe verified 1\n"

struct verified {
    struct scene_identity source, copy;
    char sha256[WIRE_SHA256_BYTES];
};

struct scene_store {
    const struct data_dir *dir;
    const atomic_bool *stop;
    struct verified table[SCENE_STORE_LINES];
    size_t count;
    bool changed; /* since it was saved */
};

bool scene_identity_equal(const struct scene_identity *a, const struct scene_identity *b)
{
    return a->dev == b->dev && a->ino == b->ino && a->bytes == b->bytes &&
           a->mtime_ns == b->mtime_ns && a->ctime_ns == b->ctime_ns;
}

static struct scene_identity identity_of(const struct stat *about)
{
    return (struct scene_identity){
        .dev = (uint64_t)about->st_dev,
        .ino = (uint64_t)about->st_ino,
        .bytes = (uint64_t)about->st_size,
        .mtime_ns = (int64_t)about->st_mtim.tv_sec * 1000000000 + about->st_mtim.tv_nsec,
        .ctime_ns = (int64_t)about->st_ctim.tv_sec * 1000000000 + about->st_ctim.tv_nsec,
    };
}

bool scene_identity_of(struct scene_identity *out, int fd)
{
    struct stat about;
    if (fstat(fd, &about) < 0)
        return false;
    *out = identity_of(&about);
    return true;
}

static void key_of(char out[SCENE_KEY_BYTES], const char *sha256)
{
    snprintf(out, SCENE_KEY_BYTES, "%.64s.lps", sha256);
}

static bool sha256_ok(const char *text)
{
    return strlen(text) == WIRE_SHA256_BYTES - 1 &&
           strspn(text, "0123456789abcdef") == WIRE_SHA256_BYTES - 1;
}

/* ---- the table of verified files ---------------------------------------------------------------
 */

static void table_read_line(struct scene_store *store, const char *line)
{
    struct verified v;
    char sha256[WIRE_SHA256_BYTES];
    struct scene_identity *s = &v.source, *c = &v.copy;
    if (store->count == SCENE_STORE_LINES)
        return;
    int got = sscanf(line,
                     "%64s %" SCNu64 " %" SCNu64 " %" SCNu64 " %" SCNd64 " %" SCNd64 " %" SCNu64
                     " %" SCNu64 " %" SCNu64 " %" SCNd64 " %" SCNd64,
                     sha256, &s->dev, &s->ino, &s->bytes, &s->mtime_ns, &s->ctime_ns, &c->dev,
                     &c->ino, &c->bytes, &c->mtime_ns, &c->ctime_ns);
    if (got != 11 || !sha256_ok(sha256))
        return;
    memcpy(v.sha256, sha256, sizeof v.sha256);
    store->table[store->count++] = v;
}

static void table_read(struct scene_store *store)
{
    int fd = openat(store->dir->resident_fd, VERIFIED_NAME, O_RDONLY | O_CLOEXEC | O_NOFOLLOW);
    if (fd < 0)
        return;
    char *text = malloc(VERIFIED_BYTES_MAX + 1);
    size_t n = 0;
    for (ssize_t got; text && n < VERIFIED_BYTES_MAX; n += (size_t)got) {
        got = read(fd, text + n, VERIFIED_BYTES_MAX - n);
        if (got <= 0)
            break;
    }
    close(fd);
    if (!text)
        return;
    text[n] = 0;
    if (strncmp(text, VERIFIED_HEAD, strlen(VERIFIED_HEAD)) == 0) {
        for (char *line = text + strlen(VERIFIED_HEAD), *end; (end = strchr(line, '\n'));
             line = end + 1) {
            *end = 0;
            table_read_line(store, line);
        }
    }
    free(text);
}

enum lp_code scene_store_save(struct scene_store *store, struct lp_error *err)
{
    if (!store->changed)
        return LP_OK;
    char *text = NULL;
    size_t bytes = 0;
    FILE *memory = open_memstream(&text, &bytes);
    if (!memory)
        return lp_fail(err, LP_NO_MEMORY, VERIFIED_NAME, "no memory to write it");
    fputs(VERIFIED_HEAD, memory);
    for (size_t i = 0; i < store->count; i++) {
        const struct scene_identity *s = &store->table[i].source, *c = &store->table[i].copy;
        fprintf(memory,
                "%s %" PRIu64 " %" PRIu64 " %" PRIu64 " %" PRId64 " %" PRId64 " %" PRIu64
                " %" PRIu64 " %" PRIu64 " %" PRId64 " %" PRId64 "\n",
                store->table[i].sha256, s->dev, s->ino, s->bytes, s->mtime_ns, s->ctime_ns, c->dev,
                c->ino, c->bytes, c->mtime_ns, c->ctime_ns);
    }
    enum lp_code code;
    if (fclose(memory) != 0)
        code = lp_fail(err, LP_NO_MEMORY, VERIFIED_NAME, "no memory to write it");
    else
        code = data_file_write(store->dir->resident_fd, VERIFIED_NAME, text, bytes, DATA_SYNC_DISK,
                               err);
    free(text);
    if (!code)
        store->changed = false;
    return code;
}

static void table_remember(struct scene_store *store, const struct verified *verified)
{
    for (size_t i = 0; i < store->count; i++) /* the same bytes under another name: one copy now */
        if (strcmp(store->table[i].sha256, verified->sha256) == 0)
            store->table[i].copy = verified->copy;
    if (store->count == SCENE_STORE_LINES) /* forgetting one costs a verification at most */
        memmove(store->table, store->table + 1, --store->count * sizeof store->table[0]);
    store->table[store->count++] = *verified;
    store->changed = true;
}

const char *scene_store_known(const struct scene_store *store,
                              const struct scene_identity *identity)
{
    for (size_t i = 0; i < store->count; i++) {
        const struct verified *v = &store->table[i];
        struct stat about;
        char key[SCENE_KEY_BYTES];
        if (!scene_identity_equal(&v->source, identity))
            continue;
        key_of(key, v->sha256);
        if (fstatat(store->dir->resident_fd, key, &about, AT_SYMLINK_NOFOLLOW) < 0)
            continue;
        struct scene_identity copy = identity_of(&about);
        if (S_ISREG(about.st_mode) && scene_identity_equal(&copy, &v->copy))
            return v->sha256;
    }
    return NULL;
}

/* ---- files -------------------------------------------------------------------------------------
 */

struct scene_store *scene_store_create(const struct data_dir *dir, const atomic_bool *stop)
{
    struct scene_store *store = calloc(1, sizeof *store);
    if (!store)
        return NULL;
    store->dir = dir;
    store->stop = stop;
    table_read(store);
    return store;
}

void scene_store_destroy(struct scene_store **store)
{
    free(*store);
    *store = NULL;
}

enum lp_code scene_store_source(const struct scene_store *store, int *out,
                                struct scene_identity *identity, const char *file_name,
                                struct lp_error *err)
{
    struct stat about;
    /* O_NONBLOCK: a named pipe must not hold us up. */
    int fd =
        openat(store->dir->scenes_fd, file_name, O_RDONLY | O_CLOEXEC | O_NOFOLLOW | O_NONBLOCK);
    if (fd < 0 && errno == ELOOP)
        return lp_fail(err, LP_INVALID, file_name,
                       "is a link; links are not followed, put the file itself there");
    if (fd < 0 && errno == ENOENT)
        return lp_fail(err, LP_NOT_FOUND, file_name, "is not there any more");
    if (fd < 0)
        return data_fail_errno(err, file_name, "cannot be opened", errno);
    if (fstat(fd, &about) < 0) {
        enum lp_code code = data_fail_errno(err, file_name, "cannot be looked at", errno);
        close(fd);
        return code;
    }
    if (!S_ISREG(about.st_mode)) {
        close(fd);
        return lp_fail(err, LP_INVALID, file_name, "is not a regular file");
    }
    *identity = identity_of(&about);
    *out = fd;
    return LP_OK;
}

static enum lp_code block_write(int fd, const unsigned char *block, size_t bytes,
                                struct lp_error *err)
{
    for (size_t done = 0; done < bytes;) {
        ssize_t n = write(fd, block + done, bytes - done);
        if (n < 0 && errno == EINTR)
            continue;
        if (n <= 0)
            return data_fail_errno(err, "resident", "the checked copy cannot be written",
                                   n < 0 ? errno : ENOSPC);
        done += (size_t)n;
    }
    return LP_OK;
}

/* Copies `bytes` of `from` to `to` (or lets them share their blocks, where the file system can) and
 * hashes the very bytes of the copy. Not one byte more is taken: a file that grows while it is read
 * must not fill the disk. */
static enum lp_code copy_and_hash(const struct scene_store *store, int to, int from, uint64_t bytes,
                                  char *sha256, struct lp_error *err)
{
    uint8_t raw[LP_SHA256_BYTES];
    struct lp_sha256_state hash;
    enum lp_code code = LP_OK;
    unsigned char *block = malloc(COPY_BLOCK_BYTES);
    if (!block)
        return lp_fail(err, LP_NO_MEMORY, "resident", "no memory to copy the scene");
    bool shared = ioctl(to, FICLONE, from) == 0;
    lp_sha256_begin(&hash);
    for (uint64_t at = 0; !code;) {
        ssize_t n = pread(shared ? to : from, block, COPY_BLOCK_BYTES, (off_t)at);
        if (n < 0 && errno == EINTR)
            continue;
        if (n < 0)
            code = data_fail_errno(err, "scenes", "the file cannot be read", errno);
        if (n <= 0)
            break;
        if ((uint64_t)n > bytes - at) {
            code = lp_fail(err, LP_CORRUPT, "scenes", CHANGED_TEXT);
            break;
        }
        if (atomic_load(store->stop)) {
            code = lp_fail(err, LP_CANCELLED, "scenes", "the service is shutting down");
            break;
        }
        lp_sha256_update(&hash, block, (size_t)n);
        if (!shared)
            code = block_write(to, block, (size_t)n, err);
        at += (uint64_t)n;
    }
    free(block);
    lp_sha256_end(&hash, raw);
    bake_hex(sha256, raw);
    return code;
}

static enum lp_code copy_open(const struct scene_store *store, struct lp_scene_file *file,
                              const char *key, enum lp_trust trust, struct lp_error *err)
{
    char path[DATA_DIR_PATH_BYTES + 16 + SCENE_KEY_BYTES];
    snprintf(path, sizeof path, "%s/resident/%s", store->dir->path, key);
    return lp_scene_file_open(file, path, trust, err);
}

enum lp_code scene_store_open(const struct scene_store *store, struct lp_scene_file *file,
                              const char *sha256, struct lp_error *err)
{
    char key[SCENE_KEY_BYTES];
    key_of(key, sha256);
    return copy_open(store, file, key, LP_TRUST_CONTENT, err);
}

/* The last steps for a verified temporary copy: durable, in place, remembered. */
static enum lp_code copy_keep(struct scene_store *store, int fd, const char *temp,
                              struct verified *verified, struct lp_error *err)
{
    int folder = store->dir->resident_fd;
    char key[SCENE_KEY_BYTES];
    struct stat about;
    key_of(key, verified->sha256);
    if (fchmod(fd, 0444) < 0 || fsync(fd) < 0)
        return data_fail_errno(err, key, "the checked copy cannot be made durable", errno);
    if (renameat(folder, temp, folder, key) < 0 || fsync(folder) < 0)
        return data_fail_errno(err, key, "the checked copy cannot be put in place", errno);
    if (fstat(fd, &about) < 0)
        return data_fail_errno(err, key, "the checked copy cannot be looked at", errno);
    verified->copy = identity_of(&about);
    table_remember(store, verified);
    return LP_OK;
}

enum lp_code scene_store_adopt(struct scene_store *store, struct lp_scene_file *out,
                               char sha256[WIRE_SHA256_BYTES], int source_fd,
                               const struct scene_identity *identity, struct lp_error *err)
{
    int folder = store->dir->resident_fd;
    char temp[DATA_TEMP_BYTES];
    struct verified verified = {.source = *identity};
    struct lp_scene_file file = {0};
    struct stat about;
    data_temp_name(temp);
    int fd = openat(folder, temp, O_RDWR | O_CREAT | O_EXCL | O_CLOEXEC, 0600);
    if (fd < 0)
        return data_fail_errno(err, "resident", "the checked copy cannot be created", errno);
    enum lp_code code = copy_and_hash(store, fd, source_fd, identity->bytes, verified.sha256, err);
    if (code)
        goto out;
    if (fstat(source_fd, &about) < 0) {
        code = data_fail_errno(err, "scenes", "the file cannot be looked at", errno);
        goto out;
    }
    struct scene_identity after = identity_of(&about);
    if (!scene_identity_equal(&after, identity)) {
        code = lp_fail(err, LP_CORRUPT, "scenes", CHANGED_TEXT);
        goto out;
    }
    code = copy_open(store, &file, temp, LP_TRUST_NOTHING, err);
    if (!code)
        code = copy_keep(store, fd, temp, &verified, err);
    if (!code) {
        *out = file;
        file = (struct lp_scene_file){0};
        memcpy(sha256, verified.sha256, sizeof verified.sha256);
    }
out:
    close(fd);
    if (code) {
        lp_scene_file_close(&file);
        (void)unlinkat(folder, temp, 0);
    }
    return code;
}

static bool is_listed(const char *sha256, const char (*sha256s)[WIRE_SHA256_BYTES], size_t count)
{
    for (size_t i = 0; i < count; i++)
        if (strcmp(sha256s[i], sha256) == 0)
            return true;
    return false;
}

void scene_store_sweep(struct scene_store *store, const char (*sha256s)[WIRE_SHA256_BYTES],
                       size_t count)
{
    size_t kept = 0;
    for (size_t i = 0; i < store->count; i++)
        if (is_listed(store->table[i].sha256, sha256s, count))
            store->table[kept++] = store->table[i];
    store->changed |= kept != store->count;
    store->count = kept;
    int fd = openat(store->dir->resident_fd, ".", O_RDONLY | O_DIRECTORY | O_CLOEXEC);
    DIR *dir = fd < 0 ? NULL : fdopendir(fd);
    if (!dir) {
        if (fd >= 0)
            close(fd);
        return; /* tried again at the next change */
    }
    for (struct dirent *entry; (entry = readdir(dir));) {
        char sha256[WIRE_SHA256_BYTES];
        snprintf(sha256, sizeof sha256, "%.64s", entry->d_name);
        bool temp = strncmp(entry->d_name, DATA_TEMP_PREFIX, strlen(DATA_TEMP_PREFIX)) == 0;
        bool copy = sha256_ok(sha256) && strcmp(entry->d_name + strlen(sha256), ".lps") == 0;
        if (temp || (copy && !is_listed(sha256, sha256s, count)))
            (void)unlinkat(store->dir->resident_fd, entry->d_name, 0);
    }
    closedir(dir);
}
