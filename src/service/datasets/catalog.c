/* The table of datasets, and how it is filled at start.
 *
 * Invariant: ids are unique and sorted, so that a lookup is a binary search and a listing is the same every time. An id
 * is compared with names that are here already; only PUT makes a path of one, after spl_catalog_id_is_valid(). */
#include "service/datasets/catalog.h"

#include <errno.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>

#include "base/array.h"
#include "base/log.h"
#include "base/memory.h"
#include "base/parallel.h"
#include "dataset/remote_url.h"

bool spl_file_mark_is_equal(const struct spl_file_mark *a, const struct spl_file_mark *b)
{
    return a->device == b->device && a->inode == b->inode && a->bytes == b->bytes && a->changed_s == b->changed_s &&
           a->changed_ns == b->changed_ns;
}

struct spl_file_mark spl_file_mark_of(const struct stat *status)
{
    return (struct spl_file_mark){.device = status->st_dev,
                                  .inode = status->st_ino,
                                  .bytes = (uint64_t)status->st_size,
                                  .changed_s = status->st_mtim.tv_sec,
                                  .changed_ns = status->st_mtim.tv_nsec};
}

const char *spl_catalog_id_of(const char *path, size_t *length)
{
    const char *stem = spl_remote_get_stem(path, length);
    return spl_catalog_id_is_valid(stem, *length) ? stem : NULL;
}

/* Where `id` is, or would be. */
static size_t place_of(const struct spl_catalog *catalog, const char *id, bool *found)
{
    size_t low = 0, high = catalog->count;
    *found = false;
    while (low < high && !*found) {
        size_t middle = (low + high) / 2;
        int order = strcmp(id, catalog->slots[middle].id);
        if (!order) {
            low = middle;
            *found = true;
        } else if (order < 0) {
            high = middle;
        } else {
            low = middle + 1;
        }
    }
    return low;
}

struct spl_catalog_slot *spl_catalog_find_slot(const struct spl_catalog *catalog, const char *id)
{
    bool found;
    size_t at = place_of(catalog, id, &found);
    return found ? &catalog->slots[at] : NULL;
}

struct spl_catalog_entry *spl_catalog_find(const struct spl_catalog *catalog, const char *id)
{
    const struct spl_catalog_slot *slot = spl_catalog_find_slot(catalog, id);
    return slot ? slot->current : NULL;
}

struct spl_catalog_slot *spl_catalog_add_slot(struct spl_catalog *catalog, const char *id, const char *path,
                                              struct spl_error *err)
{
    bool found;
    size_t at = place_of(catalog, id, &found);
    spl_assert(!found);
    if (catalog->count == SPL_CATALOG_MAX) {
        spl_fail(err, SPL_E_LIMIT, "more than %d datasets", (int)SPL_CATALOG_MAX);
        return NULL;
    }
    if (spl_array_reserve(catalog->slots, catalog->capacity, catalog->count + 1, err))
        return NULL;
    char *copy = strdup(path);
    if (!copy) {
        spl_fail(err, SPL_E_NOMEM, "out of memory for the path of '%s'", id);
        return NULL;
    }
    struct spl_catalog_slot *slot = &catalog->slots[at];
    memmove(slot + 1, slot, (catalog->count - at) * sizeof *slot);
    *slot = (struct spl_catalog_slot){.path = copy};
    snprintf(slot->id, sizeof slot->id, "%s", id);
    catalog->count++;
    return slot;
}

void spl_catalog_hide_folder(char *out, size_t capacity, const char *message, const char *path)
{
    const char *slash = strrchr(path, '/');
    size_t folder = slash ? (size_t)(slash + 1 - path) : 0, used = 0;
    while (*message && used + 1 < capacity) {
        if (folder && !strncmp(message, path, folder))
            message += folder;
        else
            out[used++] = *message++;
    }
    out[used] = '\0';
}

void spl_catalog_set_reason(struct spl_catalog_slot *slot, const char *message)
{
    char shown[1024]; // as messages name a URL
    spl_catalog_hide_folder(slot->reason, sizeof slot->reason, message,
                            spl_remote_show(slot->path, shown, sizeof shown));
}

bool spl_catalog_may_pass(const char *path, const struct spl_error *why)
{
    if (why->code && spl_remote_is_url(path)) // nobody sees a server's file change before it is asked for
        return true;
    return why->code == SPL_E_IO || why->code == SPL_E_NOMEM || why->code == SPL_E_NOT_FOUND;
}

void spl_catalog_say_left_out(struct spl_catalog *catalog, size_t left_out, const struct spl_catalog_files *files)
{
    if (left_out && left_out != catalog->left_out)
        spl_log_warn("%zu datasets are left out: the first %d by name are served", left_out, (int)SPL_CATALOG_MAX);
    const size_t nameless = files->nameless;
    if (nameless && nameless != catalog->nameless)
        spl_log_warn("%zu %s left out, as %s: a name is a dataset's id, which has at most " SPL_CATALOG_ID_RULE
                     "; rename what is to be served",
                     nameless, nameless == 1 ? "file is" : "files are", files->nameless_names);
    catalog->left_out = left_out;
    catalog->nameless = nameless;
}

void spl_catalog_remove_slot(struct spl_catalog *catalog, struct spl_catalog_slot *slot)
{
    size_t at = (size_t)(slot - catalog->slots);
    spl_catalog_entry_unref(slot->current);
    free(slot->path);
    memmove(slot, slot + 1, (--catalog->count - at) * sizeof *slot);
}

