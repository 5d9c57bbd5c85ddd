/* A temporary file in the same folder, then a rename: the place never holds half a result. Owned by the command's
 * thread. */
#include "cmd/output.h"

#include <errno.h>
#include <fcntl.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <unistd.h>

static int write_all(int fd, const char *bytes, size_t length)
{
    while (length) {
        ssize_t written = write(fd, bytes, length);
        if (written < 0 && errno == EINTR)
            continue;
        if (written < 0)
            return -1;
        bytes += written;
        length -= (size_t)written;
    }
    return 0;
}

static int write_directly(int fd, const char *path, const void *bytes, size_t length, struct spl_error *err)
{
    return write_all(fd, bytes, length) ? spl_fail_errno(err, errno, "cannot write '%s'", path) : SPL_OK;
}

static int write_beside(const char *path, const void *bytes, size_t length, struct spl_error *err)
{
    char temporary[4096];
    if ((size_t)snprintf(temporary, sizeof temporary, "%s.XXXXXX", path) >= sizeof temporary)
        return spl_fail(err, SPL_E_USAGE, "the path '%.100s…' is too long", path);
    int fd = mkostemp(temporary, O_CLOEXEC);
    if (fd < 0)
        return spl_fail_errno(err, errno, "cannot make a file beside '%s'", path);
    mode_t mask = umask(0);
    umask(mask);
    int failed = write_all(fd, bytes, length) || fchmod(fd, 0666 & ~mask);
    int why = errno;
    if (close(fd) && !failed) {
        failed = 1;
        why = errno;
    }
    if (!failed && rename(temporary, path)) {
        failed = 1;
        why = errno;
    }
    if (!failed)
        return SPL_OK;
    unlink(temporary);
    return spl_fail_errno(err, why, "cannot write '%s'", path);
}

int spl_cmd_write_output(const char *path, const void *bytes, size_t length, struct spl_error *err)
{
    if (!strcmp(path, "-"))
        return write_directly(STDOUT_FILENO, "stdout", bytes, length, err);
    struct stat status;
    if (stat(path, &status) || S_ISREG(status.st_mode) || S_ISDIR(status.st_mode))
        return write_beside(path, bytes, length, err);
    int fd = open(path, O_WRONLY | O_CLOEXEC);
    if (fd < 0)
        return spl_fail_errno(err, errno, "cannot write '%s'", path);
    int rc = write_directly(fd, path, bytes, length, err);
    close(fd);
    return rc;
}
