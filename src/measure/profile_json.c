/* Profiles as JSON. One table says what numbers a setting has, in which range, and whether they may be missing;
 * parsing, checking and writing all come from it.
 *
 * Nothing of a text is trusted: counts are bounded before anything is allocated, every number is checked. Unknown
 * members are ignored, so that later versions can add some. Any thread. */
#include "measure/profile.h"

#include <inttypes.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "base/memory.h"
#include "render/view.h"
#include "shared.h"

#define FORMAT "splatd-profile"

enum { side_max = 1 << 16, views_max = 1000000 };

static const struct number {
    const char *name;
    size_t offset;
    double least, most;
    bool optional;
} numbers[] = {
#define NUMBER(name, least, most, optional)                                                                            \
    {                                                                                                                  \
#name, offsetof(struct spl_profile_point, name), least, most, optional                                         \
    }
    NUMBER(ms, 1e-6, 1e9, false),      NUMBER(ms_q90, 1e-6, 1e9, false),
    NUMBER(fixed_ms, 0, 1e9, false),   NUMBER(ms_per_mpx, 0, 1e9, false),
    NUMBER(splats, 0, 1e15, true),     NUMBER(psnr, -SPL_PROFILE_PSNR_MAX, SPL_PROFILE_PSNR_MAX, true),
    NUMBER(psnr_sd, 0, 200, true),     NUMBER(psnr_q05, -SPL_PROFILE_PSNR_MAX, SPL_PROFILE_PSNR_MAX, true),
    NUMBER(ssim, -1, 1, true),         NUMBER(depth_rmse, 0, 1e12, true),
    NUMBER(depth_beyond, 0, 1, true),  NUMBER(holes, 0, 1, true),
    NUMBER(see_through, 0, 1, true),   NUMBER(halo, 0, 1, true),
    NUMBER(normal_mean, 0, 180, true), NUMBER(soft_ms, 0, 1e9, true),
#undef NUMBER
};
enum { number_count = sizeof numbers / sizeof *numbers };

static double number_of(const struct spl_profile_point *point, const struct number *number)
{
    return *(const double *)((const char *)point + number->offset);
}

/* Everything that parsing does not settle by itself; `name` is for messages. */
static int check_point(const struct spl_profile_point *point, const char *name, size_t index, struct spl_error *err)
{
    const struct spl_setting *s = &point->setting;
    if (!(s->lod >= 0 && s->lod <= 64))
        return spl_fail_field(err, SPL_E_INPUT, "lod", "%s: point %zu: lod %g is outside 0 to 64", name, index, s->lod);
    if (!spl_supersample_is_known(s->supersample))
        return spl_fail_field(err, SPL_E_INPUT, "supersample",
                              "%s: point %zu: supersample %g is none of " SPL_SUPERSAMPLES, name, index,
                              s->supersample);
    if (s->atoms > SPL_TEXTURE_ATOMS)
        return spl_fail_field(err, SPL_E_INPUT, "atoms", "%s: point %zu: atoms %u is above %d", name, index, s->atoms,
                              SPL_TEXTURE_ATOMS);
    for (const struct number *n = numbers; n < numbers + number_count; n++) {
        double value = number_of(point, n);
        if (isnan(value) && n->optional)
            continue;
        if (!(value >= n->least && value <= n->most))
            return spl_fail_field(err, SPL_E_INPUT, n->name, "%s: point %zu: %s %g is outside %g to %g", name, index,
                                  n->name, value, n->least, n->most);
    }
    if (point->soft_ms > point->ms)
        return spl_fail_field(err, SPL_E_INPUT, "soft_ms", "%s: point %zu: soft_ms %g is above ms %g", name, index,
                              point->soft_ms, point->ms);
    if (!(point->fixed_ms + point->ms_per_mpx > 0))
        return spl_fail_field(err, SPL_E_INPUT, "fixed_ms", "%s: point %zu: fixed_ms and ms_per_mpx are both 0", name,
                              index);
    if (point->ms_q90 < point->ms)
        return spl_fail_field(err, SPL_E_INPUT, "ms_q90", "%s: point %zu: ms_q90 %g is below ms %g", name, index,
                              point->ms_q90, point->ms);
    return 0;
}

