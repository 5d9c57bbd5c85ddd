/* Terms of a request, from queries and JSON, and their shapes into the world: what is soft, and what is drawn at all.
 *
 * Invariant: terms of what is soft are joined by or, however often the parameter is given; clips and classes are
 * conditions, all of which hold. Errors name the parameter. Pure functions but for what a dataset's places do, any
 * thread. */
#include <jansson.h>
#include <math.h>
#include <stdio.h>
#include <string.h>

#include "service/request/request.h"
#include "service/request/values.h"

int spl_values_add_terms(struct values *values, int param, const char *text, struct spl_error *err)
{
    if (param == PARAM_class && values->v[param].given)
        return spl_fail_field(err, SPL_E_INPUT, "class", "class is given twice; write its classes as one list: 2,6");
    values->v[param].given = true;
    return param == PARAM_soft   ? spl_soft_parse(text, &values->soft, err)
           : param == PARAM_clip ? spl_terms_parse(text, "clip", &values->clip, err)
                                 : spl_terms_parse_classes(text, &values->classes, err);
}

/* Classes as a number, or an array of such, which is one list. */
static int add_classes(struct values *values, const json_t *json, struct spl_error *err)
{
    const bool one = json_is_integer(json);
    const size_t count = one ? 1 : json_array_size(json);
    char text[SPL_TERMS_MAX * 12 + 1] = "";
    size_t used = 0;
    if (count > SPL_TERMS_MAX)
        return spl_fail_field(err, SPL_E_INPUT, "class", "class has more than %d numbers; write \"3-5\" for 3, 4, 5",
                              SPL_TERMS_MAX);
    for (size_t i = 0; i < count; i++) {
        const json_t *item = one ? json : json_array_get(json, i);
        if (!json_is_integer(item) || json_integer_value(item) < 0 || json_integer_value(item) > UINT32_MAX)
            return spl_fail_field(err, SPL_E_INPUT, "class", "class must hold whole numbers, or be text: \"!7\"");
        used += (size_t)snprintf(text + used, sizeof text - used, "%s%lld", i ? "," : "",
                                 (long long)json_integer_value(item));
    }
    if (count)
        return spl_values_add_terms(values, PARAM_class, text, err);
    values->v[PARAM_class].given = true;
    return 0;
}

int spl_values_add_terms_json(struct values *values, int param, const json_t *json, struct spl_error *err)
{
    const char *name = spl_params[param].name;
    int rc = 0;
    if (json_is_string(json))
        return spl_values_add_terms(values, param, json_string_value(json), err);
    if (param == PARAM_class && (json_is_integer(json) || json_is_array(json)))
        return add_classes(values, json, err);
    if (!json_is_array(json))
        return spl_fail_field(err, SPL_E_INPUT, name, "%s must be text or an array of %s, not %s", name,
                              param == PARAM_class ? "numbers" : "texts", spl_json_type_name(json));
    values->v[param].given = true;
    for (size_t i = 0; !rc && i < json_array_size(json); i++) {
        const json_t *term = json_array_get(json, i);
        rc = json_is_string(term)
                 ? spl_values_add_terms(values, param, json_string_value(term), err)
                 : spl_fail_field(err, SPL_E_INPUT, name, "%s must hold text, not %s", name, spl_json_type_name(term));
    }
    return rc;
}

void spl_values_inherit_terms(struct values *values, const struct values *common)
{
    if (!values->v[PARAM_soft].given)
        values->soft = common->soft;
    if (!values->v[PARAM_clip].given)
        values->clip = common->clip;
    if (!values->v[PARAM_class].given)
        values->classes = common->classes;
}

/* Corners as points of its lower height, or of none; heights as of its first corner. */
static int polygon_to_world(struct spl_terms *terms, struct spl_term *term, uint32_t crs, const char *field,
                            const struct spl_camera_places *places, struct spl_error *err)
{
    const double *first = terms->corners[term->first_corner];
    const bool high = isfinite(term->shape[0]);
    double heights[2] = {term->shape[0], term->shape[1]}, point[3];
    int rc = 0;
    for (int i = 0; high && !rc && i < 2; i++) {
        const double at[3] = {first[0], first[1], heights[i]};
        if (!(rc = places->to_world(places, crs, field, at, point, err)))
            term->shape[i] = point[2];
    }
    for (uint32_t i = 0; !rc && i < term->corners; i++) {
        double *corner = terms->corners[term->first_corner + i];
        const double at[3] = {corner[0], corner[1], high ? heights[0] : 0};
        if (!(rc = places->to_world(places, crs, field, at, point, err)))
            memcpy(corner, point, 2 * sizeof *corner);
    }
    return rc;
}

int spl_terms_to_world(struct spl_terms *terms, const char *field, uint32_t crs, const struct spl_camera_places *places,
                       struct spl_error *err)
{
    int rc = 0;
    for (uint32_t i = 0; !rc && i < terms->count; i++) {
        struct spl_term *term = &terms->terms[i];
        if (term->measure == SPL_TERM_BOX || term->measure == SPL_TERM_COORDINATE)
            rc = spl_fail_field(
                err, SPL_E_INPUT, field,
                "a box, x, y and z are of the dataset's own axes and cannot be given in EPSG:%u; ask for "
                "the view without crs, in the dataset's coordinates",
                crs);
        else if (term->measure == SPL_TERM_POLYGON)
            rc = polygon_to_world(terms, term, crs, field, places, err);
        else if (term->measure >= SPL_TERM_AXIS)
            rc = places->to_world(places, crs, field, term->shape, term->shape, err);
    }
    return rc;
}

/* Clips, then classes, as if these were one more clip. */
static int join_clips(const struct values *values, struct spl_terms *out, struct spl_error *err)
{
    *out = values->clip;
    if (out->count + values->classes.count > SPL_TERMS_MAX)
        return spl_fail_field(err, SPL_E_INPUT, "class", "clip and class have more than %d terms together",
                              SPL_TERMS_MAX);
    for (uint32_t i = 0; i < values->classes.count; i++)
        out->terms[out->count++] = values->classes.terms[i];
    return 0;
}

int spl_values_resolve_terms(const struct values *values, const struct spl_camera_defaults *defaults,
                             struct spl_view_request *out, struct spl_error *err)
{
    const struct spl_value *crs = &values->v[PARAM_crs];
    struct spl_view *view = &out->view;
    out->classes = values->classes.count;
    view->soft.what = values->soft.what;
    int rc = join_clips(values, &view->clip, err);
    if (rc || !crs->given) /* what crs needs was checked with the camera */
        return rc;
    if (!values->world_soft)
        rc = spl_terms_to_world(&view->soft.what, "soft", (uint32_t)crs->n[0], defaults->places, err);
    if (!rc && !values->world_clip)
        rc = spl_terms_to_world(&view->clip, "clip", (uint32_t)crs->n[0], defaults->places, err);
    return rc;
}
