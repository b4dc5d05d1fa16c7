/* The daemon's folder: its parts, its lock, and files that are whole or absent. */
#include "server/data_dir.h"

#include <errno.h>
#include <fcntl.h>
#include <inttypes.h>
#include <limits.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/file.h>
#include <sys/random.h>
#include <sys/stat.h>
#include <unistd.h>

enum lp_code data_fail_errno(struct lp_error *err, const char *where, const char *what, int number)
{
    enum lp_code code = number == ENOSPC || number == EDQUOT ? LP_NO_SPACE : LP_IO;
    return lp_fail(err, code, where, "%s: %s", what, strerror(number));
}

/* mkdir -p, at most PATH_MAX long. */
static enum lp_code folders_make(const char *path, struct lp_error *err)
{
    char part[DATA_DIR_PATH_BYTES];
    size_t n = strlen(path);
    if (n == 0 || n >= sizeof part)
        return lp_fail(err, LP_INVALID, "--data", "the path must have 1 to %zu characters",
                       sizeof part - 1);
    for (size_t i = 1; i <= n; i++) {
        if (path[i] != '/' && path[i] != 0)
            continue;
        memcpy(part, path, i);
        part[i] = 0;
        if (mkdir(part, 0755) < 0 && errno != EEXIST)
            return data_fail_errno(err, part, "the folder cannot be created", errno);
    }
    return LP_OK;
}

static enum lp_code folder_open(int *out, int parent_fd, const char *name, struct lp_error *err)
{
    if (mkdirat(parent_fd, name, 0755) < 0 && errno != EEXIST)
        return data_fail_errno(err, name, "the folder cannot be created", errno);
    *out = openat(parent_fd, name, O_RDONLY | O_DIRECTORY | O_CLOEXEC);
    if (*out < 0)
        return data_fail_errno(err, name, "the folder cannot be opened", errno);
    return LP_OK;
}

static enum lp_code lock_take(int *out, int folder_fd, const char *path, struct lp_error *err)
{
    int fd = openat(folder_fd, "lock", O_RDWR | O_CREAT | O_CLOEXEC | O_NOFOLLOW, 0644);
    if (fd < 0)
        return data_fail_errno(err, path, "the file `lock` cannot be opened", errno);
    if (flock(fd, LOCK_EX | LOCK_NB) < 0) {
        int why = errno;
        close(fd);
        if (why == EWOULDBLOCK)
            return lp_fail(err, LP_INVALID, path,
                           "another lightprobed uses this folder; give each its own --data");
        return data_fail_errno(err, path, "the folder cannot be locked", why);
    }
    char text[32];
    int n = snprintf(text, sizeof text, "%ld\n", (long)getpid());
    /* The number is for people; the lock itself is what counts. */
    if (ftruncate(fd, 0) == 0 && n > 0)
        (void)!write(fd, text, (size_t)n);
    *out = fd;
    return LP_OK;
}

enum lp_code data_dir_open(struct data_dir *out, const char *path, struct lp_error *err)
{
    struct data_dir dir = {.lock_fd = -1, .scenes_fd = -1, .resident_fd = -1, .results_fd = -1};
    int fd = -1;
    enum lp_code code = folders_make(path, err);
    if (code)
        return code;
    char absolute[PATH_MAX];
    fd = open(path, O_RDONLY | O_DIRECTORY | O_CLOEXEC);
    if (fd < 0 || !realpath(path, absolute) || strlen(absolute) >= sizeof dir.path) {
        code = data_fail_errno(err, path, "the folder cannot be opened", errno);
        goto out;
    }
    memcpy(dir.path, absolute, strlen(absolute) + 1);
    if ((code = lock_take(&dir.lock_fd, fd, path, err)) ||
        (code = folder_open(&dir.scenes_fd, fd, "scenes", err)) ||
        (code = folder_open(&dir.resident_fd, fd, "resident", err)) ||
        (code = folder_open(&dir.results_fd, fd, "results", err)))
        goto out;
    *out = dir;
out:
    if (fd >= 0)
        close(fd);
    if (code)
        data_dir_close(&dir);
    return code;
}

void data_dir_close(struct data_dir *dir)
{
    if (!dir->path[0] && dir->lock_fd == 0)
        return; /* zeroed */
    int fds[] = {dir->scenes_fd, dir->resident_fd, dir->results_fd, dir->lock_fd};
    for (size_t i = 0; i < sizeof fds / sizeof fds[0]; i++)
        if (fds[i] >= 0)
            close(fds[i]);
    *dir = (struct data_dir){0};
}

void data_temp_name(char out[DATA_TEMP_BYTES])
{
    uint64_t random = 0;
    if (getrandom(&random, sizeof random, GRND_NONBLOCK) != sizeof random)
        random = (uint64_t)getpid(); /* O_EXCL catches what is left */
    snprintf(out, DATA_TEMP_BYTES, DATA_TEMP_PREFIX "%016" PRIx64, random);
}

static enum lp_code bytes_write(int fd, const char *name, const void *data, size_t bytes,
                                struct lp_error *err)
{
    const unsigned char *at = data;
    while (bytes > 0) {
        ssize_t n = write(fd, at, bytes < (1u << 30) ? bytes : (1u << 30));
        if (n < 0 && errno == EINTR)
            continue;
        if (n <= 0)
            return data_fail_errno(err, name, "writing failed", n < 0 ? errno : ENOSPC);
        at += n;
        bytes -= (size_t)n;
    }
    return LP_OK;
}

enum lp_code data_file_write(int folder_fd, const char *name, const void *data, size_t bytes,
                             enum data_sync sync, struct lp_error *err)
{
    char temp[DATA_TEMP_BYTES];
    data_temp_name(temp);
    int fd = openat(folder_fd, temp, O_WRONLY | O_CREAT | O_EXCL | O_CLOEXEC, 0444);
    if (fd < 0)
        return data_fail_errno(err, name, "the file cannot be created", errno);
    enum lp_code code = bytes_write(fd, name, data, bytes, err);
    if (!code && sync == DATA_SYNC_DISK && fsync(fd) < 0)
        code = data_fail_errno(err, name, "the file cannot be made durable", errno);
    if (close(fd) < 0 && !code)
        code = data_fail_errno(err, name, "writing failed", errno);
    if (!code && renameat(folder_fd, temp, folder_fd, name) < 0)
        code = data_fail_errno(err, name, "the file cannot be put in place", errno);
    if (!code && sync == DATA_SYNC_DISK && fsync(folder_fd) < 0)
        code = data_fail_errno(err, name, "its folder cannot be made durable", errno);
    if (code)
        (void)unlinkat(folder_fd, temp, 0);
    return code;
}
