/* Files that are there as a whole or not at all: a hidden file beside the place (.NAME.PID-N), synced and renamed into
 * it. It lies in the same folder because a rename across file systems is a copy.
 *
 * Invariant: two writers of one path never share a temporary file (O_EXCL), so the last rename wins whole. Opened with
 * 0666, not by mkostemp(), so that the umask is applied by the kernel; asking for it changes it for all threads. */
#include "base/file.h"

#include <errno.h>
#include <fcntl.h>
#include <glob.h>
#include <stdatomic.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/file.h>
#include <sys/stat.h>
#include <sys/statvfs.h>
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

/* For the caller to free; NULL: no memory. */
static char *copy_folder(const char *path)
{
    const int length = folder_length(path);
    return length ? strndup(path, (size_t)length) : strdup(".");
}

bool spl_file_is_same(const char *path, const char *other)
{
    struct stat one, second;
    return !stat(path, &one) && !stat(other, &second) && one.st_dev == second.st_dev && one.st_ino == second.st_ino;
}

uint64_t spl_file_get_free(const char *path)
{
    struct statvfs status;
    char *folder = copy_folder(path);
    const bool known = folder && !statvfs(folder, &status);
    free(folder);
    return known ? (uint64_t)status.f_bavail * status.f_frsize : UINT64_MAX;
}

int spl_file_sync_folder(const char *path)
{
    char *folder = copy_folder(path);
    if (!folder)
        return -1;
    int fd = open(folder, O_RDONLY | O_DIRECTORY | O_CLOEXEC), rc = fd < 0 ? -1 : fsync(fd), why = errno;
    if (fd >= 0 && rc && why == EINVAL)
        rc = 0;
    if (fd >= 0)
        close(fd);
    free(folder);
    errno = why;
    return rc;
}

/* A number as it is printed; where it ends, or NULL. */
static const char *skip_number(const char *text)
{
    size_t digits = strspn(text, "0123456789");
    return digits && (digits == 1 || *text != '0') ? text + digits : NULL;
}

/* PID-N, and no date of somebody's copy. */
static bool is_of_a_writer(const char *end)
{
    const char *dash = skip_number(end), *after = dash && *dash == '-' ? skip_number(dash + 1) : NULL;
    return after && !*after;
}

static void sweep(const char *begin, const char *end, bool (*is_left)(const char *))
{
    char pattern[4096];
    glob_t found = {0};
    size_t used = 0;
    if (strlen(begin) > (sizeof pattern - 32) / 2)
        return;
    for (const char *c = begin; *c; c++) {
        if (strchr("*?[\\", *c))
            pattern[used++] = '\\';
        pattern[used++] = *c;
    }
    snprintf(pattern + used, sizeof pattern - used, "%s", end);
    if (!glob(pattern, GLOB_NOSORT, NULL, &found))
        for (size_t i = 0; i < found.gl_pathc; i++) {
            if (is_left && !is_left(found.gl_pathv[i] + strlen(begin)))
                continue;
            int fd = open(found.gl_pathv[i], O_RDONLY | O_CLOEXEC | O_NOFOLLOW | O_NONBLOCK);
            if (fd >= 0 && !flock(fd, LOCK_EX | LOCK_NB))
                unlink(found.gl_pathv[i]);
            if (fd >= 0)
                close(fd);
        }
    globfree(&found);
}

/* ANYTHING.PID-N */
static bool is_of_any_writer(const char *end)
{
    const char *dot = strrchr(end, '.');
    return dot && is_of_a_writer(dot + 1);
}

void spl_file_sweep(const char *begin, const char *end)
{
    sweep(begin, end, NULL);
}

void spl_file_sweep_beside(const char *path)
{
    char *begin;
    int folder = folder_length(path);
    if (asprintf(&begin, "%.*s.%s.", folder, path, path + folder) < 0)
        return;
    sweep(begin, "[0-9]*-[0-9]*", is_of_a_writer);
    free(begin);
}

void spl_file_sweep_folder(const char *folder, const char *ending)
{
    char *begin = NULL, *end = NULL;
    if (asprintf(&begin, "%s/.", folder) < 0)
        begin = NULL;
    if (asprintf(&end, "?*%s.[0-9]*-[0-9]*", ending) < 0)
        end = NULL;
    if (begin && end)
        sweep(begin, end, is_of_any_writer);
    free(begin);
    free(end);
}

/* Says that the new file is in use; false where another's sweep came before. File systems without locks are not swept
 * either. */
static bool lock(int fd)
{
    struct stat status;
    flock(fd, LOCK_EX | LOCK_NB);
    return fstat(fd, &status) || status.st_nlink;
}

/* Removes what a killed process of this user left under the name; false, with EEXIST, where it is something else. */
static bool remove_left(const char *path)
{
    struct stat status;
    int fd = open(path, O_RDONLY | O_CLOEXEC | O_NOFOLLOW | O_NONBLOCK);
    bool left = fd < 0 ? errno == ENOENT // gone meanwhile
                       : !fstat(fd, &status) && S_ISREG(status.st_mode) && status.st_uid == geteuid() &&
                             !(flock(fd, LOCK_EX | LOCK_NB) && errno == EWOULDBLOCK) && !unlink(path);
    if (fd >= 0)
        close(fd);
    errno = EEXIST;
    return left;
}

int spl_file_create(const char *path, unsigned permissions)
{
    for (;;) { // again where another's sweep came before our lock
        int fd = open(path, O_RDWR | O_CREAT | O_EXCL | O_CLOEXEC | O_NOFOLLOW, (mode_t)permissions);
        if (fd >= 0 && lock(fd))
            return fd;
        if (fd >= 0)
            close(fd);
        else if (errno != EEXIST || !remove_left(path))
            return -1;
    }
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
        if (fd >= 0 && lock(fd))
            return fd;
        free(*beside);
        *beside = NULL;
        if (fd >= 0) {
            close(fd);
            continue;
        }
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
