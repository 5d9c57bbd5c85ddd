/* JSON to the values of camera_params.def, and the keys of a view's object.
 *
 * Unknown keys, keys given twice (at the top and in "camera") and wrong types are refused by name. Invariant: a value
 * that passed spl_value_check() holds only finite numbers, as many as its kind asks for, whole ones for counts. The
 * document stays the caller's. Pure functions, any thread. */
#include "geom/camera_json.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <strings.h>

#include "base/near_name.h"
#include "geom/camera_matrix.h"

static const struct {
    const char *name;
    enum spl_value_kind kind;
    unsigned places; /* of enum spl_value_place */
} params[SPL_CAMERA_PARAMS] = {
#define PARAM(name, alias, kind, places, help) {#name, SPL_KIND_##kind, places},
#include "geom/camera_params.def"
#undef PARAM
};

enum { NAMES_SIZE = 400 }; /* of a list in a message */

int spl_value_claim(struct spl_value *value, const char *name, struct spl_error *err)
{
    if (value->given)
        return spl_fail_field(err, SPL_E_INPUT, name, "'%s' is given twice%s%s", name,
                              value->source ? ", also by " : "", value->source ? value->source : "");
    value->given = true;
    return 0;
}

void spl_kind_get_count(enum spl_value_kind kind, unsigned *least, unsigned *most)
{
    static const unsigned counts[SPL_KIND_END] = {
        [SPL_KIND_NUMBER] = 1,     [SPL_KIND_COUNT] = 1,   [SPL_KIND_VECTOR] = 3,
        [SPL_KIND_QUATERNION] = 4, [SPL_KIND_MATRIX] = 16, [SPL_KIND_NUMBERS] = SPL_VALUE_NUMBERS,
    };
    *most = kind < SPL_KIND_END ? counts[kind] : 0;
    *least = kind == SPL_KIND_NUMBERS ? 1 : *most;
}

int spl_value_check(const struct spl_value *value, enum spl_value_kind kind, const char *name, struct spl_error *err)
{
    unsigned least, most;
    spl_kind_get_count(kind, &least, &most);
    if (value->count < least || value->count > most)
        return spl_fail_field(err, SPL_E_INPUT, name, "%s needs %u number%s, not %u", name, most, most > 1 ? "s" : "",
                              value->count);
    for (unsigned i = 0; i < value->count; i++)
        if (!isfinite(value->n[i]))
            return spl_fail_field(err, SPL_E_INPUT, name, "%s must be finite, not %g", name, value->n[i]);
    double n = value->n[0];
    if (kind == SPL_KIND_COUNT && (n < 0 || n > 1e15 || n != floor(n)))
        return spl_fail_field(err, SPL_E_INPUT, name, "%s must be a whole number from 0 on, not %g", name, n);
    return 0;
}

static int axes_from_name(const char *name)
{
    return !strcmp(name, "opencv") ? SPL_AXES_OPENCV : !strcmp(name, "opengl") ? SPL_AXES_OPENGL : -1;
}

/* EPSG:N alone, since longer texts can name files where they are understood. OGC:CRS84 is EPSG:4326 in the order in
 * which all are taken here. */
static int crs_from_text(struct spl_value *value, const char *name, const char *text, struct spl_error *err)
{
    bool epsg = !strncasecmp(text, "EPSG:", 5);
    size_t digits = epsg ? strspn(text + 5, "0123456789") : 0;
    if (digits && digits <= 6 && text[5] != '0' && !text[5 + digits])
        value->n[0] = atoi(text + 5);
    else if (!strcasecmp(text, "OGC:CRS84"))
        value->n[0] = 4326;
    else
        return spl_fail_field(err, SPL_E_INPUT, name,
                              "%s '%.32s' is none that is taken; write EPSG:N, as EPSG:4326, or OGC:CRS84", name, text);
    return 0;
}

int spl_value_from_choice(struct spl_value *value, enum spl_value_kind kind, const char *name, const char *text,
                          struct spl_error *err)
{
    if (kind == SPL_KIND_CRS)
        return crs_from_text(value, name, text, err);
    bool axes = kind == SPL_KIND_AXES, projection = kind == SPL_KIND_PROJECTION;
    int choice = axes         ? axes_from_name(text)
                 : projection ? spl_projection_from_name(text)
                              : spl_colmap_model_from_name(text);
    if (choice < 0)
        return spl_fail_field(err, SPL_E_INPUT, name, "%s '%.32s' is unknown; known are %s", name, text,
                              axes         ? "opengl, opencv"
                              : projection ? "perspective, orthographic, equirectangular, cube, fisheye"
                                           : spl_colmap_model_names);
    value->n[0] = choice;
    return 0;
}

static int number_from_json(struct spl_value *value, const json_t *json, const char *name, struct spl_error *err)
{
    if (!json_is_number(json))
        return spl_fail_field(err, SPL_E_INPUT, name, "%s must hold numbers, not %s", name, spl_json_type_name(json));
    if (value->count < SPL_VALUE_NUMBERS)
        value->n[value->count] = json_number_value(json) + 0.0; /* no -0, as in text */
    value->count++;
    return 0;
}