int spl_profile_check(const struct spl_profile *profile, const char *name, struct spl_error *err)
{
    int rc = 0;
    for (size_t i = 0; !rc && i < profile->count; i++) {
        rc = check_point(&profile->points[i], name, i, err);
        for (size_t j = 0; !rc && j < i; j++)
            if (spl_setting_equal(&profile->points[i].setting, &profile->points[j].setting))
                rc = spl_fail_field(err, SPL_E_INPUT, "points", "%s: points %zu and %zu are the same setting", name, j,
                                    i);
    }
    return rc;
}

/* ------------------------------------------------------------------------------------------------------- reading */

static int read_text(const json_t *object, const char *key, char *out, size_t capacity, const char *name,
                     struct spl_error *err)
{
    const char *text = json_string_value(json_object_get(object, key));
    if (!text || strlen(text) >= capacity)
        return spl_fail_field(err, SPL_E_INPUT, key, "%s: '%s' must be text of at most %zu bytes", name, key,
                              capacity - 1);
    memcpy(out, text, strlen(text) + 1);
    return 0;
}

static int read_count(const json_t *object, const char *key, json_int_t most, uint32_t *out, const char *name,
                      struct spl_error *err)
{
    const json_t *json = json_object_get(object, key);
    json_int_t value = json_integer_value(json);
    if (!json_is_integer(json) || value < 1 || value > most)
        return spl_fail_field(err, SPL_E_INPUT, key, "%s: '%s' must be a whole number from 1 to %lld", name, key,
                              (long long)most);
    *out = (uint32_t)value;
    return 0;
}

static int read_number(const json_t *object, const char *key, bool optional, const char *name, size_t index,
                       double *out, struct spl_error *err)
{
    const json_t *json = json_object_get(object, key);
    *out = NAN;
    if (optional && (!json || json_is_null(json)))
        return 0;
    if (!json_is_number(json))
        return spl_fail_field(err, SPL_E_INPUT, key, "%s: point %zu needs a number '%s'", name, index, key);
    *out = json_number_value(json);
    return 0;
}

/* Profiles that were made before textures have none. */
static int read_atoms(const json_t *object, const char *name, size_t index, uint32_t *out, struct spl_error *err)
{
    const json_t *json = json_object_get(object, "atoms");
    json_int_t value = json ? json_integer_value(json) : SPL_TEXTURE_ATOMS;
    if ((json && !json_is_integer(json)) || value < 0 || value > SPL_TEXTURE_ATOMS)
        return spl_fail_field(err, SPL_E_INPUT, "atoms", "%s: point %zu: 'atoms' must be a whole number from 0 to %d",
                              name, index, SPL_TEXTURE_ATOMS);
    *out = (uint32_t)value;
    return 0;
}

/* Left out of profiles of datasets without maps, and of methods that take none. */
static int read_maps(const json_t *object, const char *name, size_t index, enum spl_setting_maps *out,
                     struct spl_error *err)
{
    const json_t *json = json_object_get(object, "maps");
    const char *text = json_string_value(json);
    *out = SPL_SETTING_NO_MAPS;
    for (int i = SPL_SETTING_MAPS_ON; text && i < SPL_SETTING_MAPS_COUNT; i++)
        if (!strcmp(text, spl_setting_maps_name((enum spl_setting_maps)i)))
            *out = (enum spl_setting_maps)i;
    if (json && !*out)
        return spl_fail_field(err, SPL_E_INPUT, "maps", "%s: point %zu: 'maps' must be \"on\" or \"off\"", name, index);
    return 0;
}

/* Left out where all is solid. */
static int read_soft_model(const json_t *object, const struct spl_profile *profile, const char *name, size_t index,
                           uint32_t *out, struct spl_error *err)
{
    const json_t *json = json_object_get(object, "soft_model");
    int model = json_is_string(json) ? spl_soft_model_from_name(json_string_value(json)) : -1;
    *out = model < 0 ? 0 : 1 + (uint32_t)model;
    if (json && (model < 0 || !profile->soft.what.count))
        return spl_fail_field(err, SPL_E_INPUT, "soft_model",
                              model < 0 ? "%s: point %zu: 'soft_model' is no model's name"
                                        : "%s: point %zu has a 'soft_model', and the profile no 'soft' that it is of",
                              name, index);
    return 0;
}

