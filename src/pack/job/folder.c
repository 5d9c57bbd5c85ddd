/* A job's folder as one process has it, from the first part until nothing of the job is left. Any thread. */
#include <dirent.h>
#include <errno.h>
#include <fcntl.h>
#include <fnmatch.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/file.h>
#include <sys/stat.h>
#include <unistd.h>

#include "base/file.h"
#include "pack/job/job.h"

/* The lock is the folder's own; one that was removed meanwhile is made and taken again. */
int spl_job_lock(const char *path, int *lock, struct spl_error *err)
{
    enum { tries_most = 16 }; /* a link that leads nowhere is there, and cannot be opened, each time */
    struct stat own, there;
    for (int tries = 0;; tries++) {
        if (mkdir(path, 0777) && errno != EEXIST)
            return spl_fail_errno(err, errno, "%.300s: this folder cannot be made", path);
        *lock = open(path, O_RDONLY | O_DIRECTORY | O_NOFOLLOW | O_CLOEXEC);
        if (*lock < 0 && errno == ENOENT && tries < tries_most)
            continue;
        if (*lock < 0 && !lstat(path, &there) && S_ISLNK(there.st_mode)) /* to parts of another, maybe */
            return spl_fail_field(err, SPL_E_USAGE, "output",
                                  "%.300s: this is a link; parts lie in a folder of their own, which is removed with "
                                  "them: remove the link, or choose another name",
                                  path);
        if (*lock < 0)
            return spl_fail_errno(err, errno, "%.300s: parts lie in this folder, and it cannot be opened", path);
        if (flock(*lock, LOCK_EX | LOCK_NB) && errno == EWOULDBLOCK) {
            close(*lock);
            return spl_fail_field(err, SPL_E_USAGE, "output",
                                  "%.300s: another splatd packs these parts; wait for its end, or choose another name",
                                  path);
        }
        if (!lstat(path, &there) && !fstat(*lock, &own) && own.st_ino == there.st_ino && own.st_dev == there.st_dev)
            return SPL_OK;
        close(*lock);
        if (tries >= tries_most)
            return spl_fail_field(err, SPL_E_IO, "output", "%.300s: this folder is removed by others, again and again",
                                  path);
    }
}

static bool is_of_a_job(const char *name)
{
    static const char *const patterns[] = {"part-[0-9]*.spld", "part-[0-9]*.empty",
                                           "part-[0-9]*.spld" SPL_UNFINISHED_ANY, ".part-[0-9]*.empty.*",
                                           "." SPL_JOB_FILE ".*"};
    bool is = false;
    for (size_t i = 0; i < sizeof patterns / sizeof *patterns; i++)
        is |= !fnmatch(patterns[i], name, 0);
    return is;
}

bool spl_job_remove(const char *folder)
{
    DIR *dir = opendir(folder);
    bool other = !dir;
    for (struct dirent *item; dir && (item = readdir(dir));) {
        const char *name = item->d_name;
        if (!strcmp(name, ".") || !strcmp(name, "..") || !strcmp(name, SPL_JOB_FILE))
            continue;
        other |= !is_of_a_job(name) || unlinkat(dirfd(dir), name, 0);
    }
    if (!other)
        unlinkat(dirfd(dir), SPL_JOB_FILE, 0);
    if (dir)
        closedir(dir);
    return !other && !rmdir(folder);
}
