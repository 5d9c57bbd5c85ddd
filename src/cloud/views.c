/* The list of views, and which reader a file or a folder belongs to.
 *
 * Names become parts of file names (DIR/truth/NAME.color.png), so that they are checked here, once, for every reader:
 * nothing that reaches a caller can leave a folder or hide a file. Duplicates are found by sorting when the list is
 * complete, so that a long one costs n log n. Any thread; no state. */
#include "cloud/views.h"

#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>

#include "base/array.h"
#include "base/memory.h"
#include "cloud/view_list.h"

const struct spl_camera_limits spl_view_list_limits = {.side_px = 65535, .pixels = 64 << 20};

char *spl_view_list_print(struct spl_error *err, const char *format, ...)
{
    va_list args, again;
    va_start(args, format);
    va_copy(again, args);
    int length = vsnprintf(NULL, 0, format, args);
    va_end(args);
    char *text = length < 0 ? NULL : spl_alloc_raw((size_t)length + 1, 1, err);
    if (text)
        vsnprintf(text, (size_t)length + 1, format, again);
    va_end(again);
    return text;
}

static bool name_fits(const char *name)
{
    size_t length = strlen(name);
    bool fits = length > 0 && length <= SPL_VIEW_NAME_MAX && name[0] != '.' && !strchr(name, '/');
    for (const char *c = name; fits && *c; c++)
        fits = (unsigned char)*c >= 0x20 && *c != 0x7f;
    return fits;
}

int spl_view_list_add(struct spl_view_list *list, const char *path, const char *name, const struct spl_camera *camera,
                      const char *photograph, struct spl_error *err)
{
    if (!name_fits(name))
        return spl_fail_field(
            err, SPL_E_INPUT, "name",
            "%s: name '%.100s' does not do as a part of a file name: 1 to %d bytes, no '/', no control "
            "character, no '.' in front",
            path, name, SPL_VIEW_NAME_MAX);
    if (list->count == SPL_VIEW_LIST_MAX)
        return spl_fail_field(err, SPL_E_LIMIT, "views", "%s: more than %d views", path, SPL_VIEW_LIST_MAX);
    if (spl_array_reserve(list->views, list->capacity, list->count + 1, err))
        return SPL_E_NOMEM;
    struct spl_named_view *view = &list->views[list->count];
    *view = (struct spl_named_view){.camera = *camera};
    list->count++;
    view->name = spl_view_list_print(err, "%s", name);
    if (photograph)
        view->photograph = spl_view_list_print(err, "%s", photograph);
    return view->name && (!photograph || view->photograph) ? SPL_OK : SPL_E_NOMEM;
}

static int by_name(const void *a, const void *b)
{
    return strcmp(*(char *const *)a, *(char *const *)b);
}

static int check_names(const struct spl_view_list *list, const char *path, struct spl_error *err)
{
    const char **names = spl_alloc_raw(list->count, sizeof *names, err);
    int rc = names ? SPL_OK : SPL_E_NOMEM;
    for (size_t i = 0; !rc && i < list->count; i++)
        names[i] = list->views[i].name;
    if (!rc)
        qsort(names, list->count, sizeof *names, by_name);
    for (size_t i = 1; !rc && i < list->count; i++)
        if (!strcmp(names[i - 1], names[i]))
            rc = spl_fail_field(err, SPL_E_INPUT, "name", "%s: two views are called '%s'", path, names[i]);
    free(names);
    return rc;
}

int spl_view_list_refuse(const struct spl_photograph_options *photographs, int rc, const struct spl_error *why,
                         struct spl_error *err)
{
    if (!rc || !photographs || !photographs->refuse || rc == SPL_E_NOMEM)
        return rc ? spl_fail_field(err, rc, why->field, "%s", why->message) : SPL_OK;
    photographs->refuse(photographs->context, why);
    return SPL_OK;
}

bool spl_view_list_is_file(const char *path)
{
    struct stat status;
    return !stat(path, &status) && S_ISREG(status.st_mode);
}

