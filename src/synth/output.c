/* A file appears under its name when all of it is on the disk, and not before: until then it is NAME.splatd-PID, which
 * spl_output_finish() removes. What was there under the name stays until it is replaced as a whole.
 *
 * Invariant: fd >= 0 only between open and commit or finish. Owned by one thread. */
#include "synth/output.h"

#include <errno.h>
#include <fcntl.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <unistd.h>

#include "base/file.h"

int spl_output_open(struct spl_output *out, const char *directory, const char *name, const char *extension,
                    struct spl_error *err)
{
    *out = (struct spl_output){.fd = -1};
    if (asprintf(&out->path, "%s/%s.%s", directory, name, extension) < 0) {
        out->path = NULL;
        return spl_fail(err, SPL_E_NOMEM, "out of memory for a path");
    }
    if (asprintf(&out->temporary, "%s" SPL_UNFINISHED, out->path, (long)getpid()) < 0) {
        out->temporary = NULL;
        return spl_fail(err, SPL_E_NOMEM, "out of memory for a path");
    }
    out->fd = spl_file_create(out->temporary, 0666);
    if (out->fd < 0) {
        int rc = spl_fail_errno(err, errno, "%s cannot be created", out->temporary);
        free(out->temporary); // it may be another's, and stays
        out->temporary = NULL;
        return rc;
    }
    return 0;
}

int spl_output_write(struct spl_output *out, const void *bytes, size_t count, struct spl_error *err)
{
    if (spl_write_all(out->fd, bytes, count))
        return spl_fail_errno(err, errno, "writing %s", out->temporary);
    return 0;
}

int spl_output_write_at(struct spl_output *out, const void *bytes, size_t count, uint64_t offset, struct spl_error *err)
{
    if (lseek(out->fd, (off_t)offset, SEEK_SET) < 0)
        return spl_fail_errno(err, errno, "seeking in %s", out->temporary);
    return spl_output_write(out, bytes, count, err);
}

int spl_output_commit(struct spl_output *out, struct spl_error *err)
{
    int fd = out->fd;
    out->fd = -1;
    int synced = fsync(fd);
    if (close(fd) || synced)
        return spl_fail_errno(err, errno, "writing %s", out->temporary);
    if (rename(out->temporary, out->path))
        return spl_fail_errno(err, errno, "renaming %s to %s", out->temporary, out->path);
    free(out->temporary);
    out->temporary = NULL;
    return 0;
}

void spl_output_finish(struct spl_output *out)
{
    if (out->fd >= 0)
        close(out->fd);
    if (out->temporary)
        unlink(out->temporary);
    free(out->temporary);
    free(out->path);
    *out = (struct spl_output){.fd = -1};
}

int spl_output_make_directory(const char *path, struct spl_error *err)
{
    char *part = strdup(path);
    if (!part)
        return spl_fail(err, SPL_E_NOMEM, "out of memory for a path");
    int result = 0;
    for (char *at = part + 1; !result; at++) {
        if (*at && *at != '/')
            continue;
        char kept = *at;
        *at = 0;
        struct stat st;
        if (mkdir(part, 0777) && errno != EEXIST)
            result = spl_fail_errno(err, errno, "the directory %s cannot be made", part);
        else if (!stat(part, &st) && !S_ISDIR(st.st_mode))
            result = spl_fail(err, SPL_E_USAGE, "%s is not a directory", part);
        *at = kept;
        if (!kept)
            break;
    }
    free(part);
    return result;
}
