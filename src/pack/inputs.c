/* The files that arguments mean. What a file is, its bytes say, and so it is with every file that is named; but a
 * folder of tiles holds reports, indices and projections too, so that there a name's ending decides whether it is
 * taken.
 *
 * Invariant: a file or folder is entered once, whatever names and links lead to it, so that a loop of links ends and
 * the time is that of reading each folder once and sorting its names. One descriptor is open at a time. Owned by the
 * caller's thread. */
#include "pack/inputs.h"

#include <dirent.h>
#include <errno.h>
#include <limits.h>
#include <stdbool.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>

#include "base/array.h"
#include "base/hash.h"
#include "base/memory.h"
#include "cloud/cloud.h"
#include "cloud/source.h"
#include "pack/names.h"
#include "pack/warn.h"

enum { depth_max = 64 };

struct seen { /* an open hash table of files and folders */
    struct place {
        uint64_t device, node;
        bool used;
    } * places;
    size_t count, room; /* a power of two, or 0 */
};

struct finder {
    struct spl_inputs *inputs;
    struct seen seen;
    struct spl_names again; /* of what was seen before */
    struct spl_names other; /* of what the folder at work has besides scans */
    struct spl_names drawings; /* of our own, that lie beside the scans they were made of */
    size_t pending;         /* names that are read and not yet entered */
};

/* What a folder has, while it is read. */
struct entries {
    struct entry {
        char *name;
        bool folder;
    } * list;
    size_t count, capacity;
};

static struct place *find_place(const struct seen *seen, uint64_t device, uint64_t node)
{
    size_t at = spl_hash_slot(node ^ device << 32 ^ device >> 32, seen->room - 1);
    while (seen->places[at].used && (seen->places[at].device != device || seen->places[at].node != node))
        at = (at + 1) & (seen->room - 1);
    return &seen->places[at];
}

/* 1 when it is new, 0 when it was there, or negative. */
static int enter(struct seen *seen, const struct stat *status, struct spl_error *err)
{
    if (2 * seen->count >= seen->room) {
        struct seen bigger = {.count = seen->count, .room = seen->room ? 2 * seen->room : 64};
        bigger.places = spl_alloc(bigger.room, sizeof *bigger.places, err);
        if (!bigger.places)
            return SPL_E_NOMEM;
        for (size_t i = 0; i < seen->room; i++)
            if (seen->places[i].used)
                *find_place(&bigger, seen->places[i].device, seen->places[i].node) = seen->places[i];
        free(seen->places);
        *seen = bigger;
    }
    struct place *place = find_place(seen, status->st_dev, status->st_ino);
    if (place->used)
        return 0;
    *place = (struct place){status->st_dev, status->st_ino, true};
    seen->count++;
    return 1;
}

const char *spl_input_name(const char *path)
{
    const char *slash = strrchr(path, '/');
    return slash ? slash + 1 : path;
}

int spl_inputs_leave_out(struct spl_inputs *inputs, const char *path, int rc, const struct spl_error *why,
                         struct spl_error *err)
{
    bool of_the_file = rc == SPL_E_INPUT || rc == SPL_E_NOT_FOUND || rc == SPL_E_UNSUPPORTED || rc == SPL_E_IO;
    if (!inputs->listener.left_out || !of_the_file)
        return spl_fail_field(err, rc, why->field, "%s", why->message);
    if (spl_array_reserve(inputs->left_out, inputs->left_out_capacity, inputs->left_out_count + 1, err))
        return SPL_E_NOMEM;
    char *copy = strdup(path);
    if (!copy)
        return spl_fail(err, SPL_E_NOMEM, "out of memory for the name of %.300s", path);
    inputs->left_out[inputs->left_out_count++] = copy;
    spl_fail_field(&inputs->why, rc, why->field, "%s", why->message);
    inputs->listener.left_out(inputs->listener.context, why);
    return SPL_OK;
}

