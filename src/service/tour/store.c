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
#include "base/log.h"
#include "base/memory.h"
#include "service/tour/tour.h"

static const char state_name[] = "tour.json";

bool spl_tour_name_is_valid(const char *name)
{
    return strlen(name) == SPL_TOUR_NAME && strspn(name, "0123456789abcdef") == SPL_TOUR_NAME;
}

DIR *spl_tour_folder_open(const char *directory, const char *name)
{
    char path[4096];
    const bool fits = snprintf(path, sizeof path, "%s/%s", directory, name) < (int)sizeof path;
    const int fd = fits ? open(path, O_RDONLY | O_DIRECTORY | O_NOFOLLOW | O_CLOEXEC) : -1;
    DIR *dir = fd < 0 ? NULL : fdopendir(fd);
    const int why = fits ? errno : ENAMETOOLONG;
    if (!dir && fd >= 0)
        close(fd);
    errno = why;
    return dir;
}

int spl_tour_store_write(const char *directory, const char *name, const char *file, const void *bytes, size_t length,
                         struct spl_error *err)
{
    char path[4096];
    if (snprintf(path, sizeof path, "%s/%s/%s", directory, name, file) >= (int)sizeof path)
        return spl_fail(err, SPL_E_USAGE, "the path of the tours' folder is too long");
    char *slash = strrchr(path, '/');
    *slash = '\0';
    const bool made = !mkdir(path, 0777);
    int rc = 0;
    if (!made && errno != EEXIST)
        rc = spl_fail_errno(err, errno, "%s: cannot be made", path);
    else if (made && spl_file_sync_folder(path))
        rc = spl_fail_errno(err, errno, "%s: its folder cannot be synced", path);
    *slash = '/';
    if (!rc)
        rc = spl_file_replace(path, bytes, length, err);
    if (!rc && spl_file_sync_folder(path))
        rc = spl_fail_errno(err, errno, "the folder of %s cannot be synced", path);
    if (rc && (errno == ENOSPC || errno == EDQUOT || errno == EFBIG))
        rc = err->code = SPL_E_LIMIT;
    return rc;
}

int spl_tour_file_open(const char *directory, const char *name, const char *file, struct spl_tour_file *out,
                       struct spl_error *err)
{
    struct stat status;
    int rc = 0;
    *out = (struct spl_tour_file){.fd = -1};
    DIR *dir = spl_tour_folder_open(directory, name);
    if (dir)
        out->fd = openat(dirfd(dir), file, O_RDONLY | O_CLOEXEC | O_NOFOLLOW | O_NONBLOCK);
    const int why = errno;
    if (dir)
        closedir(dir);
    errno = why;
    if (out->fd < 0 || fstat(out->fd, &status))
        rc = errno == ENOENT ? spl_fail(err, SPL_E_NOT_FOUND, "%s of tour %s is not there", file, name)
                             : spl_fail_errno(err, errno, "%s of tour %s cannot be read", file, name);
    else if (!S_ISREG(status.st_mode))
        rc = spl_fail(err, SPL_E_CORRUPT, "%s of tour %s is no file", file, name);
    else
        out->left = (uint64_t)status.st_size;
    if (rc)
        spl_tour_file_close(out);
    else
        posix_fadvise(out->fd, 0, 0, POSIX_FADV_RANDOM); // ahead of it only what is said below
    return rc;
}

size_t spl_tour_file_read(struct spl_tour_file *file, void *out, size_t room)
{
    static const off_t ahead_bytes = 512 << 10;
    ssize_t got;
    room = room < file->left ? room : (size_t)file->left;
    do
        got = pread(file->fd, out, room, (off_t)file->offset);
    while (got < 0 && errno == EINTR);
    if (got <= 0)
        return 0;
    file->offset += (uint64_t)got;
    posix_fadvise(file->fd, (off_t)file->offset, ahead_bytes, POSIX_FADV_WILLNEED);
    file->left -= (size_t)got;
    return (size_t)got;
}

void spl_tour_file_close(struct spl_tour_file *file)
{
    if (file->fd >= 0)
        close(file->fd);
    *file = (struct spl_tour_file){.fd = -1};
}

int spl_tour_store_read(const char *directory, const char *name, const char *file, size_t most, uint8_t **bytes,
                        size_t *length, struct spl_error *err)
{
    struct spl_tour_file opened;
    *bytes = NULL;
    int rc = spl_tour_file_open(directory, name, file, &opened, err);
    if (rc)
        return rc;
    *length = (size_t)opened.left;
    if (opened.left > most)
        rc = spl_fail(err, SPL_E_CORRUPT, "%s: %zu bytes; at most %zu were expected", file, *length, most);
    else if (!(*bytes = spl_alloc_raw(*length + 1, 1, err)))
        rc = SPL_E_NOMEM;
    for (size_t got; !rc && opened.left;)
        if (!(got = spl_tour_file_read(&opened, *bytes + (*length - opened.left), (size_t)opened.left)))
            rc = spl_fail(err, SPL_E_IO, "%s: cannot be read to its end", file);
    if (rc) {
        free(*bytes);
        *bytes = NULL;
    }
    spl_tour_file_close(&opened);
    return rc;
}

bool spl_tour_file_is_ours(const char *file)
{
    const char *name = file + (*file == '.'), *end;
    const size_t digits = strspn(name, "0123456789");
    if (digits >= 6 && name[digits] == '.')
        end = name + digits + 1 + strcspn(name + digits + 1, ".");
    else if (!strncmp(name, state_name, strlen(state_name)))
        end = name + strlen(state_name);
    else if (!strncmp(name, SPL_TOUR_VIDEO_FILE, strlen(SPL_TOUR_VIDEO_FILE)))
        end = name + strlen(SPL_TOUR_VIDEO_FILE);
    else
        return false;
    return !*end || (name > file && *end == '.'); // hidden: while it is written
}

/* Does the folder hold nothing else? Rewinds it. */
static bool is_ours(DIR *dir)
{
    bool others = false;
    for (struct dirent *item; (item = readdir(dir));)
        others |= strcmp(item->d_name, ".") && strcmp(item->d_name, "..") && !spl_tour_file_is_ours(item->d_name);
    rewinddir(dir);
    return !others;
}

int spl_tour_store_forget(const char *directory, const char *name, struct spl_error *err)
{
    DIR *dir = spl_tour_folder_open(directory, name);
    if (!dir && errno == ENOENT)
        return 0;
    int rc = 0;
    if (!dir || (unlinkat(dirfd(dir), state_name, 0) && errno != ENOENT) || fsync(dirfd(dir)))
        rc = spl_fail_errno(err, errno, "the tour's %s cannot be removed", state_name);
    if (dir)
        closedir(dir);
    return rc;
}

/* tour.json goes first: no restart takes up a tour half removed, and one that finds none goes on removing. */
void spl_tour_store_remove(const char *directory, const char *name, bool wanted)
{
    char path[4096];
    DIR *dir = spl_tour_folder_open(directory, name);
    if (!dir && errno == ENOENT)
        return;
    bool left = !dir || (!wanted && !is_ours(dir));
    if (!left)
        unlinkat(dirfd(dir), state_name, 0);
    for (struct dirent *item; !left && (item = readdir(dir));)
        if (spl_tour_file_is_ours(item->d_name))
            unlinkat(dirfd(dir), item->d_name, 0);
    if (dir)
        closedir(dir);
    snprintf(path, sizeof path, "%s/%s", directory, name);
    if (left || rmdir(path))
        spl_log_warn("%s is left: it is no tour's folder, or holds what is of no tour", path);
}
