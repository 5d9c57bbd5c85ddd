/* Files that are there as a whole or not at all: a hidden file beside the place (.NAME.PID-N), synced and renamed into
 * it. It lies in the same folder because a rename across file systems is a copy.
 *
 * Invariant: two writers of one path never share a temporary file (O_EXCL), so the last rename wins whole. Opened with
 * 0666, not by mkostemp(), so that the umask is applied by the kernel; asking for it changes it for all threads. */
#include "base/file.h"

#include <errno.h>
#include <fcntl.h>
#include <stdatomic.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

int spl_write_all(int fd, const void *bytes, size_t length)
{
    for (const char *from = bytes; length;) {
        ssize_t written = write(fd, from, length);
        if (written < 0 && errno == EINTR)
            continue;
        if (written < 0)
            return -1;
        from += written;
        length -= (size_t)written;
    }
    return 0;
}

/* Length of the folder's part of `path`, its last '/' included. */
static int folder_length(const char *path)
{
    const char *slash = strrchr(path, '/');
    return slash ? (int)(slash - path) + 1 : 0;
}

int spl_file_sync_folder(const char *path)
{
    int length = folder_length(path);
    char *folder = length ? strndup(path, (size_t)length) : strdup(".");
    if (!folder)
        return -1;
    int fd = open(folder, O_RDONLY | O_DIRECTORY | O_CLOEXEC), rc = fd < 0 ? -1 : fsync(fd), why = errno;
    if (fd >= 0)
        close(fd);
    free(folder);
    errno = why;
    return rc;
}

/* Opens a file of its own beside `path`; its name, owned by the caller, goes to *beside. -1 with errno. */
static int open_beside(const char *path, char **beside)
{
    static atomic_uint number;
    int folder = folder_length(path);
    for (;;) {
        if (asprintf(beside, "%.*s.%s.%ld-%u", folder, path, path + folder, (long)getpid(),
                     atomic_fetch_add(&number, 1u)) < 0) {
            *beside = NULL;
            errno = ENOMEM;
            return -1;
        }
        int fd = open(*beside, O_WRONLY | O_CREAT | O_EXCL | O_CLOEXEC, 0666);
        if (fd >= 0)
            return fd;
        free(*beside);
        *beside = NULL;
        if (errno != EEXIST) /* left by a process of the same number that was killed: the next number */
            return -1;
    }
}

int spl_file_replace(const char *path, const void *bytes, size_t length, struct spl_error *err)
{
    char *beside;
    int fd = open_beside(path, &beside);
    if (fd < 0 && errno == ENOENT && folder_length(path)) // of a file that is to be made only a folder can be missing
        return spl_fail(err, SPL_E_IO, "cannot write '%s': there is no folder '%.*s'", path, folder_length(path), path);
    if (fd < 0)
        return spl_fail_errno(err, errno, "cannot make a file beside '%s'", path);
    bool failed = spl_write_all(fd, bytes, length) || fsync(fd);
    int why = errno;
    if (close(fd) && !failed) {
        failed = true;
        why = errno;
    }
    if (!failed && rename(beside, path)) {
        failed = true;
        why = errno;
    }
    if (failed)
        unlink(beside);
    free(beside);
    return failed ? spl_fail_errno(err, why, "cannot write '%s'", path) : SPL_OK;
}