int spl_inputs_check_there(const struct spl_inputs *inputs, struct spl_error *err)
{
    for (size_t i = 0; i < inputs->count && !inputs->listener.left_out; i++) {
        struct stat status;
        struct spl_source source;
        if (!stat(inputs->paths[i], &status))
            continue;
        int rc = spl_source_open(&source, inputs->paths[i], err); /* says why */
        if (rc)
            return rc;
        spl_source_close(&source); /* it came meanwhile */
    }
    return SPL_OK;
}

int spl_inputs_fail_empty(const struct spl_inputs *inputs, struct spl_error *err)
{
    if (!inputs->left_out_count)
        return spl_fail(err, SPL_E_NOT_FOUND, "no scan is named");
    return spl_fail_field(err, SPL_E_INPUT, "inputs", "none of the inputs can be used; the first of %zu: %.400s",
                          inputs->left_out_count, inputs->why.message);
}

static int add_file(struct finder *f, const char *path, const struct stat *status, struct spl_error *err)
{
    struct spl_inputs *inputs = f->inputs;
    int is_new = status ? enter(&f->seen, status, err) : 1;
    if (!is_new)
        spl_names_add(&f->again, path);
    if (is_new <= 0)
        return is_new;
    if (spl_array_reserve(inputs->paths, inputs->capacity, inputs->count + 1, err))
        return SPL_E_NOMEM;
    if (!(inputs->paths[inputs->count] = strdup(path)))
        return spl_fail(err, SPL_E_NOMEM, "out of memory for the name of %.300s", path);
    if (++inputs->count > SPL_INPUTS_MAX)
        return spl_fail(err, SPL_E_LIMIT, "%.300s: more than %d scans; pack them as several datasets", path,
                        SPL_INPUTS_MAX);
    return SPL_OK;
}

static void finish_entries(struct entries *entries)
{
    for (size_t i = 0; i < entries->count; i++)
        free(entries->list[i].name);
    free(entries->list);
    *entries = (struct entries){0};
}

/* A folder, a file that may be a scan, or neither. Where the file system does not say and for links, what is there. */
static bool is_wanted(DIR *dir, const struct dirent *item, bool *folder)
{
    struct stat status;
    bool named = spl_cloud_is_named_scan(item->d_name);
    *folder = item->d_type == DT_DIR;
    if (item->d_name[0] == '.' || (!named && item->d_type == DT_REG))
        return false;
    if (item->d_type != DT_LNK && item->d_type != DT_UNKNOWN)
        return *folder || (named && item->d_type == DT_REG);
    if (fstatat(dirfd(dir), item->d_name, &status, 0)) /* a link that leads nowhere is said when it is opened */
        return named;
    *folder = S_ISDIR(status.st_mode);
    return *folder || (named && S_ISREG(status.st_mode));
}

static int read_folder(struct finder *f, const char *path, struct entries *entries, struct spl_error *err)
{
    DIR *dir = opendir(path);
    int rc = SPL_OK;
    if (!dir)
        return spl_fail_errno(err, errno, "%.300s: this folder cannot be opened", path);
    for (struct dirent *item; !rc && (errno = 0, item = readdir(dir));) {
        struct entry entry = {0};
        if (!strcmp(item->d_name, ".") || !strcmp(item->d_name, ".."))
            continue;
        if (!is_wanted(dir, item, &entry.folder)) {
            spl_names_add(&f->other, item->d_name);
            continue;
        }
        if (f->inputs->count + f->pending + entries->count >= SPL_INPUTS_MAX)
            rc = spl_fail(err, SPL_E_LIMIT, "%.300s: more than %d scans and folders; pack them as several datasets",
                          path, SPL_INPUTS_MAX);
        else if (spl_array_reserve(entries->list, entries->capacity, entries->count + 1, err))
            rc = SPL_E_NOMEM;
        else if (!(entry.name = strdup(item->d_name)))
            rc = spl_fail(err, SPL_E_NOMEM, "out of memory for the names in %.300s", path);
        else
            entries->list[entries->count++] = entry;
    }
    if (!rc && errno)
        rc = spl_fail_errno(err, errno, "%.300s: this folder cannot be read to its end", path);
    closedir(dir);
    return rc;
}

static int by_name(const void *a, const void *b)
{
    return strcmp(((const struct entry *)a)->name, ((const struct entry *)b)->name);
}