char *spl_view_list_find(const char *folder, const char *name, const struct spl_photograph_options *photographs,
                         struct spl_error *err)
{
    static const char *const places[] = {"images/", "../images/", "../../images/", ""};
    const char *images = photographs ? photographs->images : NULL, *last = strrchr(name, '/');
    char *path = NULL;
    for (int i = 0; images && i < 2; i++) {
        free(path);
        path = spl_view_list_print(err, "%s/%s", images, i && last ? last + 1 : name);
        if (!path || spl_view_list_is_file(path))
            return path;
    }
    free(path);
    for (int i = 0; i < 4 && !images; i++) {
        path = spl_view_list_print(err, "%s/%s%s", folder, places[i], name);
        if (!path || spl_view_list_is_file(path))
            return path;
        free(path);
    }
    return spl_view_list_print(err, "%s/%s%s", images ? images : folder, images ? "" : places[0], name);
}

int spl_view_list_add_image(struct spl_view_list *list, const char *path, const char *name,
                            const struct spl_camera *camera, const struct spl_distortion *distortion,
                            const char *folder, const struct spl_photograph_options *photographs, struct spl_error *err)
{
    char *photograph = NULL, *view = NULL;
    int rc = SPL_E_NOMEM;
    while (!strncmp(name, "./", 2))
        name += 2;
    if ((folder && !(photograph = spl_view_list_find(folder, name, photographs, err))) ||
        !(view = spl_view_list_print(err, "%s", name)))
        goto done;
    char *dot = strrchr(view, '.'), *slash = strrchr(view, '/');
    if (dot && dot > (slash ? slash + 1 : view))
        *dot = 0;
    for (char *c = view; *c; c++)
        *c = *c == '/' ? '_' : *c;
    rc = spl_view_list_add(list, path, view, camera, photograph, err);
    if (!rc && distortion)
        list->views[list->count - 1].distortion = *distortion;
done:
    free(photograph);
    free(view);
    return rc;
}

static bool has(const char *folder, const char *name)
{
    char path[4096];
    return snprintf(path, sizeof path, "%s/%s", folder, name) < (int)sizeof path && spl_view_list_is_file(path);
}

/* A COLMAP project keeps its models in sparse/0, sparse/1, …; whoever names a folder above means the first. */
static int load_text_model(struct spl_view_list *list, const char *path,
                           const struct spl_photograph_options *photographs, struct spl_error *err)
{
    static const char *const below[] = {"0", "sparse/0", "sparse"}, *const parts[] = {"cameras.bin", "cameras.txt"};
    char inner[64];
    for (int i = 0; i < 6 && !has(path, "cameras.txt"); i++) {
        snprintf(inner, sizeof inner, "%s/%s", below[i / 2], parts[i % 2]);
        if (has(path, inner))
            return spl_fail(err, SPL_E_NOT_FOUND, "%.200s: no cameras.txt or cameras.bin; did you mean '%.200s/%s'?",
                            path, path, below[i / 2]);
    }
    return spl_view_list_load_colmap(list, path, photographs, err);
}

static int load_panoramas(struct spl_view_list *list, const char *folder,
                          const struct spl_photograph_options *photographs, struct spl_error *err)
{
    char *path = spl_view_list_print(err, "%s/panoramas.json", folder);
    int rc = path ? spl_view_list_load_json(list, path, photographs, err) : SPL_E_NOMEM;
    free(path);
    return rc;
}

static int load(struct spl_view_list *list, const char *path, const struct spl_photograph_options *photographs,
                struct spl_error *err)
{
    struct stat status;
    if (stat(path, &status) || !S_ISDIR(status.st_mode))
        return spl_view_list_is_e57(path) ? spl_view_list_load_e57(list, path, photographs, err)
                                          : spl_view_list_load_json(list, path, photographs, err);
    if (has(path, "panoramas.json"))
        return load_panoramas(list, path, photographs, err);
    if (has(path, "cameras.bin"))
        return spl_view_list_load_colmap_bin(list, path, photographs, err);
    if (has(path, "camera-intrinsics.txt"))
        return spl_view_list_load_poses(list, path, photographs, err);
    return load_text_model(list, path, photographs, err);
}

