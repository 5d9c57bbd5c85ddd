/* Where a result goes: a file as a whole, or what takes bytes as they come. Owned by the command's thread. */
#include "cmd/output.h"

#include <errno.h>
#include <fcntl.h>
#include <string.h>
#include <sys/stat.h>
#include <unistd.h>

#include "base/file.h"

int spl_cmd_write_output(const char *path, const void *bytes, size_t length, struct spl_error *err)
{
    if (!strcmp(path, "-"))
        return spl_write_all(STDOUT_FILENO, bytes, length) ? spl_fail_errno(err, errno, "cannot write 'stdout'")
                                                           : SPL_OK;
    struct stat status;
    if (stat(path, &status) || S_ISREG(status.st_mode) || S_ISDIR(status.st_mode))
        return spl_file_replace(path, bytes, length, err);
    int fd = open(path, O_WRONLY | O_CLOEXEC);
    if (fd < 0)
        return spl_fail_errno(err, errno, "cannot write '%s'", path);
    int rc = spl_write_all(fd, bytes, length) ? spl_fail_errno(err, errno, "cannot write '%s'", path) : SPL_OK;
    close(fd);
    return rc;
}