/* What is soft where points have a model; left out where none has. */
static int read_soft(const json_t *root, const char *name, struct spl_soft_params *soft, struct spl_error *err)
{
    const json_t *json = json_object_get(root, "soft"), *cover = json_object_get(json, "cover");
    const char *terms = json_string_value(json_object_get(json, "terms"));
    struct spl_error why = {0};
    if (!json)
        return 0;
    soft->opacity = json_number_value(json_object_get(json, "opacity"));
    soft->blend = json_number_value(json_object_get(json, "blend"));
    soft->cover = json_is_number(cover) ? json_number_value(cover) : 1; /* older profiles have none */
    if (!terms || !json_is_number(json_object_get(json, "opacity")) || !json_is_number(json_object_get(json, "blend")))
        return spl_fail_field(err, SPL_E_INPUT, "soft",
                              "%s: 'soft' needs a text 'terms', numbers 'opacity' and 'blend'", name);
    int rc = spl_soft_parse(terms, soft, &why);
    if (!rc)
        rc = spl_soft_check(soft, &why);
    return rc ? spl_fail_field(err, SPL_E_INPUT, "soft", "%s: 'soft': %.300s", name, why.message) : 0;
}

static int read_point(const json_t *object, const struct spl_profile *profile, const char *name, size_t index,
                      struct spl_profile_point *point, struct spl_error *err)
{
    char method[32];
    int rc;
    if (!json_is_object(object))
        return spl_fail_field(err, SPL_E_INPUT, "points", "%s: point %zu is no object", name, index);
    if ((rc = read_text(object, "method", method, sizeof method, name, err)) ||
        (rc = read_number(object, "lod", false, name, index, &point->setting.lod, err)) ||
        (rc = read_number(object, "supersample", false, name, index, &point->setting.supersample, err)) ||
        (rc = read_atoms(object, name, index, &point->setting.atoms, err)) ||
        (rc = read_maps(object, name, index, &point->setting.maps, err)) ||
        (rc = read_soft_model(object, profile, name, index, &point->setting.soft, err)))
        return rc;
    int found = spl_method_from_name(method);
    if (found < 0)
        return spl_fail_field(err, SPL_E_INPUT, "method", "%s: point %zu: unknown method '%s'", name, index, method);
    point->setting.method = (enum spl_method)found;
    for (const struct number *n = numbers; !rc && n < numbers + number_count; n++)
        rc = read_number(object, n->name, n->optional, name, index, (double *)((char *)point + n->offset), err);
    return rc;
}

static int read_version(const json_t *dataset, const char *name, uint64_t *out, struct spl_error *err)
{
    char text[17] = "", *end = text;
    int rc = read_text(dataset, "version", text, sizeof text, name, err);
    if (rc)
        return rc;
    if (strspn(text, "0123456789abcdef") == 16)
        *out = strtoull(text, &end, 16);
    if (end != text + 16)
        return spl_fail_field(err, SPL_E_INPUT, "version", "%s: dataset version '%s' is not 16 hex digits", name, text);
    return 0;
}

static int read_header(const json_t *root, const char *name, struct spl_profile *profile, struct spl_error *err)
{
    const char *format = json_string_value(json_object_get(root, "format"));
    if (!format || strcmp(format, FORMAT))
        return spl_fail_field(err, SPL_E_INPUT, "format", "%s: 'format' is not \"" FORMAT "\"", name);
    uint32_t version;
    const json_t *dataset = json_object_get(root, "dataset"), *device = json_object_get(root, "device");
    const json_t *software = json_object_get(device, "software");
    int rc;
    if ((rc = read_count(root, "format_version", SPL_PROFILE_VERSION, &version, name, err)) ||
        (rc = read_text(root, "splatd", profile->splatd, sizeof profile->splatd, name, err)) ||
        (rc = read_text(dataset, "id", profile->dataset_id, sizeof profile->dataset_id, name, err)) ||
        (rc = read_version(dataset, name, &profile->dataset_version, err)) ||
        (rc = read_text(device, "backend", profile->backend, sizeof profile->backend, name, err)) ||
        (rc = read_text(device, "name", profile->device, sizeof profile->device, name, err)) ||
        (rc = read_text(device, "driver", profile->driver, sizeof profile->driver, name, err)) ||
        (rc = read_text(root, "reference", profile->reference, sizeof profile->reference, name, err)) ||
        (rc = read_count(root, "views", views_max, &profile->views, name, err)) ||
        (rc = read_count(root, "width", side_max, &profile->width, name, err)) ||
        (rc = read_count(root, "height", side_max, &profile->height, name, err)) ||
        (rc = read_soft(root, name, &profile->soft, err)))
        return rc;
    if (!json_is_boolean(software))
        return spl_fail_field(err, SPL_E_INPUT, "software", "%s: 'software' must be true or false", name);
    profile->software = json_is_true(software);
    return 0;
}

