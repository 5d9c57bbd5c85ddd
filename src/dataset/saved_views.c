/* One form for all places that keep such views: META, the file beside a dataset, requests. */
#include "dataset/saved_views.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "geom/camera_json.h"
#include "geom/json.h"
#include "geom/size.h"

bool spl_view_name_is_valid(const char *name)
{
    static const char allowed[] = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789._-";
    size_t length = strlen(name);
    return length && length < SPL_VIEW_NAME_BYTES && name[0] != '.' && strspn(name, allowed) == length;
}

int spl_saved_view_check(const struct spl_saved_view *view, bool named, struct spl_error *err)
{
    struct spl_camera camera = {0};
    const double *vectors[] = {view->eye, view->target, view->up};
    static const char *const names[] = {"eye", "target", "up"};
    if (named && (!memchr(view->name, 0, sizeof view->name) || !spl_view_name_is_valid(view->name)))
        return spl_fail_field(err, SPL_E_INPUT, "name", "'%.64s' is no name of a view: " SPL_VIEW_NAME_FORMS,
                              view->name);
    for (int v = 0; v < 3; v++)
        for (int c = 0; c < 3; c++)
            if (!(fabs(vectors[v][c]) <= SPL_CAMERA_COORDINATE_MAX))
                return spl_fail_field(err, SPL_E_INPUT, names[v], "%s holds %g; finite numbers up to 1e12 are taken",
                                      names[v], vectors[v][c]);
    if (view->settings[0]) { // a library's caller may say anything
        json_t *settings = memchr(view->settings, 0, sizeof view->settings)
                               ? json_loads(view->settings, JSON_REJECT_DUPLICATES, NULL)
                               : NULL;
        const bool good = json_is_object(settings);
        json_decref(settings);
        if (!good)
            return spl_fail_field(err, SPL_E_INPUT, "settings", "settings must be a JSON object, as text");
    }
    struct spl_error why = {0};
    int rc = spl_camera_set_fov(&camera, view->fov, 1, UINT16_MAX, &why);
    if (!rc && view->view_height != 0)
        rc = spl_camera_set_orthographic(&camera, view->view_height, 1, UINT16_MAX, &why);
    rc = rc ? rc : spl_camera_look_at(&camera, view->eye, view->target, view->up, &why);
    return rc ? spl_fail_field(err, SPL_E_INPUT, why.field, "%s", why.message) : SPL_OK;
}

static int get_vector(const json_t *json, const char *name, double out[3], struct spl_error *err)
{
    const json_t *array = json_object_get(json, name);
    if (!spl_json_get_numbers(array, 3, out))
        return spl_fail_field(err, SPL_E_INPUT, name, "%s must be an array of three numbers%s", name,
                              array ? "" : ", and is missing");
    for (int c = 0; c < 3; c++)
        out[c] += 0.0; /* no -0 */
    return SPL_OK;
}

/* As short as JSON is, keys in one order: equal settings are equal texts. */
static int get_settings(const json_t *json, struct spl_saved_view *view, struct spl_error *err)
{
    if (!json || (json_is_object(json) && !json_object_size(json)))
        return SPL_OK;
    if (!json_is_object(json))
        return spl_fail_field(err, SPL_E_INPUT, "settings", "settings must be an object of a view's parameters");
    const size_t length = json_dumpb(json, view->settings, sizeof view->settings - 1,
                                     JSON_COMPACT | JSON_SORT_KEYS | JSON_REAL_PRECISION(17));
    if (length && length < sizeof view->settings) {
        view->settings[length] = '\0';
        return SPL_OK;
    }
    view->settings[0] = '\0';
    return spl_fail_field(err, SPL_E_INPUT, "settings", "settings have %zu bytes; %d are taken", length,
                          SPL_VIEW_SETTINGS_BYTES - 1);
}

/* Parallel rays where it or a height is said; left out, it is as high as the pinhole's image is where it looks. */
static int get_height(const json_t *json, struct spl_saved_view *view, struct spl_error *err)
{
    const json_t *projection = json_object_get(json, "projection"), *height = json_object_get(json, "view_height");
    const char *name = projection ? json_string_value(projection) : height ? "orthographic" : "perspective";
    const bool flat = name && !strcmp(name, "orthographic");
    double square = 0;
    if (!flat && (!name || strcmp(name, "perspective")))
        return spl_fail_field(err, SPL_E_INPUT, "projection",
                              "a saved view's projection is perspective or orthographic");
    if (height && (!flat || !json_is_number(height) || !(json_number_value(height) > 0)))
        return spl_fail_field(err, SPL_E_INPUT, "view_height",
                              "view_height must be a number above 0, with projection orthographic");
    for (int c = 0; c < 3; c++)
        square += (view->target[c] - view->eye[c]) * (view->target[c] - view->eye[c]);
    if (flat)
        view->view_height = height ? json_number_value(height) : 2 * tan(view->fov * M_PI / 360) * sqrt(square);
    return SPL_OK;
}