static int search(struct finder *f, const char *path, unsigned depth, struct spl_error *err)
{
    struct entries entries = {0};
    struct spl_error why = {0};
    struct stat status;
    if (depth > depth_max)
        return spl_fail(err, SPL_E_LIMIT, "%.300s: folders lie deeper than %d in each other", path, depth_max);
    int rc = stat(path, &status) ? spl_fail_errno(&why, errno, "%.300s: this folder cannot be opened", path) : SPL_OK;
    if (!rc) {
        int is_new = enter(&f->seen, &status, err);
        if (!is_new)
            spl_names_add(&f->again, path);
        if (is_new <= 0)
            return is_new;
        rc = read_folder(f, path, &entries, &why);
    }
    if (rc) {
        finish_entries(&entries);
        return spl_inputs_leave_out(f->inputs, path, rc, &why, err);
    }
    if (entries.count)
        qsort(entries.list, entries.count, sizeof *entries.list, by_name);
    f->pending += entries.count;
    for (size_t i = 0; !rc && i < entries.count; i++) {
        const char *slash = path[strlen(path) - 1] == '/' ? "" : "/";
        char *inner = NULL;
        f->pending--;
        if (asprintf(&inner, "%s%s%s", path, slash, entries.list[i].name) < 0) {
            inner = NULL;
            rc = spl_fail(err, SPL_E_NOMEM, "out of memory for the names in %.300s", path);
        } else if (entries.list[i].folder) {
            rc = search(f, inner, depth + 1, err);
        } else if (spl_cloud_is_drawing(inner)) {
            spl_names_add(&f->drawings, inner);
        } else {
            rc = add_file(f, inner, stat(inner, &status) ? NULL : &status, err);
        }
        free(inner);
    }
    finish_entries(&entries);
    return rc;
}

#define say(f, ...) spl_pack_warn((f)->inputs->listener.warn, (f)->inputs->listener.context, __VA_ARGS__)

static int add_folder(struct finder *f, const char *path, struct spl_error *err)
{
    struct spl_inputs *inputs = f->inputs;
    size_t before = inputs->count, again = f->again.count, left_out = inputs->left_out_count;
    char endings[256];
    f->other = (struct spl_names){0};
    int rc = search(f, path, 0, err);
    if (rc)
        return rc;
    spl_cloud_list_endings(endings, sizeof endings);
    size_t found = inputs->count - before, others = f->other.count;
    if (found && others)
        say(f,
            "%.300s: %zu scans are taken, %zu other files left (%s): in a folder the endings %s are a scan's; name "
            "others themselves",
            path, found, others, spl_names_list(&f->other), endings);
    if (found || f->again.count > again || inputs->left_out_count > left_out)
        return SPL_OK;
    struct spl_error why = {0};
    rc = spl_fail(&why, SPL_E_NOT_FOUND,
                  "%.200s: no scan lies in this folder or below (%zu other files); those that end "
                  "in %s are taken",
                  path, others, endings);
    return spl_inputs_leave_out(inputs, path, rc, &why, err);
}

static int add_path(struct finder *f, const char *path, struct spl_error *err)
{
    struct stat status;
    bool there = !stat(path, &status);
    return there && S_ISDIR(status.st_mode) ? add_folder(f, path, err) : add_file(f, path, there ? &status : NULL, err);
}