static int read_points(const json_t *root, const char *name, struct spl_profile *profile, struct spl_error *err)
{
    const json_t *points = json_object_get(root, "points");
    size_t count = json_array_size(points);
    if (!count || count > SPL_PROFILE_POINTS_MAX)
        return spl_fail_field(err, SPL_E_INPUT, "points", "%s: 'points' must be an array of 1 to %d settings", name,
                              (int)SPL_PROFILE_POINTS_MAX);
    if (!(profile->points = spl_alloc(count, sizeof *profile->points, err)))
        return SPL_E_NOMEM;
    profile->count = count;
    int rc = 0;
    for (size_t i = 0; !rc && i < count; i++)
        rc = read_point(json_array_get(points, i), profile, name, i, &profile->points[i], err);
    return rc ? rc : spl_profile_check(profile, name, err);
}

int spl_profile_parse(const char *bytes, size_t length, const char *name, struct spl_profile *profile,
                      struct spl_error *err)
{
    *profile = (struct spl_profile){0};
    json_error_t where;
    json_t *root = json_loadb(bytes, length, JSON_REJECT_DUPLICATES, &where);
    if (!root)
        return spl_fail(err, SPL_E_INPUT, "%s: broken JSON at line %d, column %d: %s", name, where.line, where.column,
                        where.text);
    int rc = read_header(root, name, profile, err);
    if (!rc)
        rc = read_points(root, name, profile, err);
    json_decref(root);
    if (rc)
        spl_profile_finish(profile);
    else
        spl_profile_mark_front(profile);
    return rc;
}

/* ------------------------------------------------------------------------------------------------------- writing */

static json_t *point_to_json(const struct spl_profile_point *point)
{
    json_t *json = json_pack("{s:s, s:f, s:f, s:i, s:b}", "method", spl_method_name(point->setting.method), "lod",
                             point->setting.lod, "supersample", point->setting.supersample, "atoms",
                             (int)point->setting.atoms, "front", point->front);
    if (point->setting.maps)
        json_object_set_new(json, "maps", json_string(spl_setting_maps_name(point->setting.maps)));
    if (point->setting.soft)
        json_object_set_new(json, "soft_model", json_string(spl_setting_soft_name(point->setting.soft)));
    for (const struct number *n = numbers; n < numbers + number_count; n++) {
        double value = number_of(point, n);
        if (n->offset == offsetof(struct spl_profile_point, soft_ms) && !point->setting.soft)
            continue;
        json_object_set_new(json, n->name, isfinite(value) ? json_real(value) : json_null());
    }
    return json;
}

static json_t *soft_to_json(const struct spl_soft_params *soft)
{
    char terms[SPL_TERMS_TEXT_MAX + 1];
    if (!soft->what.count)
        return NULL;
    spl_soft_print(soft, terms, sizeof terms);
    return json_pack("{s:s, s:f, s:f, s:f}", "terms", terms, "opacity", soft->opacity, "cover", soft->cover, "blend",
                     soft->blend);
}

json_t *spl_profile_to_json(const struct spl_profile *profile)
{
    json_t *points = json_array();
    for (size_t i = 0; i < profile->count; i++)
        json_array_append_new(points, point_to_json(&profile->points[i]));
    return json_pack("{s:s, s:i, s:s, s:{s:s, s:o}, s:{s:s, s:s, s:s, s:b}, s:s, s:i, s:i, s:i, s:o*, s:o}", "format",
                     FORMAT, "format_version", profile->soft.what.count ? SPL_PROFILE_VERSION : 1, "splatd",
                     profile->splatd, "dataset", "id", profile->dataset_id, "version",
                     json_sprintf("%016" PRIx64, profile->dataset_version), "device", "backend", profile->backend,
                     "name", profile->device, "driver", profile->driver, "software", profile->software, "reference",
                     profile->reference, "views", (int)profile->views, "width", (int)profile->width, "height",
                     (int)profile->height, "soft", soft_to_json(&profile->soft), "points", points);
}