void spl_catalog_finish(struct spl_catalog *catalog)
{
    while (catalog->count)
        spl_catalog_remove_slot(catalog, &catalog->slots[catalog->count - 1]);
    free(catalog->slots);
    *catalog = (struct spl_catalog){0};
}

struct opening {
    const struct spl_catalog_files *files;
    const struct spl_dataset_opening *how;
    struct spl_catalog_entry **entries; /* one a file, as are the errors, so that nothing depends on who was first */
    struct spl_error *errors;
};

static void open_range(void *context, size_t begin, size_t end, unsigned worker)
{
    (void)worker;
    struct opening *opening = context;
    for (size_t i = begin; i < end; i++)
        if (!spl_remote_is_url(opening->files->items[i].path)) // library.c opens them, once others are served
            spl_catalog_entry_open(opening->files->items[i].path, opening->files->items[i].path, opening->how,
                                   &opening->entries[i], &opening->errors[i]);
}

/* Puts one opened file into its slot; takes the entry. */
static int place(struct spl_catalog *catalog, const struct spl_catalog_file *file, struct spl_catalog_entry **entry,
                 const struct spl_error *why, struct spl_error *err)
{
    char id[sizeof((struct spl_catalog_slot *)0)->id];
    size_t length;
    const char *stem = spl_catalog_id_of(file->path, &length);
    if (why->code && (!file->in_directory || !stem))
        return spl_fail(err, why->code, "%s", why->message);
    snprintf(id, sizeof id, "%.*s", (int)length, stem);
    struct spl_catalog_slot *slot = spl_catalog_find_slot(catalog, id);
    if (slot) {
        struct spl_error twice = {0};
        char one[200], other[200];
        spl_fail(&twice, SPL_E_USAGE, "two datasets are called '%.100s': '%.150s' and '%.150s'; rename one", id,
                 spl_remote_show(slot->path, one, sizeof one), spl_remote_show(file->path, other, sizeof other));
        if (!file->in_directory)
            return spl_fail(err, twice.code, "%s", twice.message);
        spl_log_warn("%s; the second is not served", twice.message);
        return 0;
    }
    if (!(slot = spl_catalog_add_slot(catalog, id, file->path, err)))
        return SPL_E_NOMEM;
    slot->in_directory = file->in_directory;
    slot->seen = file->mark;
    if (*entry || (why->code && !spl_catalog_may_pass(file->path, why)))
        slot->opened = file->mark;
    slot->current = *entry;
    *entry = NULL;
    if (why->code) {
        spl_catalog_set_reason(slot, why->message);
        spl_log_warn("dataset %s is not served: %s", id, why->message);
    }
    return 0;
}

/* What a command line may get wrong and a later look may not. */
static int check_paths(char *const *paths, size_t path_count, struct spl_error *err)
{
    for (size_t i = 0; i < path_count; i++) {
        struct stat status;
        if (spl_remote_is_url(paths[i])) {
            const struct spl_s3_account account = spl_s3_account_of_environment();
            struct spl_remote_url url;
            int rc = spl_remote_url_parse(paths[i], &account, &url, err);
            if (rc)
                return rc;
            spl_remote_url_finish(&url);
            size_t length;
            char shown[300];
            if (!spl_catalog_id_of(paths[i], &length))
                return spl_fail_field(err, SPL_E_USAGE, "dataset",
                                      "%s: its name cannot be a dataset's id, which has at most " SPL_CATALOG_ID_RULE,
                                      spl_remote_show(paths[i], shown, sizeof shown));
        } else if (stat(paths[i], &status))
            return errno == ENOENT
                       ? spl_fail_field(err, SPL_E_USAGE, "dataset",
                                        "%s: there is no such file or directory of datasets; 'splatd pack SCAN "
                                        "-o NAME.spld' makes one from a scan",
                                        paths[i])
                       : spl_fail_errno(err, errno, "cannot open '%s'", paths[i]);
    }
    return 0;
}

int spl_catalog_open(struct spl_catalog *catalog, char *const *paths, size_t path_count,
                     const struct spl_dataset_opening *how, struct spl_error *err)
{
    *catalog = (struct spl_catalog){0};
    struct spl_catalog_files files = {0};
    struct opening opening = {.files = &files, .how = how};
    int rc = check_paths(paths, path_count, err);
    if (rc || (rc = spl_catalog_list(paths, path_count, &files, err)))
        goto done;
    opening.entries = spl_alloc(files.count, sizeof *opening.entries, err);
    opening.errors = spl_alloc(files.count, sizeof *opening.errors, err);
    if (!opening.entries || !opening.errors) {
        rc = SPL_E_NOMEM;
        goto done;
    }
    if (files.why.code)
        spl_log_warn("%s; its datasets are not served", files.why.message);
    spl_catalog_say_left_out(catalog, files.left_out, &files);
    spl_parallel_for(0, files.count, 1, open_range, &opening);
    for (size_t i = 0; !rc && i < files.count; i++)
        rc = place(catalog, &files.items[i], &opening.entries[i], &opening.errors[i], err);
done:
    for (size_t i = 0; opening.entries && i < files.count; i++)
        spl_catalog_entry_unref(opening.entries[i]);
    free(opening.entries);
    free(opening.errors);
    spl_catalog_files_finish(&files);
    if (rc)
        spl_catalog_finish(catalog);
    return rc;
}
