/* Files come in under a hidden folder beside their place, so that a rename puts them there whole, synced and verified,
 * or not at all, whatever crashes in between. The folder's file already has its final name, since a dataset's id is its
 * file's stem. Files go by a rename to .removed-NAME.spld, which outlasts what lies beside them: a crash leaves either
 * all of a dataset, or that name, by which the next sweep knows whose views and profile have no dataset any more. Runs
 * on threads of the pool. */
#include "service/datasets/store.h"

#include <dirent.h>
#include <errno.h>
#include <fcntl.h>
#include <pthread.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/file.h>
#include <sys/stat.h>
#include <sys/statvfs.h>
#include <time.h>
#include <unistd.h>

#include "base/file.h"
#include "measure/profile.h"

static const char prefix[] = ".incoming-", removed[] = ".removed-";
static pthread_mutex_t removing = PTHREAD_MUTEX_INITIALIZER; /* so that no sweep finishes what is not left */
enum { fresh_s = 1, stale_s = 24 * 3600 }; /* not locked yet; where there are no locks */

static int fail(struct spl_incoming *incoming, struct spl_error *err, const char *what)
{
    int why = errno;
    incoming->no_room = why == ENOSPC || why == EDQUOT || why == EFBIG;
    spl_incoming_abort(incoming);
    return spl_fail_errno(err, why, "cannot %s the dataset's file", what);
}

/* What a crash has left in `folder`, which belongs to nobody any more. */
static void remove_folder(int directory, const char *folder)
{
    int fd = openat(directory, folder, O_RDONLY | O_DIRECTORY | O_NOFOLLOW | O_CLOEXEC);
    DIR *dir = fd < 0 ? NULL : fdopendir(fd);
    if (!dir)
        return;
    for (struct dirent *item; (item = readdir(dir));)
        if (strcmp(item->d_name, ".") && strcmp(item->d_name, ".."))
            unlinkat(fd, item->d_name, 0);
    closedir(dir);
    unlinkat(directory, folder, AT_REMOVEDIR);
}

/* Does nobody write into it any more? Whoever does has a lock on the file. */
static bool is_left(int directory, const char *folder, time_t age_s)
{
    int fd = openat(directory, folder, O_RDONLY | O_DIRECTORY | O_NOFOLLOW | O_CLOEXEC);
    DIR *dir = fd < 0 ? NULL : fdopendir(fd);
    bool left = dir && age_s > fresh_s;
    if (!dir && fd >= 0)
        close(fd);
    for (struct dirent *item; left && (item = readdir(dir));) {
        if (!strcmp(item->d_name, ".") || !strcmp(item->d_name, ".."))
            continue;
        int file = openat(fd, item->d_name, O_RDONLY | O_NOFOLLOW | O_NONBLOCK | O_CLOEXEC);
        if (file >= 0 && flock(file, LOCK_EX | LOCK_NB))
            left = errno != EWOULDBLOCK && age_s > stale_s;
        if (file >= 0)
            close(file);
    }
    if (dir)
        closedir(dir);
    return left;
}

/* The profile and the views beside a dataset's file. */
struct beside {
    char *paths[2]; // owned
};

static void free_beside(struct beside *beside)
{
    free(beside->paths[0]);
    free(beside->paths[1]);
}

static int name_beside(const char *path, struct beside *beside, struct spl_error *err)
{
    *beside = (struct beside){.paths = {spl_profile_path(path, err), spl_saved_path(path, err)}};
    if (beside->paths[0] && beside->paths[1])
        return 0;
    free_beside(beside);
    return SPL_E_NOMEM;
}

static bool is_after(const struct timespec *a, const struct timespec *b)
{
    return a->tv_sec != b->tv_sec ? a->tv_sec > b->tv_sec : a->tv_nsec > b->tv_nsec;
}

