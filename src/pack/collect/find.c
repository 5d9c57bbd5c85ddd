/* Which tiles are meant: files, folders with all datasets in them, lists with a path a line. A collection names its
 * tiles by their file names, so all of them lie in one folder with it. The caller's thread; one descriptor at a
 * time. */
#include <dirent.h>
#include <errno.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>

#include "base/array.h"
#include "cloud/source.h"
#include "pack/collect/collect.h"
#include "pack/inputs.h"

static const char ending[] = ".spld";

static bool is_dataset(const char *name)
{
    size_t length = strlen(name);
    return name[0] != '.' && length > sizeof ending - 1 && !strcmp(name + length - (sizeof ending - 1), ending);
}

/* Takes ownership of `path`, which may be NULL: then there was no memory for it. */
static int add(struct spl_collect *c, char *path, bool in_folder, struct spl_error *err)
{
    if (path && !spl_array_reserve(c->tiles, c->capacity, c->count + 1, err)) {
        if (c->count == SPL_COLLECT_TILES_MAX) {
            free(path);
            return spl_fail_field(err, SPL_E_LIMIT, "inputs",
                                  "more than %d tiles; pack several of them as one dataset each, so that there are "
                                  "fewer",
                                  SPL_COLLECT_TILES_MAX);
        }
        c->tiles[c->count++] = (struct spl_collect_tile){
            .path = path, .name = spl_input_name(path), .in_folder = in_folder};
        return SPL_OK;
    }
    free(path);
    return spl_fail(err, SPL_E_NOMEM, "out of memory for the names of tiles");
}

/* All datasets of a folder but the one that is to be written. */
static int add_folder(struct spl_collect *c, const char *path, struct spl_error *err)
{
    const char *output = spl_input_name(c->options->output), *slash = path[strlen(path) - 1] == '/' ? "" : "/";
    size_t before = c->count;
    DIR *dir = opendir(path);
    int rc = SPL_OK;
    if (!dir)
        return spl_fail_errno(err, errno, "%.300s: this folder cannot be opened", path);
    for (struct dirent *item; !rc && (errno = 0, item = readdir(dir));) {
        char *inner = NULL;
        if (!is_dataset(item->d_name) || !strcmp(item->d_name, output))
            continue;
        if (asprintf(&inner, "%s%s%s", path, slash, item->d_name) < 0)
            inner = NULL;
        rc = add(c, inner, true, err);
    }
    if (!rc && errno)
        rc = spl_fail_errno(err, errno, "%.300s: this folder cannot be read to its end", path);
    closedir(dir);
    if (!rc && c->count == before)
        rc = spl_fail_field(err, SPL_E_NOT_FOUND, "inputs",
                            "%.300s: no NAME.spld lies in this folder; pack its scans first, each as a dataset", path);
    return rc;
}

static int add_path(struct spl_collect *c, const char *path, struct spl_error *err)
{
    struct stat status;
    return !stat(path, &status) && S_ISDIR(status.st_mode) ? add_folder(c, path, err)
                                                           : add(c, strdup(path), false, err);
}

static int add_list(struct spl_collect *c, const char *name, struct spl_error *err)
{
    struct spl_source list;
    const char *line, *slash = strrchr(name, '/');
    size_t length, before = c->count;
    int rc = spl_source_open(&list, name, err);
    if (rc)
        return rc;
    while (!rc && (rc = spl_source_line(&list, &line, &length, err)) > 0) {
        char *path = NULL;
        for (; length && (*line == ' ' || *line == '\t'); line++)
            length--;
        while (length && (line[length - 1] == ' ' || line[length - 1] == '\t'))
            length--;
        rc = SPL_OK;
        if (!length || *line == '#')
            continue;
        int outside = *line == '/' || !slash ? 0 : (int)(slash + 1 - name);
        if (memchr(line, 0, length))
            rc = spl_source_fail_line(&list, list.line, "", err,
                                      "a byte 0 is in no path: a list is UTF-8 text with a path a line");
        else if (asprintf(&path, "%.*s%.*s", outside, name, (int)length, line) < 0)
            rc = spl_fail(err, SPL_E_NOMEM, "out of memory for the names of tiles");
        else
            rc = add_path(c, path, err);
        free(path);
    }
    spl_source_close(&list);
    if (!rc && c->count == before)
        rc = spl_fail_field(err, SPL_E_INPUT, "inputs", "%.300s: this list names no tile", name);
    return rc;
}

