/* Lists of views as JSON: which reader a document belongs to, and our own format.
 *
 * Any thread; no state. */
#include <stdlib.h>
#include <string.h>

#include <jansson.h>

#include "base/memory.h"
#include "cloud/source.h"
#include "cloud/view_list.h"

enum { json_bytes_max = 64 << 20 };

/* Up to the last slash of `path`, and with it. */
static int folder_length(const char *path)
{
    const char *slash = strrchr(path, '/');
    return slash ? (int)(slash + 1 - path) : 0;
}

char *spl_view_list_find_beside(const char *path, const char *name, const struct spl_photograph_options *photographs,
                                struct spl_error *err)
{
    if (photographs && photographs->images)
        return spl_view_list_find("", name, photographs, err);
    return spl_view_list_print(err, "%.*s%s", *name == '/' ? 0 : folder_length(path), path, name);
}

static int add_own(struct spl_view_list *list, const char *path, json_t *view,
                   const struct spl_photograph_options *photographs, struct spl_error *err)
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
    if (!rc && (camera.projection != SPL_PERSPECTIVE || spl_camera_is_bent(&camera)))
        rc = spl_fail_field(&why, SPL_E_INPUT, camera.lens.kind ? "params" : "projection",
                            "a list's views are those of pinholes");
    if (rc)
        return spl_fail_field(err, rc, why.field, "%s: view %zu%s%.100s%s: %s", path, list->count + 1,
                              name ? " ('" : "", name ? json_string_value(name) : "", name ? "')" : "", why.message);
    const char *text = photograph ? json_string_value(photograph) : NULL;
    char *full = NULL;
    if (photographs && !text)
        return spl_fail_field(err, SPL_E_INPUT, "photograph", "%s: view %zu ('%.100s') has no photograph", path,
                              list->count + 1, json_string_value(name));
    if (text && !(full = spl_view_list_find_beside(path, text, photographs, err)))
        return SPL_E_NOMEM;
    rc = spl_view_list_add(list, path, json_string_value(name), &camera, full, err);
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

static int read_own(struct spl_view_list *list, const char *path, const json_t *document,
                    const struct spl_photograph_options *photographs, struct spl_error *err)
{
    json_t *views = json_object_get(document, "views");
    int rc = SPL_OK;
    if (!json_is_array(views))
        return spl_fail_field(err, SPL_E_INPUT, "views",
                              "%s: a list of views is {\"views\": [{\"name\": …, \"camera\": {…}}]}, one of panoramas "
                              "{\"panoramas\": [{\"name\": …, \"color\": …}]}; views is %s",
                              path, spl_json_type_name(views));
    for (size_t i = 0; !rc && i < json_array_size(views); i++) {
        struct spl_error why = {0};
        rc = add_own(list, path, json_array_get(views, i), photographs, &why);
        rc = spl_view_list_refuse(photographs, rc, &why, err);
    }
    return rc;
}

static bool is_image(const char *text, size_t length)
{
    return length > 8 && (!memcmp(text, "\xff\xd8\xff", 3) || !memcmp(text, "\x89PNG\r\n\x1a\n", 8));
}

static bool begins_json(const char *text, size_t length)
{
    size_t i = 0;
    while (i < length && strchr(" \t\r\n", text[i]) && text[i])
        i++;
    return i < length && (text[i] == '{' || text[i] == '[');
}

int spl_view_list_load_json(struct spl_view_list *list, const char *path,
                            const struct spl_photograph_options *photographs, struct spl_error *err)
{
    char *text = NULL;
    size_t length = 0;
    json_t *document = NULL;
    json_error_t where;
    int rc = read_all(path, &text, &length, err);
    size_t mark = spl_json_is_marked(text, length) ? SPL_JSON_MARK : 0;
    if (!rc && is_image(text, length))
        rc = spl_fail(err, SPL_E_INPUT,
                      "%s: is an image, which says no pose: name the panoramas.json that does (api/panoramas.md has "
                      "one to start from)",
                      path);
    else if (!rc && !begins_json(text + mark, length - mark))
        rc = spl_fail(err, SPL_E_INPUT,
                      "%s: is no JSON, as lists of views and panoramas are (api/photographs.md has what is read)",
                      path);
    if (rc)
        goto done;
    document = spl_json_load(text, length, &where);
    if (!document)
        rc = spl_fail(err, SPL_E_INPUT, "%s: broken JSON at line %d, column %d: %s", path, where.line, where.column,
                      spl_json_fault(&where));
    else if (json_object_get(document, "frames"))
        rc = spl_view_list_read_transforms(list, path, document, photographs, err);
    else if (json_object_get(document, "panoramas"))
        rc = spl_view_list_read_panoramas(list, path, document, photographs, err);
    else if (json_object_get(document, "parameters"))
        rc = spl_view_list_read_open3d(list, path, document, photographs, err);
    else
        rc = read_own(list, path, document, photographs, err);
done:
    json_decref(document);
    free(text);
    return rc;
}