/* Removes what lay beside a dataset when that was renamed to `name`. What was put there since is another's. */
static void finish_removal(const char *directory, const char *name)
{
    char *path = NULL, *aside = NULL;
    struct beside beside = {0};
    struct stat status, since;
    if (asprintf(&path, "%s/%s", directory, name + sizeof removed - 1) < 0)
        path = NULL;
    if (asprintf(&aside, "%s/%s", directory, name) < 0)
        aside = NULL;
    if (!path || !aside || name_beside(path, &beside, NULL))
        goto done;
    pthread_mutex_lock(&removing);
    bool left = !lstat(aside, &since);
    for (int i = 0; i < 2 && left; i++)
        if (!lstat(beside.paths[i], &status) && !is_after(&status.st_ctim, &since.st_ctim))
            left = !unlink(beside.paths[i]) || errno == ENOENT;
    if (left && !spl_file_sync_folder(path))
        unlink(aside);
    pthread_mutex_unlock(&removing);
    free_beside(&beside);
done:
    free(path);
    free(aside);
}

/* Is it what a removal leaves? In a folder where nobody renames others' files, others did not leave it for us. */
static bool is_removed(int directory, const char *name)
{
    struct stat status, folder;
    const size_t length = strlen(name), ending = sizeof ".spld" - 1;
    return length > sizeof removed - 1 + ending && !strncmp(name, removed, sizeof removed - 1) &&
           !strcmp(name + length - ending, ".spld") && !fstat(directory, &folder) &&
           !fstatat(directory, name, &status, AT_SYMLINK_NOFOLLOW) && !S_ISDIR(status.st_mode) &&
           (!(folder.st_mode & S_ISVTX) || status.st_uid == geteuid());
}

void spl_store_sweep(const char *directory)
{
    DIR *dir = opendir(directory);
    if (!dir)
        return;
    time_t now = time(NULL);
    for (struct dirent *item; (item = readdir(dir));) {
        struct stat status;
        if (is_removed(dirfd(dir), item->d_name))
            finish_removal(directory, item->d_name);
        else if (!strncmp(item->d_name, prefix, sizeof prefix - 1) &&
                 !fstatat(dirfd(dir), item->d_name, &status, AT_SYMLINK_NOFOLLOW) && S_ISDIR(status.st_mode) &&
                 is_left(dirfd(dir), item->d_name, now - status.st_mtime))
            remove_folder(dirfd(dir), item->d_name);
    }
    closedir(dir);
    spl_file_sweep_folder(directory, SPL_SAVED_ENDING);
}

/* The folder of `path`, for the caller to free; NULL without memory. */
static char *folder_of(const char *path)
{
    const char *slash = strrchr(path, '/');
    return !slash ? strdup(".") : slash == path ? strdup("/") : strndup(path, (size_t)(slash - path));
}

int spl_store_check_room(const char *path, uint64_t bytes, struct spl_error *err)
{
    struct statvfs disk;
    char *folder = folder_of(path);
    bool known = folder && !statvfs(folder, &disk);
    free(folder);
    if (!known || bytes / disk.f_frsize < disk.f_bavail)
        return 0;
    return spl_fail(err, SPL_E_LIMIT, "the dataset has %llu bytes, %llu are free on its disk",
                    (unsigned long long)bytes, (unsigned long long)disk.f_bavail * disk.f_frsize);
}

int spl_incoming_begin(struct spl_incoming *incoming, const char *target, struct spl_error *err)
{
    char *directory = folder_of(target), *folder = NULL, *path = NULL;
    int rc = 0;
    *incoming = (struct spl_incoming){0};
    if (!directory || asprintf(&folder, "%s/%sXXXXXX", directory, prefix) < 0) {
        folder = NULL;
        rc = spl_fail(err, SPL_E_NOMEM, "out of memory for a path");
        goto done;
    }
    spl_store_sweep(directory);
    if (!mkdtemp(folder)) {
        rc = fail(incoming, err, "make a folder for");
        goto done;
    }
    incoming->folder = folder;
    folder = NULL;
    if (asprintf(&path, "%s/%s", incoming->folder, strrchr(target, '/') ? strrchr(target, '/') + 1 : target) < 0) {
        path = NULL;
        rc = spl_fail(err, SPL_E_NOMEM, "out of memory for a path");
        goto done;
    }
    incoming->fd = open(path, O_WRONLY | O_CREAT | O_EXCL | O_CLOEXEC, 0644);
    if (incoming->fd < 0) {
        rc = fail(incoming, err, "make");
        goto done;
    }
    incoming->path = path;
    path = NULL;
    flock(incoming->fd, LOCK_EX | LOCK_NB); // in use, until it is closed
done:
    if (rc)
        spl_incoming_abort(incoming);
    free(directory);
    free(folder);
    free(path);
    return rc;
}

