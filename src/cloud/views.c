/* The list of views, and its JSON.
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

#include <jansson.h>

#include "base/memory.h"
#include "cloud/source.h"
#include "cloud/view_list.h"

enum { json_bytes_max = 64 << 20 };

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
    if (!(list->count & (list->count - 1))) { /* room for the next power of two */
        struct spl_named_view *grown =
            spl_realloc(list->views, list->count ? 2 * list->count : 1, sizeof *list->views, err);
        if (!grown)
            return SPL_E_NOMEM;
        list->views = grown;
    }
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

static int add_json(struct spl_view_list *list, const char *path, json_t *view, struct spl_error *err)
{
    static const char *const others[] = {"name", "photograph", "camera", NULL};
    const json_t *name = json_object_get(view, "name"), *photograph = json_object_get(view, "photograph");
    struct spl_camera camera;
    struct spl_error why = {0};
    if (json_is_object(view) && !json_is_string(name))
        return spl_fail_field(err, SPL_E_INPUT, "name", "%s: view %zu: name must be text, not %s", path,
                              list->count + 1, spl_json_type_name(name));
    if (photograph && !json_is_string(photograph))
        return spl_fail_field(err, SPL_E_INPUT, "photograph", "%s: view %zu: photograph must be text, not %s", path,
                              list->count + 1, spl_json_type_name(photograph));
    int rc = spl_camera_from_json(view, others, NULL, &spl_view_list_limits, &camera, &why);
    if (rc)
        return spl_fail_field(err, rc, why.field, "%s: view %zu%s%.100s%s: %s", path, list->count + 1,
                              name ? " ('" : "", name ? json_string_value(name) : "", name ? "')" : "", why.message);
    const char *text = photograph ? json_string_value(photograph) : NULL, *slash = strrchr(path, '/');
    char *full = NULL;
    if (text && text[0] != '/' && slash) {
        full = spl_view_list_print(err, "%.*s/%s", (int)(slash - path), path, text);
        if (!full)
            return SPL_E_NOMEM;
        text = full;
    }
    rc = spl_view_list_add(list, path, json_string_value(name), &camera, text, err);
    free(full);
    return rc;
}

/* jansson reads streams too, but not with a limit on what it takes in. */
static int read_all(const char *path, char **text, size_t *length, struct spl_error *err)
{
    struct spl_source source;
    int rc = spl_source_open(&source, path, err);
    if (rc)
        return rc;
    if (source.size > json_bytes_max) {
        rc = spl_source_fail(&source, SPL_E_LIMIT, "", err, "%llu bytes; a list of views has at most %d",
                             (unsigned long long)source.size, json_bytes_max);
        goto done;
    }
    *text = spl_alloc_raw(source.size, 1, err);
    if (!*text) {
        rc = SPL_E_NOMEM;
        goto done;
    }
    for (*length = 0; *length < source.size;) {
        const uint8_t *bytes;
        size_t available = 0, left = source.size - *length;
        rc = spl_source_peek(&source, left < SPL_SOURCE_WINDOW ? left : SPL_SOURCE_WINDOW, &bytes, &available, err);
        if (rc < 0 || !available)
            break;
        available = available < left ? available : left;
        memcpy(*text + *length, bytes, available);
        spl_source_take(&source, available);
        *length += available;
    }
    rc = rc < 0 ? rc : SPL_OK;
done:
    spl_source_close(&source);
    return rc;
}

int spl_view_list_load_json(struct spl_view_list *list, const char *path, struct spl_error *err)
{
    char *text = NULL;
    size_t length = 0;
    json_t *document = NULL, *views;
    json_error_t where;
    int rc = read_all(path, &text, &length, err);
    if (rc)
        goto done;
    document = json_loadb(text, length, JSON_REJECT_DUPLICATES, &where);
    views = json_object_get(document, "views");
    if (!document) {
        rc = spl_fail(err, SPL_E_INPUT, "%s: broken JSON at line %d, column %d: %s", path, where.line, where.column,
                      where.text);
        goto done;
    }
    if (!json_is_array(views)) {
        rc = spl_fail_field(err, SPL_E_INPUT, "views",
                            "%s: a list of views is {\"views\": [{\"name\": …, \"camera\": {…}}]}; views is %s", path,
                            spl_json_type_name(views));
        goto done;
    }
    for (size_t i = 0; !rc && i < json_array_size(views); i++)
        rc = add_json(list, path, json_array_get(views, i), err);
done:
    json_decref(document);
    free(text);
    return rc;
}

int spl_view_list_load(struct spl_view_list *list, const char *path, struct spl_error *err)
{
    struct stat status;
    bool folder = !stat(path, &status) && S_ISDIR(status.st_mode);
    *list = (struct spl_view_list){0};
    int rc = folder ? spl_view_list_load_colmap(list, path, err) : spl_view_list_load_json(list, path, err);
    if (!rc && !list->count)
        rc = spl_fail_field(err, SPL_E_INPUT, "views", "%s holds no view", path);
    if (!rc)
        rc = check_names(list, path, err);
    if (rc)
        spl_view_list_finish(list);
    return rc;
}

void spl_view_list_finish(struct spl_view_list *list)
{
    if (!list)
        return;
    for (size_t i = 0; i < list->count; i++) {
        free(list->views[i].name);
        free(list->views[i].photograph);
    }
    free(list->views);
    *list = (struct spl_view_list){0};
}
