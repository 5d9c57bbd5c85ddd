/* Everything goes into PATH.splatd-PID, which the file's own lock says is in use; a rename makes it PATH. In containers
 * that share a folder every process has the number 1: where the name is in use, or is another user's, another one is
 * taken. Owned by one thread at a time. */
#include "dataset/part_file.h"

#include <errno.h>
#include <fcntl.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

#include "base/file.h"

enum { names_most = 64 };

static int name(const char *path, unsigned in_use, char **out)
{
    int length = in_use ? asprintf(out, "%s" SPL_UNFINISHED "-%u", path, (long)getpid(), in_use)
                        : asprintf(out, "%s" SPL_UNFINISHED, path, (long)getpid());
    if (length >= 0)
        return SPL_OK;
    *out = NULL;
    return SPL_E_NOMEM;
}

int spl_part_file_init(struct spl_part_file *file, const char *path, struct spl_error *err)
{
    *file = (struct spl_part_file){.path = strdup(path), .fd = -1};
    int rc = SPL_E_NOMEM;
    spl_file_sweep(path, SPL_UNFINISHED_ANY);
    for (unsigned in_use = 0;; in_use++) {
        free(file->part_path);
        if (!file->path || name(path, in_use, &file->part_path)) {
            spl_fail(err, rc, "out of memory for the name of %s", path);
            goto failed;
        }
        file->fd = spl_file_create(file->part_path, 0666);
        if (file->fd >= 0)
            return SPL_OK;
        if (errno != EEXIST || in_use == names_most)
            break;
    }
    const int why = errno;
    const char *slash = strrchr(path, '/');
    const int folder_bytes = slash ? (int)(slash - path) + 1 : 0;
    if (why == ENOENT && slash)
        rc = spl_fail(err, SPL_E_IO, "cannot create %s: there is no folder '%.*s'", path, folder_bytes, path);
    else
        rc = spl_fail_errno(err, why, "cannot create %s", file->part_path);
failed:
    spl_part_file_finish(file);
    return rc;
}

static int fail_write(const struct spl_part_file *file, uint64_t offset, size_t bytes, int why, struct spl_error *err)
{
    bool full = why == ENOSPC || why == EDQUOT || why == EFBIG;
    return spl_fail(err, SPL_E_IO, "cannot write %s, %zu bytes at %llu: %s%s", file->part_path, bytes,
                    (unsigned long long)offset, strerror(why),
                    full ? "; make room there, or write to another disk" : "");
}

int spl_part_file_write(struct spl_part_file *file, uint64_t offset, const void *data, size_t bytes,
                        struct spl_error *err)
{
    const char *p = data;
    while (bytes) {
        ssize_t n = pwrite(file->fd, p, bytes, (off_t)offset);
        if (n < 0 && errno == EINTR)
            continue;
        if (n <= 0)
            return fail_write(file, offset, bytes, n ? errno : ENOSPC, err);
        p += n;
        offset += (uint64_t)n;
        bytes -= (size_t)n;
    }
    return SPL_OK;
}

int spl_part_file_read(const struct spl_part_file *file, uint64_t offset, void *out, size_t bytes,
                       struct spl_error *err)
{
    char *p = out;
    while (bytes) {
        ssize_t n = pread(file->fd, p, bytes, (off_t)offset);
        if (n < 0 && errno == EINTR)
            continue;
        if (n <= 0)
            return spl_fail_errno(err, n ? errno : EIO, "cannot read %s again at byte %llu", file->part_path,
                                  (unsigned long long)offset);
        p += n;
        offset += (uint64_t)n;
        bytes -= (size_t)n;
    }
    return SPL_OK;
}

static int sync_directory(const char *path, struct spl_error *err)
{
    char *directory = strdup(path);
    if (!directory)
        return spl_fail(err, SPL_E_NOMEM, "out of memory for the name of %s", path);
    char *slash = strrchr(directory, '/');
    if (slash)
        slash[slash == directory] = 0;
    int fd = open(slash ? directory : ".", O_RDONLY | O_DIRECTORY | O_CLOEXEC), rc = SPL_OK;
    /* Directories that one may write but not read, or that cannot be synced, are no reason to refuse. */
    if (fd >= 0 && fsync(fd) && errno != EINVAL)
        rc = spl_fail_errno(err, errno, "cannot sync the directory of %s", path);
    if (fd >= 0)
        close(fd);
    free(directory);
    return rc;
}

int spl_part_file_commit(struct spl_part_file *file, struct spl_error *err)
{
    if (fsync(file->fd))
        return spl_fail_errno(err, errno, "cannot sync %s", file->part_path);
    if (rename(file->part_path, file->path))
        return spl_fail_errno(err, errno, "cannot rename %s to %s", file->part_path, file->path);
    file->committed = true;
    return sync_directory(file->path, err);
}

void spl_part_file_finish(struct spl_part_file *file)
{
    if (file->part_path && file->fd >= 0) {
        if (!file->committed)
            unlink(file->part_path);
        close(file->fd);
    }
    free(file->part_path);
    free(file->path);
    *file = (struct spl_part_file){0};
}