int spl_view_list_load_photographs(struct spl_view_list *list, const char *path,
                                   const struct spl_photograph_options *options, struct spl_error *err)
{
    const char *images = options ? options->images : NULL;
    struct stat status;
    *list = (struct spl_view_list){0};
    if (images && (stat(images, &status) || !S_ISDIR(status.st_mode)))
        return spl_fail_field(err, SPL_E_NOT_FOUND, "images", "--images '%.200s' is no folder", images);
    int rc = load(list, path, options, err);
    if (!rc && !list->count)
        rc = spl_fail_field(err, SPL_E_INPUT, "views", "%s holds no view", path);
    if (!rc)
        rc = check_names(list, path, err);
    if (rc)
        spl_view_list_finish(list);
    return rc;
}

int spl_panoramas_load(struct spl_view_list *list, const char *path, const struct spl_photograph_options *options,
                       struct spl_error *err)
{
    char *below = spl_view_list_print(err, "%s/panoramas", path);
    struct stat status;
    *list = (struct spl_view_list){0};
    if (!below)
        return SPL_E_NOMEM;
    bool folder = !stat(path, &status) && S_ISDIR(status.st_mode);
    static const char *const models[] = {"panoramas.json", "cameras.bin", "cameras.txt", "camera-intrinsics.txt",
                                         "sparse/0/cameras.bin", "sparse/0/cameras.txt", "sparse/cameras.bin",
                                         "sparse/cameras.txt", "0/cameras.bin", "0/cameras.txt"};
    bool known = !folder;
    for (size_t i = 0; i < sizeof models / sizeof *models; i++)
        known |= has(path, models[i]);
    int rc = has(below, "panoramas.json") && !has(path, "panoramas.json")
                 ? spl_view_list_load_photographs(list, below, options, err)
             : known ? spl_view_list_load_photographs(list, path, options, err)
                     : spl_fail(err, SPL_E_NOT_FOUND,
                                "%s: holds no panoramas.json, which says where each image was taken "
                                "(api/panoramas.md has one to start from), and no COLMAP model",
                                path);
    free(below);
    return rc;
}

int spl_view_list_load(struct spl_view_list *list, const char *path, struct spl_error *err)
{
    return spl_view_list_load_photographs(list, path, NULL, err);
}

int spl_view_list_append(struct spl_view_list *list, struct spl_view_list *more, struct spl_error *err)
{
    uint32_t panoramas = 0;
    if (more->count > SPL_VIEW_LIST_MAX - list->count)
        return spl_fail_field(err, SPL_E_LIMIT, "views", "more than %d views", SPL_VIEW_LIST_MAX);
    if (spl_array_reserve(list->views, list->capacity, list->count + more->count, err))
        return SPL_E_NOMEM;
    for (size_t i = 0; i < list->count; i++)
        panoramas = list->views[i].panorama > panoramas ? list->views[i].panorama : panoramas;
    for (size_t i = 0; i < more->count; i++) {
        struct spl_named_view *view = &list->views[list->count++];
        *view = more->views[i];
        view->panorama += view->panorama ? panoramas : 0;
    }
    more->count = 0;
    spl_view_list_finish(more);
    return SPL_OK;
}

void spl_view_list_cut(struct spl_view_list *list, size_t count)
{
    for (; list->count > count; list->count--) {
        const struct spl_named_view *last = &list->views[list->count - 1];
        free(last->name);
        free(last->photograph);
        spl_inner_photograph_destroy(last->inner);
    }
}

void spl_view_list_finish(struct spl_view_list *list)
{
    if (!list)
        return;
    spl_view_list_cut(list, 0);
    free(list->views);
    *list = (struct spl_view_list){0};
}