/* The folder that a path's last part lies in. */
static int find_folder(const char *path, struct stat *status, struct spl_error *err)
{
    int length = (int)(spl_input_name(path) - path);
    char *folder = NULL;
    if (asprintf(&folder, "%.*s", length ? length : 1, length ? path : ".") < 0)
        return spl_fail(err, SPL_E_NOMEM, "out of memory for the names of tiles");
    int rc = stat(folder, status) ? spl_fail_errno(err, errno, "%.300s: this folder cannot be opened", folder) : SPL_OK;
    free(folder);
    return rc;
}

static int check_tile(const struct spl_collect *c, const struct spl_collect_tile *tile, const struct stat *folder,
                      struct spl_error *err)
{
    const char *output = c->options->output;
    struct stat status;
    if (strstr(tile->path, "://"))
        return spl_fail_field(err, SPL_E_USAGE, "inputs",
                              "%.300s: tiles are files beside the collection; collect them where they lie, and put all "
                              "of it onto the server",
                              tile->path);
    int rc = find_folder(tile->path, &status, err);
    if (rc)
        return rc;
    const bool elsewhere = status.st_dev != folder->st_dev || status.st_ino != folder->st_ino;
    if (elsewhere && stat(tile->path, &status) && errno == ENOENT)
        return spl_fail_field(err, SPL_E_NOT_FOUND, "inputs", "%.300s: there is no such file or folder", tile->path);
    if (elsewhere)
        return spl_fail_field(err, SPL_E_USAGE, "inputs",
                              "%.200s lies in another folder than %.200s; a collection lies beside its tiles: write it "
                              "there, or move the tile",
                              tile->path, output);
    if (!strcmp(tile->name, spl_input_name(output)))
        return spl_fail_field(err, SPL_E_USAGE, "output",
                              "%.300s is an input too; choose another name, or name the folder, which stands for all "
                              "tiles in it",
                              output);
    return *tile->name != '.' && !tile->name[strspn(tile->name, SPL_NAME_LETTERS)]
               ? SPL_OK
               : spl_fail_field(err, SPL_E_USAGE, "inputs",
                                "%.300s: a tile's name is letters (a-z, A-Z), digits, '.', '_' and '-', the first of "
                                "them not a '.'; rename the file",
                                tile->path);
}

static int by_name(const void *a, const void *b)
{
    return strcmp(((const struct spl_collect_tile *)a)->name, ((const struct spl_collect_tile *)b)->name);
}

int spl_collect_find(struct spl_collect *c, struct spl_error *err)
{
    const struct spl_collect_options *o = c->options;
    struct stat folder, status;
    int rc = SPL_OK;
    if (!o->input_count)
        return spl_fail_field(err, SPL_E_USAGE, "inputs", "name the tiles to collect");
    if (!o->output || !*spl_input_name(o->output))
        return spl_fail_field(err, SPL_E_USAGE, "output", "name the dataset to write, such as city.spld");
    if (!stat(o->output, &status) && !S_ISREG(status.st_mode))
        return spl_fail_field(err, SPL_E_USAGE, "output", "%.300s exists and is no file", o->output);
    rc = find_folder(c->apart ? o->inputs[0] : o->output, &folder, err);
    for (size_t i = 0; !rc && i < o->input_count; i++)
        rc = !*o->inputs[i]          ? spl_fail_field(err, SPL_E_USAGE, "inputs", "a tile's name is empty")
             : o->inputs[i][0] == '@' ? add_list(c, o->inputs[i] + 1, err)
                                      : add_path(c, o->inputs[i], err);
    for (size_t i = 0; !rc && i < c->count; i++)
        rc = check_tile(c, &c->tiles[i], &folder, err);
    if (rc)
        return rc;
    qsort(c->tiles, c->count, sizeof *c->tiles, by_name);
    for (size_t i = 1; i < c->count; i++)
        if (!strcmp(c->tiles[i - 1].name, c->tiles[i].name))
            return spl_fail_field(err, SPL_E_USAGE, "inputs", "%.300s is named twice; name it once", c->tiles[i].path);
    return SPL_OK;
}