int spl_incoming_append(struct spl_incoming *incoming, const void *data, size_t length, struct spl_error *err)
{
    if (spl_write_all(incoming->fd, data, length))
        return fail(incoming, err, "write");
    incoming->bytes += length;
    return 0;
}

int spl_incoming_check(struct spl_incoming *incoming, const char *target, const struct spl_dataset_opening *how,
                       struct spl_catalog_entry **entry, struct spl_error *err)
{
    if (fsync(incoming->fd))
        return fail(incoming, err, "sync");
    enum spl_file_kind kind = SPL_FILE_OTHER;
    struct spl_dataset_opening opening = *how;
    opening.kind = &kind;
    struct spl_error why = {0};
    int rc = spl_catalog_entry_open(incoming->path, target, &opening, entry, &why);
    if (!rc && kind == SPL_FILE_COLLECTION) { // nor may who uploads one see what lies beside it by naming it
        spl_catalog_entry_destroy(*entry);
        *entry = NULL;
        rc = spl_fail(&why, SPL_E_INPUT,
                      "a collection is made of files beside it, which no upload brings along: upload its tiles, and "
                      "let splatd collect make it where they lie");
    }
    if (!rc)
        return 0;
    char message[sizeof why.message];
    spl_catalog_hide_folder(message, sizeof message, why.message, incoming->path);
    bool unpacked = rc == SPL_E_INPUT && kind == SPL_FILE_OTHER && incoming->bytes;
    const char *advice = unpacked ? ": pack the scan first, then PUT that file" : "";
    spl_incoming_abort(incoming);
    return spl_fail(err, rc, "%s%s", message, advice);
}

int spl_incoming_place(struct spl_incoming *incoming, const char *target, struct spl_file_mark *mark,
                       struct spl_error *err)
{
    if (rename(incoming->path, target) || spl_file_sync_folder(target))
        return fail(incoming, err, "put in place");
    struct stat status;
    if (fstat(incoming->fd, &status))
        return fail(incoming, err, "examine");
    *mark = spl_file_mark_of(&status);
    spl_incoming_abort(incoming); // what is left: the folder
    return 0;
}

void spl_incoming_abort(struct spl_incoming *incoming)
{
    bool no_room = incoming->no_room;
    if (incoming->path) {
        close(incoming->fd);
        unlink(incoming->path);
    }
    if (incoming->folder)
        rmdir(incoming->folder); // empty now
    free(incoming->path);
    free(incoming->folder);
    *incoming = (struct spl_incoming){.no_room = no_room};
}

/* Its name goes first: once that is on the disk nothing brings the dataset back, and only then what lay beside it may
 * go. Where that cannot go, the dataset stays; of the two the views come last, since a profile can be made again. */
int spl_stored_remove(const char *path, struct spl_error *err)
{
    struct beside beside;
    struct stat status;
    char *aside = NULL;
    const char *slash = strrchr(path, '/'), *name = slash ? slash + 1 : path;
    int rc = name_beside(path, &beside, err);
    if (rc)
        return rc;
    if (asprintf(&aside, "%.*s%s%s", (int)(name - path), path, removed, name) < 0) {
        free_beside(&beside);
        return spl_fail(err, SPL_E_NOMEM, "out of memory for a path");
    }
    pthread_mutex_lock(&removing);
    const bool folder = !lstat(path, &status) && S_ISDIR(status.st_mode); // it may have that name, and is no dataset
    const bool moved = !folder && !rename(path, aside);
    if (folder)
        rc = spl_fail_errno(err, EISDIR, "cannot remove the dataset's file");
    else if (!moved && errno != ENOENT)
        rc = spl_fail_errno(err, errno, "cannot remove the dataset's file");
    else if (spl_file_sync_folder(path))
        rc = spl_fail_errno(err, errno, "cannot sync the folder of the dataset's file");
    for (int i = 0; i < 2 && !rc; i++)
        if (unlink(beside.paths[i]) && errno != ENOENT)
            rc = spl_fail_errno(err, errno, "cannot remove what lies beside the dataset's file");
    if (rc && moved)
        rename(aside, path);
    else if (!rc && !spl_file_sync_folder(path) && moved)
        unlink(aside); // else the next sweep does
    pthread_mutex_unlock(&removing);
    free_beside(&beside);
    free(aside);
    return rc;
}
