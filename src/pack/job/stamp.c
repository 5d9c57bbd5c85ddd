/* A file's ends: headers lie at its beginning, and what grows or is written anew differs at its end. Any thread. */
#include "pack/job/stamp.h"

#include <errno.h>
#include <fcntl.h>
#include <stdlib.h>
#include <sys/stat.h>
#include <unistd.h>

#include <xxhash.h>

#include "base/memory.h"

enum { end_bytes = 64 << 10 };

static int read_at(int fd, char *to, size_t bytes, uint64_t offset, const char *path, struct spl_error *err)
{
    while (bytes) {
        ssize_t n = pread(fd, to, bytes, (off_t)offset);
        if (n < 0 && errno == EINTR)
            continue;
        if (n <= 0)
            return spl_fail_errno(err, n ? errno : EIO, "%.300s: cannot be read at byte %llu", path,
                                  (unsigned long long)offset);
        to += n;
        bytes -= (size_t)n;
        offset += (uint64_t)n;
    }
    return SPL_OK;
}

int spl_stamp_take(const char *path, uint64_t *bytes, uint64_t *ends, struct spl_error *err)
{
    struct stat status;
    int fd = open(path, O_RDONLY | O_CLOEXEC | O_NONBLOCK); // which a pipe that nobody writes to would hold up
    if (fd < 0)
        return spl_fail_errno(err, errno, "%.300s: cannot be opened", path);
    char *both = spl_alloc_raw(2, end_bytes, err);
    int rc = both ? SPL_OK : SPL_E_NOMEM;
    if (!rc && fstat(fd, &status))
        rc = spl_fail_errno(err, errno, "%.300s: cannot be looked at", path);
    if (!rc && !S_ISREG(status.st_mode))
        rc = spl_fail_field(err, SPL_E_INPUT, "path", "%.300s: it is not a regular file", path);
    uint64_t size = rc ? 0 : (uint64_t)status.st_size;
    size_t first = size < end_bytes ? (size_t)size : end_bytes;
    size_t last = size - first < end_bytes ? (size_t)(size - first) : end_bytes;
    if (!rc)
        rc = read_at(fd, both, first, 0, path, err);
    if (!rc)
        rc = read_at(fd, both + first, last, size - last, path, err);
    if (!rc) {
        *bytes = size;
        *ends = XXH3_64bits(both, first + last);
    }
    free(both);
    close(fd);
    return rc;
}
