/* Opening the datasets of a command line.
 *
 * Invariant: ids are unique and sorted, so that a lookup is a binary search and a listing is the same every time. An id
 * is compared with names that are here already; it never becomes a path. */
#include "service/catalog.h"

#include <dirent.h>
#include <errno.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>

#include "base/memory.h"
#include "base/parallel.h"

enum { datasets_max = 1024 };

static int add_path(struct spl_catalog *catalog, const char *directory, const char *name, struct spl_error *err)
{
    if (catalog->count == datasets_max)
        return spl_fail(err, SPL_E_LIMIT, "more than %d datasets", (int)datasets_max);
    struct spl_catalog_entry *grown = spl_realloc(catalog->entries, catalog->count + 1, sizeof *grown, err);
    if (!grown)
        return SPL_E_NOMEM;
    catalog->entries = grown;
    struct spl_catalog_entry *entry = &grown[catalog->count];
    *entry = (struct spl_catalog_entry){0};
    if (asprintf(&entry->path, "%s%s%s", directory, *directory ? "/" : "", name) < 0)
        return spl_fail(err, SPL_E_NOMEM, "out of memory for the path of '%s'", name);
    catalog->count++;
    return 0;
}

static int add_directory(struct spl_catalog *catalog, const char *directory, struct spl_error *err)
{
    size_t before = catalog->count;
    DIR *dir = opendir(directory);
    if (!dir)
        return spl_fail_errno(err, errno, "cannot list '%s'", directory);
    int rc = 0;
    for (struct dirent *item; !rc && (item = readdir(dir));) {
        size_t length = strlen(item->d_name);
        if (item->d_name[0] != '.' && length > 5 && !strcmp(item->d_name + length - 5, ".spld"))
            rc = add_path(catalog, directory, item->d_name, err);
    }
    closedir(dir);
    if (!rc && catalog->count == before)
        rc = spl_fail(err, SPL_E_USAGE, "'%s' holds no .spld file; 'splatd pack' makes one", directory);
    return rc;
}

static void encode_uri(char *out, size_t capacity, const char *id)
{
    static const char plain[] = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789-._~";
    size_t used = (size_t)snprintf(out, capacity, "/v1/datasets/");
    for (; *id && used + 4 <= capacity; id++)
        used += (size_t)snprintf(out + used, capacity - used, strchr(plain, *id) ? "%c" : "%%%02X", (unsigned char)*id);
}

static int open_entry(struct spl_catalog_entry *entry, bool verify, struct spl_error *err)
{
    int rc = spl_dataset_open(entry->path, verify, &entry->dataset, err);
    if (rc)
        return rc;
    const struct spl_dataset_info *info = entry->info = spl_dataset_get_info(entry->dataset);
    struct spl_camera camera = {0};
    if ((rc = spl_dataset_get_default_camera(entry->dataset, 1280, 720, &camera, err)))
        return rc;
    entry->defaults.fov = info->default_fov;
    entry->defaults.near = camera.near;
    entry->defaults.far = camera.far;
    memcpy(entry->defaults.eye, info->default_eye, sizeof entry->defaults.eye);
    memcpy(entry->defaults.target, info->default_target, sizeof entry->defaults.target);
    memcpy(entry->defaults.up, info->default_up, sizeof entry->defaults.up);
    encode_uri(entry->uri, sizeof entry->uri, info->id);
    return spl_plan_create(entry->path, info, &entry->plan, err);
}

struct opening {
    struct spl_catalog *catalog;
    bool verify;
    struct spl_error *errors; /* one an entry, so that the message does not depend on who was first */
};

static void open_range(void *context, size_t begin, size_t end, unsigned worker)
{
    (void)worker;
    struct opening *opening = context;
    for (size_t i = begin; i < end; i++)
        open_entry(&opening->catalog->entries[i], opening->verify, &opening->errors[i]);
}

static int by_id(const void *a, const void *b)
{
    const struct spl_catalog_entry *left = a, *right = b;
    return strcmp(left->info->id, right->info->id);
}

int spl_catalog_open(struct spl_catalog *catalog, char *const *paths, size_t path_count, bool verify,
                     struct spl_error *err)
{
    *catalog = (struct spl_catalog){0};
    struct spl_error *errors = NULL;
    int rc = 0;
    for (size_t i = 0; !rc && i < path_count; i++) {
        struct stat status;
        if (stat(paths[i], &status))
            rc = spl_fail(err, SPL_E_USAGE, "cannot open '%s': %s", paths[i], strerror(errno));
        else
            rc = S_ISDIR(status.st_mode) ? add_directory(catalog, paths[i], err) : add_path(catalog, "", paths[i], err);
    }
    if (rc)
        goto done;
    if (!(errors = spl_alloc(catalog->count, sizeof *errors, err))) {
        rc = SPL_E_NOMEM;
        goto done;
    }
    struct opening opening = {.catalog = catalog, .verify = verify, .errors = errors};
    spl_parallel_for(0, catalog->count, 1, open_range, &opening);
    for (size_t i = 0; !rc && i < catalog->count; i++)
        if ((rc = errors[i].code) && err && err->code == SPL_OK)
            *err = errors[i];
    if (rc)
        goto done;
    qsort(catalog->entries, catalog->count, sizeof *catalog->entries, by_id);
    for (size_t i = 1; !rc && i < catalog->count; i++)
        if (!by_id(&catalog->entries[i - 1], &catalog->entries[i]))
            rc = spl_fail(err, SPL_E_USAGE, "two datasets are called '%.100s': '%.150s' and '%.150s'; rename one",
                          catalog->entries[i].info->id, catalog->entries[i - 1].path, catalog->entries[i].path);
done:
    free(errors);
    if (rc)
        spl_catalog_finish(catalog);
    return rc;
}

void spl_catalog_finish(struct spl_catalog *catalog)
{
    for (size_t i = 0; i < catalog->count; i++) {
        spl_plan_destroy(catalog->entries[i].plan);
        spl_dataset_close(catalog->entries[i].dataset);
        free(catalog->entries[i].path);
    }
    free(catalog->entries);
    *catalog = (struct spl_catalog){0};
}

const struct spl_catalog_entry *spl_catalog_find(const struct spl_catalog *catalog, const char *id)
{
    for (size_t low = 0, high = catalog->count; low < high;) {
        size_t middle = (low + high) / 2;
        int order = strcmp(id, catalog->entries[middle].info->id);
        if (!order)
            return &catalog->entries[middle];
        if (order < 0)
            high = middle;
        else
            low = middle + 1;
    }
    return NULL;
}
