/* Which files the served paths stand for. A name says whether it may be a dataset; what is wrong with the file behind
 * it is found by whoever opens it, and is that dataset's state: a link to itself, a link to nowhere or a file that may
 * not be examined is listed like any other, by what is known of the name itself.
 *
 * Of a directory only names are kept, never more than twice as many as datasets can be served, so a directory of
 * millions costs time and no memory. Any thread; blocks on disk. */
#include <dirent.h>
#include <errno.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>

#include "base/array.h"
#include "base/memory.h"
#include "dataset/remote_url.h"
#include "service/datasets/catalog.h"

static bool is_dataset_name(const char *name)
{
    size_t length = strlen(name);
    return length > 5 && !strcmp(name + length - 5, ".spld");
}

/* Files that were named themselves first, then by id; the same id in the order of the paths. */
static int compare(const void *a, const void *b)
{
    const struct spl_catalog_file *p = a, *q = b;
    if (p->in_directory != q->in_directory)
        return p->in_directory ? 1 : -1;
    const char *left = strrchr(p->path, '/'), *right = strrchr(q->path, '/');
    int order = p->in_directory ? strcmp(left, right) : 0;
    return order ? order : (p->place > q->place) - (p->place < q->place);
}

/* The first SPL_CATALOG_MAX of them stay. */
static void keep_first(struct spl_catalog_files *files)
{
    if (files->count)
        qsort(files->items, files->count, sizeof *files->items, compare);
    for (; files->count > SPL_CATALOG_MAX; files->left_out++)
        free(files->items[--files->count].path);
}

static int add_file(struct spl_catalog_files *files, const char *directory, const char *name, size_t place,
                    struct spl_error *err)
{
    char *path = NULL;
    if (files->count == 2 * SPL_CATALOG_MAX)
        keep_first(files);
    if (spl_array_reserve(files->items, files->capacity, files->count + 1, err))
        return SPL_E_NOMEM;
    if (asprintf(&path, "%s%s%s", directory, *directory ? "/" : "", name) < 0)
        return spl_fail(err, SPL_E_NOMEM, "out of memory for the path of '%s'", name);
    files->items[files->count++] =
        (struct spl_catalog_file){.path = path, .in_directory = *directory, .place = place};
    return 0;
}

/* Names of files may have any bytes; the log shows what is not printable as such. */
static void note_nameless(struct spl_catalog_files *files, const char *name)
{
    enum { shown = 3 };
    char *text = files->nameless_names;
    size_t used = strlen(text);
    if (files->nameless++ < shown)
        snprintf(text + used, sizeof files->nameless_names - used, "%s'%.*s%s'", used ? ", " : "", 48, name,
                 strlen(name) > 48 ? "…" : "");
}

/* SPL_E_IO for a directory that cannot be read to its end: nobody knows then what it does not have. */
static int add_directory(struct spl_catalog_files *files, const char *directory, size_t place, struct spl_error *err)
{
    DIR *dir = opendir(directory);
    if (!dir)
        return spl_fail_errno(err, errno, "cannot list '%s'", directory);
    int rc = 0;
    for (struct dirent *item; !rc && (errno = 0, item = readdir(dir));) {
        size_t ignored;
        if (!is_dataset_name(item->d_name) || item->d_name[0] == '.')
            continue;
        if (spl_catalog_id_of(item->d_name, &ignored))
            rc = add_file(files, directory, item->d_name, place, err);
        else
            note_nameless(files, item->d_name);
    }
    if (!rc && errno)
        rc = spl_fail_errno(err, errno, "cannot list '%s'", directory);
    closedir(dir);
    return rc;
}

/* What lies at the path now. False when nothing does. A URL is not asked: whether what it names has changed is seen by
 * who reads from it. */
static bool look(struct spl_catalog_file *file)
{
    struct stat status = {0};
    if (spl_remote_is_url(file->path)) {
        file->mark = (struct spl_file_mark){.inode = 1};
        return true;
    }
    if (stat(file->path, &status) && lstat(file->path, &status)) {
        if (errno == ENOENT || errno == ENOTDIR)
            return false;
        status = (struct stat){0}; // there may be something
    }
    file->mark = spl_file_mark_of(&status);
    return true;
}

int spl_catalog_list(char *const *paths, size_t path_count, struct spl_catalog_files *files, struct spl_error *err)
{
    *files = (struct spl_catalog_files){0};
    if (!(files->unlisted = spl_alloc(path_count, sizeof *files->unlisted, err)))
        return SPL_E_NOMEM;
    for (size_t i = 0; i < path_count; i++) {
        struct stat status;
        struct spl_error why = {0};
        bool url = spl_remote_is_url(paths[i]);
        bool there = url || !stat(paths[i], &status), directory = !url && there && S_ISDIR(status.st_mode);
        if (!there && !is_dataset_name(paths[i]))
            spl_fail_errno(&why, errno, "cannot list '%s'", paths[i]);
        else if (directory)
            add_directory(files, paths[i], i, &why);
        else
            add_file(files, "", paths[i], i, &why);
        if (why.code == SPL_E_NOMEM)
            return spl_fail(err, why.code, "%s", why.message);
        if (why.code)
            files->unlisted[files->unlisted_count++] = paths[i];
        spl_fail(&files->why, why.code, "%s", why.message);
    }
    keep_first(files);
    size_t there = 0;
    for (size_t i = 0; i < files->count; i++)
        if (look(&files->items[i]))
            files->items[there++] = files->items[i];
        else
            free(files->items[i].path);
    files->count = there;
    return 0;
}

bool spl_catalog_is_unlisted(const struct spl_catalog_files *files, const char *path)
{
    const char *slash = strrchr(path, '/');
    for (size_t i = 0; slash && i < files->unlisted_count; i++) {
        size_t length = strlen(files->unlisted[i]);
        if (length == (size_t)(slash - path) && !strncmp(path, files->unlisted[i], length))
            return true;
    }
    return false;
}

const char *spl_catalog_first_directory(char *const *paths, size_t path_count)
{
    struct stat status;
    for (size_t i = 0; i < path_count; i++)
        if (!stat(paths[i], &status) && S_ISDIR(status.st_mode))
            return paths[i];
    return NULL;
}

void spl_catalog_files_finish(struct spl_catalog_files *files)
{
    for (size_t i = 0; i < files->count; i++)
        free(files->items[i].path);
    free(files->items);
    free(files->unlisted);
    *files = (struct spl_catalog_files){0};
}