/* A line of the list: 0 with *path, which is NULL for none, or negative. */
static int take_line(const struct spl_source *list, const char *line, size_t length, char **path, struct spl_error *err)
{
    const char *folder = list->path, *slash = strrchr(list->path, '/');
    *path = NULL;
    if (list->line == 1 && length >= 3 && !memcmp(line, "\xef\xbb\xbf", 3))
        line += 3, length -= 3;
    for (; length && (*line == ' ' || *line == '\t'); line++)
        length--;
    while (length && (line[length - 1] == ' ' || line[length - 1] == '\t'))
        length--;
    if (!length || *line == '#')
        return SPL_OK;
    if (memchr(line, 0, length))
        return spl_source_fail_line(list, list->line, "", err,
                                    "a byte 0 is in no path: a list is UTF-8 text with a path a line");
    if (length >= PATH_MAX)
        return spl_source_fail_line(list, list->line, "", err, "%zu bytes are no path, which has %d at most", length,
                                    PATH_MAX - 1);
    if (*line == '@')
        return spl_source_fail_line(list, list->line, "", err,
                                    "a list names no other list; write ./@NAME for a scan that is called so");
    int outside = *line == '/' || !slash ? 0 : (int)(slash + 1 - folder);
    return asprintf(path, "%.*s%.*s", outside, folder, (int)length, line) < 0
               ? spl_fail(err, SPL_E_NOMEM, "out of memory for the names in %.300s", folder)
               : SPL_OK;
}

static int add_list(struct finder *f, const char *name, struct spl_error *err)
{
    struct spl_source list;
    struct stat status;
    const char *line;
    size_t length, lines = 0;
    if (!*name)
        return spl_fail(err, SPL_E_USAGE, "'@' takes the name of a list of scans: @tiles.txt");
    if (stat(name, &status) && errno == ENOENT)
        return spl_fail(err, SPL_E_NOT_FOUND,
                        "%.200s: there is no such file with a list of scans; a scan called @%.200s is "
                        "named ./@%.200s",
                        name, name, name);
    int rc = spl_source_open(&list, name, err);
    while (!rc && (rc = spl_source_line(&list, &line, &length, err)) > 0) {
        char *path;
        struct spl_error why = {0};
        if ((rc = take_line(&list, line, length, &path, err)) || !path)
            continue;
        lines++;
        if (stat(path, &status)) {
            rc = spl_source_fail_line(&list, list.line, "", &why, "%.200s: %s", path,
                                      errno == ENOENT ? "there is no such file" : strerror(errno));
            rc = spl_inputs_leave_out(f->inputs, path, rc, &why, err);
        } else {
            rc = add_path(f, path, err);
        }
        free(path);
    }
    if (!rc && !lines)
        rc = spl_source_fail(&list, SPL_E_INPUT, "", err, "this list names no scan");
    spl_source_close(&list);
    return rc;
}

int spl_inputs_find(struct spl_inputs *inputs, const char *const *given, size_t count,
                    const struct spl_inputs_listener *listener, struct spl_error *err)
{
    struct finder f = {.inputs = inputs};
    int rc = SPL_OK;
    *inputs = (struct spl_inputs){.listener = *listener};
    for (size_t i = 0; !rc && i < count; i++)
        rc = given[i][0] == '@' ? add_list(&f, given[i] + 1, err) : add_path(&f, given[i], err);
    if (!rc && f.drawings.count)
        say(&f, "left out, since \"splatd pack --export-primitives\" drew them: %s", spl_names_list(&f.drawings));
    if (!rc && f.again.count)
        say(&f, "taken once, though named more than once: %s", spl_names_list(&f.again));
    free(f.seen.places);
    if (!rc && count && !inputs->count)
        rc = spl_inputs_fail_empty(inputs, err);
    if (rc)
        spl_inputs_finish(inputs);
    return rc;
}

static int by_last_part(const void *a, const void *b)
{
    const char *one = *(char *const *)a, *other = *(char *const *)b;
    int order = strcmp(spl_input_name(one), spl_input_name(other));
    return order ? order : strcmp(one, other);
}

void spl_inputs_sort(struct spl_inputs *inputs)
{
    if (inputs->count)
        qsort(inputs->paths, inputs->count, sizeof *inputs->paths, by_last_part);
    if (inputs->left_out_count)
        qsort(inputs->left_out, inputs->left_out_count, sizeof *inputs->left_out, by_last_part);
}

void spl_inputs_finish(struct spl_inputs *inputs)
{
    for (size_t i = 0; i < inputs->count; i++)
        free(inputs->paths[i]);
    for (size_t i = 0; i < inputs->left_out_count; i++)
        free(inputs->left_out[i]);
    free(inputs->paths);
    free(inputs->left_out);
    *inputs = (struct spl_inputs){0};
}