int spl_saved_view_from_json(const json_t *json, const double up[3], bool named, bool strict,
                             struct spl_saved_view *view, struct spl_error *err)
{
    *view = (struct spl_saved_view){.fov = SPL_SAVED_VIEW_FOV};
    memcpy(view->up, up, sizeof view->up);
    if (!json_is_object(json))
        return spl_fail_field(err, SPL_E_INPUT, "body", "a view must be an object with eye and target");
    const char *key;
    json_t *value;
    json_object_foreach((json_t *)json, key, value)
    {
        bool known = !strcmp(key, "eye") || !strcmp(key, "target") || !strcmp(key, "up") || !strcmp(key, "fov") ||
                     !strcmp(key, "projection") || !strcmp(key, "view_height") || !strcmp(key, "settings") ||
                     (named && !strcmp(key, "name"));
        if (strict && !known)
            return spl_fail_field(
                err, SPL_E_INPUT, key,
                "unknown field '%.60s' of a saved view; known are eye, target, up, fov, projection, view_height "
                "and settings",
                key);
    }
    const json_t *fov = json_object_get(json, "fov"), *name = json_object_get(json, "name");
    if (named && (!json_is_string(name) || json_string_length(name) >= sizeof view->name))
        return spl_fail_field(err, SPL_E_INPUT, "name", "a view needs a name: " SPL_VIEW_NAME_FORMS);
    if (named)
        snprintf(view->name, sizeof view->name, "%s", json_string_value(name));
    int rc = get_vector(json, "eye", view->eye, err);
    if (!rc)
        rc = get_vector(json, "target", view->target, err);
    if (!rc && json_object_get(json, "up"))
        rc = get_vector(json, "up", view->up, err);
    if (rc)
        return rc;
    if (fov && !json_is_number(fov))
        return spl_fail_field(err, SPL_E_INPUT, "fov", "fov must be a number of degrees");
    if (fov)
        view->fov = json_number_value(fov);
    if (!(rc = get_height(json, view, err)) && view->view_height != 0 && !json_object_get(json, "up"))
        spl_camera_choose_up(up, view->eye, view->target, view->up);
    if (rc || (rc = get_settings(json_object_get(json, "settings"), view, err)))
        return rc;
    return spl_saved_view_check(view, named, err);
}

static int compare(const void *a, const void *b)
{
    return strcmp(((const struct spl_saved_view *)a)->name, ((const struct spl_saved_view *)b)->name);
}

void spl_saved_views_sort(struct spl_saved_view *views, uint32_t count)
{
    if (count)
        qsort(views, count, sizeof *views, compare);
}

const struct spl_saved_view *spl_saved_views_find(const struct spl_saved_view *views, uint32_t count, const char *name)
{
    for (uint32_t i = 0; i < count; i++)
        if (!strcmp(views[i].name, name))
            return &views[i];
    return NULL;
}

int spl_saved_views_from_json(const json_t *json, const double up[3], struct spl_saved_view *views, uint32_t *count,
                              struct spl_error *err)
{
    *count = 0;
    if (!json_is_array(json) || json_array_size(json) > SPL_SAVED_VIEWS_MAX)
        return spl_fail_field(err, SPL_E_INPUT, "views", "views must be an array of at most %d", SPL_SAVED_VIEWS_MAX);
    for (size_t i = 0; i < json_array_size(json); i++) {
        struct spl_error why = {0};
        char field[sizeof why.field + 40];
        int rc = spl_saved_view_from_json(json_array_get(json, i), up, true, false, &views[i], &why);
        if (!rc && spl_saved_views_find(views, (uint32_t)i, views[i].name))
            rc = spl_fail_field(&why, SPL_E_INPUT, "name", "'%s' is there twice", views[i].name);
        snprintf(field, sizeof field, "views[%zu].%s", i, why.field);
        if (rc)
            return spl_fail_field(err, rc, field, "view %zu: %s", i, why.message);
        *count = (uint32_t)i + 1;
    }
    spl_saved_views_sort(views, *count);
    return SPL_OK;
}

static json_t *vector(const double v[3])
{
    return json_pack("[f, f, f]", v[0], v[1], v[2]);
}

json_t *spl_saved_view_to_json(const struct spl_saved_view *view)
{
    json_t *json = json_pack("{s:s, s:o, s:o, s:o, s:f}", "name", view->name, "eye", vector(view->eye), "target",
                             vector(view->target), "up", vector(view->up), "fov", view->fov);
    if (json && view->view_height > 0 &&
        (json_object_set_new(json, "projection", json_string("orthographic")) ||
         json_object_set_new(json, "view_height", json_real(view->view_height)))) {
        json_decref(json);
        return NULL;
    }
    if (json && view->settings[0] &&
        json_object_set_new(json, "settings", json_loads(view->settings, 0, NULL))) {
        json_decref(json);
        return NULL;
    }
    return json;
}

json_t *spl_saved_views_to_json(const struct spl_saved_view *views, uint32_t count)
{
    json_t *list = json_array();
    for (uint32_t i = 0; i < count; i++)
        if (json_array_append_new(list, spl_saved_view_to_json(&views[i]))) {
            json_decref(list);
            return NULL;
        }
    return list;
}
