/* Opening what is read; see reading.h. */
#include "base/reading.h"

#include <errno.h>
#include <fcntl.h>
#include <unistd.h>

int spl_open_for_reading(const char *path, FILE **file, struct spl_error *err)
{
    int fd = open(path, O_RDONLY | O_CLOEXEC | O_NONBLOCK);
    *file = fd < 0 ? NULL : fdopen(fd, "rb");
    if (*file && !fcntl(fd, F_SETFL, O_RDONLY)) /* reads wait again */
        return SPL_OK;
    if (fd < 0 && (errno == ENOENT || errno == ENOTDIR))
        return spl_fail(err, SPL_E_NOT_FOUND, "%s: there is no such file", path);
    int rc = spl_fail_errno(err, errno, "%s: cannot be opened", path);
    if (*file)
        fclose(*file);
    else if (fd >= 0)
        close(fd);
    return rc;
}
