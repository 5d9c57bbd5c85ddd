/* Files of a tour. A file is written under another name, synced and renamed, so that what has its name is whole.
 *
 * Names come from us: 16 hex digits, and file names that state.c makes; nothing of a request becomes a path. Any
 * thread; blocks on disk. */
#include <dirent.h>
#include <errno.h>
#include <fcntl.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <unistd.h>

#include "base/file.h"
#include "base/memory.h"
#include "service/tour/tour.h"

bool spl_tour_name_is_valid(const char *name)
{
    return strlen(name) == SPL_TOUR_NAME && strspn(name, "0123456789abcdef") == SPL_TOUR_NAME;
}

int spl_tour_store_write(const char *directory, const char *name, const char *file, const void *bytes, size_t length,
                         struct spl_error *err)
{
    char path[4096];
    if (snprintf(path, sizeof path, "%s/%s/%s", directory, name, file) >= (int)sizeof path)
        return spl_fail(err, SPL_E_USAGE, "the path of the tours' folder is too long");
    char *slash = strrchr(path, '/');
    *slash = '\0';
    if (mkdir(path, 0777) && errno != EEXIST)
        return spl_fail_errno(err, errno, "%s: cannot be made", path);
    *slash = '/';
    return spl_file_replace(path, bytes, length, err);
}

int spl_tour_store_read(const char *directory, const char *name, const char *file, size_t most, uint8_t **bytes,
                        size_t *length, struct spl_error *err)
{
    char path[4096];
    struct stat status;
    *bytes = NULL;
    if (snprintf(path, sizeof path, "%s/%s/%s", directory, name, file) >= (int)sizeof path)
        return spl_fail(err, SPL_E_USAGE, "the path of the tours' folder is too long");
    int fd = open(path, O_RDONLY | O_CLOEXEC | O_NOFOLLOW | O_NONBLOCK), rc = 0;
    if (fd < 0 || fstat(fd, &status)) {
        rc = errno == ENOENT ? spl_fail(err, SPL_E_NOT_FOUND, "%s is not there", path)
                             : spl_fail_errno(err, errno, "%s: cannot be read", path);
        goto done;
    }
    if (!S_ISREG(status.st_mode) || (uint64_t)status.st_size > most) {
        rc = spl_fail(err, SPL_E_CORRUPT, "%s: %lld bytes; at most %zu were expected", path, (long long)status.st_size,
                      most);
        goto done;
    }
    *length = (size_t)status.st_size;
    if (!(*bytes = spl_alloc_raw(*length + 1, 1, err))) {
        rc = SPL_E_NOMEM;
        goto done;
    }
    for (size_t at = 0; at < *length;) {
        ssize_t got = pread(fd, *bytes + at, *length - at, (off_t)at);
        if (got < 0 && errno == EINTR)
            continue;
        if (got <= 0) {
            rc = spl_fail_errno(err, got ? errno : EIO, "%s: cannot be read", path);
            free(*bytes);
            *bytes = NULL;
            goto done;
        }
        at += (size_t)got;
    }
done:
    if (fd >= 0)
        close(fd);
    return rc;
}

void spl_tour_store_remove(const char *directory, const char *name)
{
    char path[4096], gone[4096], file[4096 + 256];
    snprintf(path, sizeof path, "%s/%s", directory, name);
    snprintf(gone, sizeof gone, "%s/.%s", directory, name); // no restart takes up a tour half removed
    if (rename(path, gone))
        snprintf(gone, sizeof gone, "%s", path);
    DIR *dir = opendir(gone);
    for (struct dirent *item; dir && (item = readdir(dir));) {
        snprintf(file, sizeof file, "%s/%s", gone, item->d_name);
        if (strcmp(item->d_name, ".") && strcmp(item->d_name, ".."))
            unlink(file);
    }
    if (dir)
        closedir(dir);
    rmdir(gone);
}