int spl_value_from_json(struct spl_value *value, enum spl_value_kind kind, const json_t *json, const char *name,
                        struct spl_error *err)
{
    unsigned least, most;
    spl_kind_get_count(kind, &least, &most);
    if (!most && !json_is_string(json))
        return spl_fail_field(err, SPL_E_INPUT, name, "%s must be text, not %s", name, spl_json_type_name(json));
    if (!most)
        return spl_value_from_choice(value, kind, name, json_string_value(json), err);
    int rc = 0;
    if (kind == SPL_KIND_MATRIX) {
        value->count = 16;
        rc = spl_json_get_matrix(json, name, 4, 4, SPL_ROW_MAJOR, value->n, err);
    } else if (most == 1) {
        rc = number_from_json(value, json, name, err);
    } else if (!json_is_array(json)) {
        return spl_fail_field(err, SPL_E_INPUT, name, "%s must be an array of numbers, not %s", name,
                              spl_json_type_name(json));
    } else {
        for (size_t i = 0; !rc && i < json_array_size(json); i++)
            rc = number_from_json(value, json_array_get(json, i), name, err);
    }
    return rc ? rc : spl_value_check(value, kind, name, err);
}

void spl_camera_locate(const json_t *view, struct spl_error *why)
{
    char field[sizeof why->field], member[sizeof why->field];
    snprintf(member, sizeof member, "%.*s", (int)strcspn(why->field, "."), why->field);
    bool inside = json_object_get(json_object_get(view, "camera"), member) && !json_object_get(view, member);
    if (inside && (size_t)snprintf(field, sizeof field, "camera.%s", why->field) < sizeof field)
        strcpy(why->field, field);
}

static void add_name(char known[NAMES_SIZE], const char *name)
{
    const size_t length = strlen(known);
    if (length + strlen(name) + sizeof ", , …" <= NAMES_SIZE)
        snprintf(known + length, NAMES_SIZE - length, "%s%s", length ? ", " : "", name);
    else if (!strstr(known, "…"))
        snprintf(known + length, NAMES_SIZE - length, ", …");
}

const char *spl_camera_find_ours(const char *name)
{
    static const char *const words[][2] = {{"position", "eye"},  {"lookat", "target"}, {"look_at", "target"},
                                           {"center", "target"}, {"fovy", "fov"},      {"vfov", "fov"}};
    for (size_t i = 0; i < sizeof words / sizeof *words; i++)
        if (!strcasecmp(name, words[i][0]))
            return words[i][1];
    return NULL;
}

static int find(const char *name, enum spl_value_place place, const char *const *others, struct spl_error *err)
{
    bool of_camera = false;
    for (int i = 0; i < SPL_CAMERA_PARAMS; i++) {
        if (!strcmp(name, params[i].name) && (params[i].places & place))
            return i;
        of_camera |= !strcmp(name, params[i].name);
    }
    char known[NAMES_SIZE] = "";
    for (; *others; others++)
        add_name(known, *others);
    if (of_camera)
        return spl_fail_field(err, SPL_E_INPUT, name, "'%s' belongs into the \"camera\" object; known beside it are %s",
                              name, known);
    struct spl_near_name near = spl_near_name_of(name);
    for (int i = 0; i < SPL_CAMERA_PARAMS; i++)
        if (params[i].places & place) {
            add_name(known, params[i].name);
            spl_near_name_offer(&near, params[i].name);
        }
    const char *ours = place == SPL_CAMERA ? spl_camera_find_ours(name) : NULL;
    char meant[SPL_NEAR_NAME_TEXT_MAX];
    return spl_fail_field(err, SPL_E_INPUT, name, "unknown field '%.60s' of a %s%s%s; %sknown are %s", name,
                          place == SPL_CAMERA ? "camera" : "view", ours ? ": it is called " : "", ours ? ours : "",
                          ours ? "" : spl_near_name_say(&near, meant), known);
}

static bool among(const char *name, const char *const *names)
{
    while (*names && strcmp(*names, name))
        names++;
    return *names != NULL;
}

static int collect(struct spl_value values[SPL_CAMERA_PARAMS], json_t *object, enum spl_value_place place,
                   const char *const *others, struct spl_error *err)
{
    const char *name;
    json_t *json;
    json_object_foreach(object, name, json)
    {
        int param, rc;
        if (among(name, others))
            continue;
        if ((param = find(name, place, others, err)) < 0)
            return param;
        if ((rc = spl_value_claim(&values[param], name, err)) ||
            (rc = params[param].kind == SPL_KIND_FORM
                      ? spl_camera_form_from_json(values, (enum spl_camera_param)param, json, err)
                      : spl_value_from_json(&values[param], params[param].kind, json, name, err)))
            return rc;
    }
    return 0;
}

int spl_camera_from_json(json_t *view, const char *const *others, const struct spl_camera_defaults *defaults,
                         const struct spl_camera_limits *limits, struct spl_camera *camera, struct spl_error *err)
{
    static const char *const none[] = {NULL};
    struct spl_value values[SPL_CAMERA_PARAMS] = {0};
    json_t *object = json_object_get(view, "camera");
    if (!json_is_object(view))
        return spl_fail_field(err, SPL_E_INPUT, "views", "a view must be an object, not %s", spl_json_type_name(view));
    if (!json_is_object(object))
        return spl_fail_field(err, SPL_E_INPUT, "camera", "camera must be an object, not %s",
                              spl_json_type_name(object));
    int rc = collect(values, view, SPL_BODY, others, err);
    if (!rc)
        rc = collect(values, object, SPL_CAMERA, none, err);
    return rc ? rc : spl_camera_from_values(values, defaults, limits, camera, err);
}
