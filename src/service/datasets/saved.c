/* A mutex for the list, since tours read requests on threads of the pool. The file is a JSON object with "views", small
 * enough to be written whole. */
#include "service/datasets/saved.h"

#include <errno.h>
#include <pthread.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>

#include "base/log.h"
#include "base/memory.h"
#include "dataset/saved_views.h"
#include "geom/json.h"

enum { file_bytes_max = 1 << 20 };

struct spl_saved {
    struct spl_camera_names names; /* first: what find() is called with */
    const struct spl_dataset_info *info;
    char *path;
    bool broken;  /* the file is there, and nobody knows what it says */
    bool changed; /* since it was read */
    pthread_mutex_t mutex;
    uint32_t count;                                   // guarded by: mutex
    struct spl_saved_view views[SPL_SAVED_VIEWS_MAX]; // guarded by: mutex
};

/* Those of clients first. The mutex is held. */
static const struct spl_saved_view *look(const struct spl_saved *saved, const char *name)
{
    const struct spl_saved_view *view = spl_saved_views_find(saved->views, saved->count, name);
    return view ? view : spl_saved_views_find(saved->info->views, saved->info->view_count, name);
}

static int find(const struct spl_camera_names *names, const char *name, struct spl_camera_defaults *out,
                struct spl_error *err)
{
    struct spl_saved *saved = (struct spl_saved *)(uintptr_t)names;
    pthread_mutex_lock(&saved->mutex);
    const struct spl_saved_view *view = look(saved, name);
    if (view) {
        memcpy(out->eye, view->eye, sizeof out->eye);
        memcpy(out->target, view->target, sizeof out->target);
        memcpy(out->up, view->up, sizeof out->up);
        memcpy(out->settings, view->settings, sizeof out->settings);
        out->fov = out->fit[0] = out->fit[1] = view->fov;
        out->view_height = view->view_height;
    }
    pthread_mutex_unlock(&saved->mutex);
    return view ? SPL_OK
                : spl_fail_field(err, SPL_E_INPUT, "view", "dataset '%s' has no view '%s'; its description lists them",
                                 saved->info->id, name);
}

char *spl_saved_path(const char *dataset_path, struct spl_error *err)
{
    size_t length = strlen(dataset_path);
    bool ends = length > 5 && !strcmp(dataset_path + length - 5, ".spld");
    char *path = NULL;
    if (asprintf(&path, "%.*s" SPL_SAVED_ENDING, (int)(ends ? length - 5 : length), dataset_path) < 0) {
        spl_fail(err, SPL_E_NOMEM, "out of memory for the path of a dataset's views");
        return NULL;
    }
    return path;
}

static int parse_file(struct spl_saved *saved, struct spl_error *err)
{
    json_error_t where;
    struct stat status;
    if (stat(saved->path, &status))
        return errno == ENOENT && lstat(saved->path, &status) // no link that leads nowhere either
                   ? SPL_OK
                   : spl_fail(err, SPL_E_CORRUPT, "it cannot be opened");
    if (!S_ISREG(status.st_mode) || status.st_size > file_bytes_max)
        return spl_fail(err, SPL_E_CORRUPT, "it is no file of at most %d bytes", file_bytes_max);
    json_t *json = spl_json_load_file(saved->path, &where);
    if (!json)
        return spl_fail(err, SPL_E_CORRUPT, "%s in line %d", where.text, where.line);
    int rc = spl_saved_views_from_json(json_object_get(json, "views"), saved->info->default_up, saved->views,
                                       &saved->count, err);
    json_decref(json);
    return rc;
}

int spl_saved_create(const char *place, const struct spl_dataset_info *info, struct spl_saved **out,
                     struct spl_error *err)
{
    struct spl_saved *saved = *out = spl_alloc(1, sizeof *saved, err);
    struct spl_error why = {0};
    if (!saved || !(saved->path = spl_saved_path(place, err))) {
        free(saved);
        *out = NULL;
        return SPL_E_NOMEM;
    }
    pthread_mutex_init(&saved->mutex, NULL);
    saved->names.find = find;
    saved->info = info;
    if (parse_file(saved, &why)) {
        spl_log_warn("views of dataset %s: %s is left out: %s", info->id,
                     strrchr(saved->path, '/') ? strrchr(saved->path, '/') + 1 : saved->path, why.message);
        saved->broken = true;
        saved->count = 0;
    }
    return SPL_OK;
}

void spl_saved_destroy(struct spl_saved *saved)
{
    if (!saved)
        return;
    pthread_mutex_destroy(&saved->mutex);
    free(saved->path);
    free(saved);
}

