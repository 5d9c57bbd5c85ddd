/* Which pictures belong to scans, and what can be said against them before anything is packed: poses by the readers of
 * lists, headers of image files here. A panorama's header is read once for all its faces. Any thread; no state. */
#include "pack/maps/pictures.h"

#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>

#include "base/array.h"
#include "base/memory.h"
#include "pack/texture/photo_image.h"

static const char beside[] = "panoramas";

/* Takes `path`, which may be NULL for want of memory. */
static int add_source(struct spl_map_sources *sources, char *path, struct spl_error *err)
{
    for (size_t i = 0; path && i < sources->count; i++)
        if (!strcmp(sources->paths[i], path)) {
            free(path);
            return SPL_OK;
        }
    if (!path || spl_array_reserve(sources->paths, sources->capacity, sources->count + 1, err)) {
        free(path);
        return spl_fail(err, SPL_E_NOMEM, "out of memory for the path of panoramas");
    }
    sources->paths[sources->count++] = path;
    return SPL_OK;
}

int spl_map_sources_find(const char *const *scans, size_t count, struct spl_map_sources *out, struct spl_error *err)
{
    int rc = SPL_OK;
    *out = (struct spl_map_sources){0};
    for (size_t i = 0; i < count && !rc; i++) {
        const char *slash = strrchr(scans[i], '/');
        int folder = slash ? (int)(slash + 1 - scans[i]) : 0;
        size_t length = (size_t)folder + sizeof beside;
        struct stat status;
        if (spl_panoramas_are_inside(scans[i])) {
            rc = add_source(out, strdup(scans[i]), err);
            continue;
        }
        char *path = spl_alloc_raw(length + sizeof "/panoramas.json", 1, err);
        if (!path)
            return SPL_E_NOMEM;
        snprintf(path, length + sizeof "/panoramas.json", "%.*s%s/panoramas.json", folder, scans[i], beside);
        bool there = !stat(path, &status) && S_ISREG(status.st_mode);
        path[length - 1] = 0;
        if (there)
            rc = add_source(out, path, err);
        else
            free(path);
    }
    return rc;
}

void spl_map_sources_finish(struct spl_map_sources *sources)
{
    for (size_t i = 0; i < sources->count; i++)
        free(sources->paths[i]);
    free(sources->paths);
    *sources = (struct spl_map_sources){0};
}

static int check_header(const struct spl_named_view *view, struct spl_error *err)
{
    struct spl_image_info info;
    if (!view->photograph)
        return SPL_OK; /* the place of a station alone */
    int rc = spl_photo_image_get_info(view, &info, err);
    if (!rc && (info.width != view->camera.width || info.height != view->camera.height))
        rc = spl_fail_field(err, SPL_E_INPUT, "width", "%s: %u x %u pixels; its camera says %u x %u", view->photograph,
                            info.width, info.height, view->camera.width, view->camera.height);
    return rc;
}

/* Leaves out what check_header() refuses; faces of one panorama lie beside each other, and are one picture. */
static int check_headers(const struct spl_map_picture_options *options, struct spl_view_list *list,
                         struct spl_error *err)
{
    size_t kept = 0, next;
    int rc = SPL_OK;
    for (size_t i = 0; i < list->count && !rc; i = next) {
        struct spl_error why = {0};
        const struct spl_named_view *first = &list->views[i];
        bool cut = first->inner && first->inner->is_panorama;
        for (next = i + 1; cut && next < list->count && list->views[next].panorama == first->panorama; next++)
            ;
        if ((rc = check_header(first, &why)) && options->refuse && rc != SPL_E_NOMEM) {
            options->refuse(options->context, &why);
            rc = SPL_OK;
            continue;
        }
        if (rc)
            return spl_fail_field(err, rc, why.field, "%s", why.message);
        for (size_t k = i; k < next; k++) {
            struct spl_named_view view = list->views[k];
            list->views[k] = list->views[kept];
            list->views[kept++] = view;
        }
    }
    spl_view_list_cut(list, kept);
    return rc;
}

int spl_map_pictures_load(const struct spl_map_picture_options *options, struct spl_view_list *list,
                          struct spl_error *err)
{
    const struct spl_photograph_options how = {
        .images = options->images,
        .get_size = spl_image_get_size,
        .refuse = options->refuse,
        .context = options->context,
    };
    int rc = SPL_OK;
    *list = (struct spl_view_list){0};
    for (size_t i = 0; i < options->count && !rc; i++) {
        struct spl_view_list part;
        struct spl_error why = {0};
        if (!(rc = spl_panoramas_load(&part, options->paths[i], &how, &why)) &&
            !(rc = check_headers(options, &part, &why)))
            rc = spl_view_list_append(list, &part, &why);
        spl_view_list_finish(&part);
        if (rc && rc != SPL_E_NOMEM && options->refuse && options->count > 1) {
            options->refuse(options->context, &why);
            rc = SPL_OK;
        }
        if (rc)
            spl_fail_field(err, rc, why.field, "%s", why.message);
    }
    if (!rc && !list->count)
        rc = spl_fail_field(err, SPL_E_INPUT, "panoramas", "%s: none of its pictures can be used", options->paths[0]);
    if (rc)
        spl_view_list_finish(list);
    return rc;
}

bool spl_map_is_same_picture(const struct spl_named_view *a, const struct spl_named_view *b)
{
    return a && a->inner && a->inner->is_panorama && b && b->inner && b->inner->is_panorama &&
           a->inner->at == b->inner->at && !strcmp(a->inner->path, b->inner->path) && a->panorama == b->panorama;
}
