/* Relative, so that a job and its scans may be moved together, or seen by other machines under another root. */
#include "pack/job/paths.h"

#include <dirent.h>
#include <errno.h>
#include <fcntl.h>
#include <limits.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <unistd.h>

#include "base/memory.h"
#include "pack/inputs.h"
#include "pack/job/names.h"

/* Whether the folder's job.json says that it is one of ours; such are there as a whole. */
static bool is_job(DIR *dir)
{
    char begin[4096];
    int fd = openat(dirfd(dir), SPL_JOB_FILE, O_RDONLY | O_CLOEXEC | O_NONBLOCK);
    ssize_t length = fd < 0 ? -1 : read(fd, begin, sizeof begin - 1);
    if (fd >= 0)
        close(fd);
    begin[length < 0 ? 0 : length] = '\0';
    return strstr(begin, "\"" SPL_JOB_FORMAT "\"");
}

static int look_into(const char *path, struct spl_error *err)
{
    DIR *dir = opendir(path);
    bool job = false, other = false;
    char first[64] = "";
    if (!dir)
        return spl_fail_errno(err, errno, "%.300s: this folder cannot be opened", path);
    for (struct dirent *item; (item = readdir(dir));) {
        if (!strcmp(item->d_name, ".") || !strcmp(item->d_name, "..") ||
            !strncmp(item->d_name, "." SPL_JOB_FILE ".", strlen("." SPL_JOB_FILE "."))) /* a killed plan's */
            continue;
        job |= !strcmp(item->d_name, SPL_JOB_FILE) && is_job(dir);
        if (!other)
            snprintf(first, sizeof first, "%.60s", item->d_name);
        other = true;
    }
    closedir(dir);
    return job || !other ? SPL_OK
                         : spl_fail_field(err, SPL_E_USAGE, "output",
                                          "%.300s: this folder holds something else than a job (%s): name one that is "
                                          "empty, or that is not there yet",
                                          path, first);
}

int spl_job_make_folder(const char *path, bool *made, struct spl_error *err)
{
    struct stat status;
    *made = !mkdir(path, 0777);
    if (*made)
        return SPL_OK;
    if (errno != EEXIST)
        return spl_fail_errno(err, errno, "%.300s: this folder cannot be made", path);
    if (stat(path, &status) || !S_ISDIR(status.st_mode))
        return spl_fail_field(err, SPL_E_USAGE, "output",
                              "%.300s: a job is a folder, and this is none; choose another name", path);
    return look_into(path, err);
}

static int make_real(const char *path, int length, char out[PATH_MAX], struct spl_error *err)
{
    char *copy = NULL;
    if (asprintf(&copy, "%.*s", length ? length : 1, length ? path : ".") < 0)
        return spl_fail(err, SPL_E_NOMEM, "out of memory for the name of %.300s", path);
    int rc = realpath(copy, out) ? SPL_OK : spl_fail_errno(err, errno, "%.300s: this folder cannot be found", copy);
    free(copy);
    return rc;
}

int spl_job_relate(const char *folder, const char *file, char **out, struct spl_error *err)
{
    char from[PATH_MAX], to[PATH_MAX];
    const char *name = spl_input_name(file);
    size_t same = 0, ups = 0; /* bytes of whole parts that both begin with */
    *out = NULL;
    int rc = make_real(folder, (int)strlen(folder), from, err);
    if (!rc)
        rc = make_real(file, (int)(name - file), to, err);
    if (rc)
        return rc;
    for (size_t i = 0;; i++) {
        bool ends[2] = {!from[i] || (from[i] == '/' && i), !to[i] || (to[i] == '/' && i)};
        if (ends[0] && ends[1])
            same = i;
        if (from[i] != to[i] || !from[i])
            break;
    }
    if (!strcmp(from, "/") || !strcmp(to, "/"))
        same = 0;
    for (const char *p = strcmp(from, "/") ? from + same : ""; *p; p++)
        ups += *p == '/';
    const char *rest = strcmp(to, "/") ? to + same : "";
    rest += *rest == '/';
    size_t room = 3 * ups + strlen(rest) + strlen(name) + 2;
    if (!(*out = spl_alloc(room, 1, err)))
        return SPL_E_NOMEM;
    for (size_t i = 0; i < ups; i++)
        strcat(*out, "../");
    strcat(*out, rest);
    if (*rest)
        strcat(*out, "/");
    strcat(*out, name);
    return SPL_OK;
}
