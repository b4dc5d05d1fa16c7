/* Scene files on disk: mapped read-only, written whole or not at all. */
#include "engine/scene_file.h"

#include <errno.h>
#include <fcntl.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/mman.h>
#include <sys/stat.h>
#include <unistd.h>

enum lp_code lp_scene_file_open(struct lp_scene_file *file, const char *path, enum lp_trust trust,
                                struct lp_error *err)
{
    enum lp_code code = LP_OK;
    void *map = MAP_FAILED;
    size_t bytes = 0;
    struct lp_scene scene;
    struct stat status;
    int fd = open(path, O_RDONLY | O_CLOEXEC | O_NONBLOCK); /* a pipe must not hang us */
    if (fd < 0)
        return lp_fail(err, errno == ENOENT ? LP_NOT_FOUND : LP_IO, path, "cannot be opened: %s",
                       strerror(errno));
    if (fstat(fd, &status) != 0 || !S_ISREG(status.st_mode)) {
        code = lp_fail(err, LP_IO, path, "is not a regular file");
        goto out;
    }
    bytes = (size_t)status.st_size;
    if (bytes == 0) {
        code = lp_fail(err, LP_CORRUPT, path, "the file is empty");
        goto out;
    }
    map = mmap(NULL, bytes, PROT_READ, MAP_SHARED, fd, 0);
    if (map == MAP_FAILED) {
        code = lp_fail(err, LP_IO, path, "cannot be mapped: %s", strerror(errno));
        goto out;
    }
    code = lp_scene_view(&scene, map, bytes, trust, err);
    if (code != LP_OK)
        goto out;
    *file = (struct lp_scene_file){.scene = scene, .map = map, .bytes = bytes};
    map = MAP_FAILED;
out:
    if (map != MAP_FAILED)
        munmap(map, bytes);
    close(fd);
    return code;
}

void lp_scene_file_close(struct lp_scene_file *file)
{
    if (file->map)
        munmap((void *)(uintptr_t)file->map, file->bytes);
    *file = (struct lp_scene_file){0};
}

static enum lp_code write_failure(const char *path, const char *what, int error,
                                  struct lp_error *err)
{
    enum lp_code code = error == ENOSPC || error == EDQUOT ? LP_NO_SPACE : LP_IO;
    return lp_fail(err, code, path, "%s: %s", what, strerror(error));
}

static enum lp_code write_all(int fd, const uint8_t *bytes, size_t count, const char *path,
                              struct lp_error *err)
{
    while (count > 0) {
        ssize_t n = write(fd, bytes, count < (1u << 30) ? count : 1u << 30);
        if (n < 0 && errno == EINTR)
            continue;
        if (n <= 0)
            return write_failure(path, "cannot be written", n < 0 ? errno : ENOSPC, err);
        bytes += n;
        count -= (size_t)n;
    }
    return LP_OK;
}

/* The new name must be on disk before anybody relies on it. */
static enum lp_code sync_folder(const char *path, struct lp_error *err)
{
    char folder[4096];
    const char *slash = strrchr(path, '/');
    size_t length = slash ? (size_t)(slash - path) + 1 : 0;
    if (length + 2 > sizeof folder)
        return lp_fail(err, LP_IO, path, "the path is too long");
    memcpy(folder, path, length);
    memcpy(folder + length, ".", 2);
    int fd = open(folder, O_RDONLY | O_DIRECTORY | O_CLOEXEC);
    if (fd < 0 || fsync(fd) != 0) {
        int error = errno;
        if (fd >= 0)
            close(fd);
        return write_failure(path, "its folder cannot be synced", error, err);
    }
    close(fd);
    return LP_OK;
}

enum lp_code lp_scene_file_write(const char *path, const void *bytes, size_t byte_count,
                                 struct lp_error *err)
{
    char temporary[4096];
    enum lp_code code = LP_OK;
    int n = snprintf(temporary, sizeof temporary, "%s.XXXXXX", path);
    if (n < 0 || (size_t)n >= sizeof temporary)
        return lp_fail(err, LP_IO, path, "the path is too long");
    int fd = mkostemp(temporary, O_CLOEXEC);
    if (fd < 0)
        return write_failure(path, "no file can be made in its folder", errno, err);
    code = write_all(fd, bytes, byte_count, path, err);
    if (code == LP_OK && (fchmod(fd, 0644) != 0 || fsync(fd) != 0))
        code = write_failure(path, "cannot be brought to disk", errno, err);
    if (close(fd) != 0 && code == LP_OK)
        code = write_failure(path, "cannot be closed", errno, err);
    if (code == LP_OK && rename(temporary, path) != 0)
        code = write_failure(path, "cannot be given its name", errno, err);
    if (code != LP_OK) {
        unlink(temporary);
        return code;
    }
    return sync_folder(path, err);
}