const struct spl_camera_names *spl_saved_get_names(const struct spl_saved *saved)
{
    return &saved->names;
}

const char *spl_saved_get_path(const struct spl_saved *saved)
{
    return saved->path;
}

bool spl_saved_has(struct spl_saved *saved, const char *name, bool *of_service)
{
    pthread_mutex_lock(&saved->mutex);
    *of_service = spl_saved_views_find(saved->views, saved->count, name) != NULL;
    bool has = look(saved, name) != NULL;
    pthread_mutex_unlock(&saved->mutex);
    return has;
}

static int compare_names(const void *a, const void *b)
{
    const struct spl_saved_view *const *p = a, *const *q = b;
    return strcmp((*p)->name, (*q)->name);
}

json_t *spl_saved_describe(struct spl_saved *saved)
{
    const struct spl_dataset_info *info = saved->info;
    const struct spl_saved_view *all[2 * SPL_SAVED_VIEWS_MAX];
    size_t count = 0;
    json_t *list = json_array();
    pthread_mutex_lock(&saved->mutex);
    for (uint32_t i = 0; i < saved->count; i++)
        all[count++] = &saved->views[i];
    for (uint32_t i = 0; i < info->view_count; i++)
        if (!spl_saved_views_find(saved->views, saved->count, info->views[i].name))
            all[count++] = &info->views[i];
    if (count)
        qsort(all, count, sizeof *all, compare_names);
    for (size_t i = 0; i < count; i++) {
        bool own = all[i] >= saved->views && all[i] < saved->views + SPL_SAVED_VIEWS_MAX;
        json_t *view = spl_saved_view_to_json(all[i]);
        json_object_set_new(view, "from", json_string(own ? "service" : "dataset"));
        json_array_append_new(list, view);
    }
    pthread_mutex_unlock(&saved->mutex);
    return list;
}

/* Puts `view` into the list, or takes `name` out. The list has room. */
static void change(struct spl_saved_view *views, uint32_t *count, const char *name, const struct spl_saved_view *view)
{
    uint32_t kept = 0;
    for (uint32_t i = 0; i < *count; i++)
        if (strcmp(views[i].name, name))
            views[kept++] = views[i];
    if (view)
        views[kept++] = *view;
    *count = kept;
    spl_saved_views_sort(views, kept);
}

int spl_saved_prepare(struct spl_saved *saved, const char *name, const struct spl_saved_view *view, char **text,
                      struct spl_error *err)
{
    struct spl_saved_view views[SPL_SAVED_VIEWS_MAX];
    *text = NULL;
    if (saved->broken)
        return spl_fail(
            err, SPL_E_CORRUPT,
            "the file of the dataset's views cannot be read, and is not written over; its operator mends or "
            "removes it, and starts the service again");
    pthread_mutex_lock(&saved->mutex);
    uint32_t count = saved->count;
    memcpy(views, saved->views, sizeof views);
    pthread_mutex_unlock(&saved->mutex);
    if (view && count == SPL_SAVED_VIEWS_MAX && !spl_saved_views_find(views, count, name))
        return spl_fail_field(err, SPL_E_LIMIT, "name", "the dataset has %d saved views, as many as it may",
                              SPL_SAVED_VIEWS_MAX);
    change(views, &count, name, view);
    *text = spl_json_print(json_pack("{s:o}", "views", spl_saved_views_to_json(views, count)));
    return *text ? SPL_OK : spl_fail(err, SPL_E_NOMEM, "out of memory for the dataset's views");
}

void spl_saved_apply(struct spl_saved *saved, const char *name, const struct spl_saved_view *view)
{
    pthread_mutex_lock(&saved->mutex);
    if (!view || saved->count < SPL_SAVED_VIEWS_MAX || spl_saved_views_find(saved->views, saved->count, name))
        change(saved->views, &saved->count, name, view);
    saved->changed = true;
    pthread_mutex_unlock(&saved->mutex);
}

void spl_saved_inherit(struct spl_saved *saved, struct spl_saved *before)
{
    pthread_mutex_lock(&before->mutex);
    uint32_t count = before->count;
    struct spl_saved_view views[SPL_SAVED_VIEWS_MAX];
    memcpy(views, before->views, sizeof views);
    bool changed = before->changed;
    pthread_mutex_unlock(&before->mutex);
    if (!changed)
        return;
    pthread_mutex_lock(&saved->mutex);
    memcpy(saved->views, views, sizeof views);
    saved->count = count;
    saved->changed = true;
    pthread_mutex_unlock(&saved->mutex);
}
