/* Files that appear only when they are whole: a temporary file beside the target, then rename. */
#include "clients/c/lpc_private.h"

#include <errno.h>
#include <fcntl.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

#define TEMPORARY_ATTEMPTS 100

enum lpc_code lpc_file_create(struct lpc_file *file, const char *path, struct lpc_error *err)
{
    struct lpc_file made = {0};
    if (strlen(path) >= sizeof made.path)
        return lpc_fail(err, LPC_INVALID, "%.80s...: the path is longer than %zu characters", path,
                        sizeof made.path - 1);
    snprintf(made.path, sizeof made.path, "%s", path);
    int descriptor = -1;
    for (unsigned attempt = 0; descriptor < 0 && attempt < TEMPORARY_ATTEMPTS; attempt++) {
        snprintf(made.temporary, sizeof made.temporary, "%s.tmp%ld-%u", path, (long)getpid(),
                 attempt);
        descriptor = open(made.temporary, O_WRONLY | O_CREAT | O_EXCL | O_CLOEXEC, 0666);
        if (descriptor < 0 && errno != EEXIST)
            break;
    }
    if (descriptor < 0)
        return lpc_fail(err, LPC_IO,
                        "%s: cannot be written: %s; check that the folder is there and yours", path,
                        strerror(errno));
    made.stream = fdopen(descriptor, "wb");
    if (!made.stream) {
        close(descriptor);
        unlink(made.temporary);
        return lpc_fail(err, LPC_NO_MEMORY, "%s: out of memory", path);
    }
    *file = made;
    return LPC_OK;
}

enum lpc_code lpc_file_keep(struct lpc_file *file, struct lpc_error *err)
{
    FILE *stream = file->stream;
    file->stream = NULL;
    bool good = !ferror(stream) && fflush(stream) == 0 && fsync(fileno(stream)) == 0;
    int reason = errno;
    if (fclose(stream) != 0 && good) {
        good = false;
        reason = errno;
    }
    if (good && rename(file->temporary, file->path) == 0) {
        file->temporary[0] = '\0';
        return LPC_OK;
    }
    if (good)
        reason = errno;
    unlink(file->temporary);
    file->temporary[0] = '\0';
    return lpc_fail(err, LPC_IO, "%s: cannot be written: %s", file->path, strerror(reason));
}

void lpc_file_drop(struct lpc_file *file)
{
    if (file->stream)
        fclose(file->stream);
    file->stream = NULL;
    if (file->temporary[0])
        unlink(file->temporary);
    file->temporary[0] = '\0';
}

enum lpc_code lpc_file_write(const char *path, const void *data, size_t bytes,
                             struct lpc_error *err)
{
    struct lpc_file file = {0};
    enum lpc_code code = lpc_file_create(&file, path, err);
    if (code != LPC_OK)
        return code;
    if (bytes && fwrite(data, 1, bytes, file.stream) != bytes) {
        code = lpc_fail(err, LPC_IO, "%s: cannot be written: %s", path, strerror(errno));
        lpc_file_drop(&file);
        return code;
    }
    return lpc_file_keep(&file, err);
}
