/* What is soft, of a request: terms from queries and JSON, and their shapes into the world.
 *
 * Invariant: terms of a query are joined by or, however often the parameter is given; errors name "soft". Pure functions
 * but for what a dataset's places do, any thread. */
#include <jansson.h>

#include "service/request/request.h"
#include "service/request/values.h"

int spl_values_add_soft(struct values *values, const char *text, struct spl_error *err)
{
    values->v[PARAM_soft].given = true;
    return spl_soft_parse(text, &values->soft, err);
}

int spl_values_add_soft_json(struct values *values, const json_t *json, struct spl_error *err)
{
    int rc = 0;
    if (json_is_string(json))
        return spl_values_add_soft(values, json_string_value(json), err);
    if (!json_is_array(json))
        return spl_fail_field(err, SPL_E_INPUT, "soft", "soft must be text or an array of texts, not %s",
                              spl_json_type_name(json));
    values->v[PARAM_soft].given = true;
    for (size_t i = 0; !rc && i < json_array_size(json); i++) {
        const json_t *term = json_array_get(json, i);
        rc = json_is_string(term) ? spl_values_add_soft(values, json_string_value(term), err)
                                  : spl_fail_field(err, SPL_E_INPUT, "soft", "soft must hold text, not %s",
                                                   spl_json_type_name(term));
    }
    return rc;
}

int spl_soft_to_world(struct spl_soft_params *soft, uint32_t crs, const struct spl_camera_places *places,
                      struct spl_error *err)
{
    int rc = 0;
    for (uint32_t i = 0; !rc && i < soft->count; i++) {
        struct spl_soft_term *term = &soft->terms[i];
        if (term->measure == SPL_SOFT_BOX)
            rc = spl_fail_field(err, SPL_E_INPUT, "soft",
                                "a box lies along the dataset's own axes and cannot be given in EPSG:%u; ask for the "
                                "view without crs, in the dataset's coordinates", crs);
        else if (term->measure == SPL_SOFT_AXIS || term->measure == SPL_SOFT_PLANE)
            rc = places->to_world(places, crs, "soft", term->shape, term->shape, err);
    }
    return rc;
}

int spl_values_resolve_soft(const struct values *values, const struct spl_camera_defaults *defaults,
                            struct spl_view *view, struct spl_error *err)
{
    const struct spl_value *crs = &values->v[PARAM_crs];
    view->soft.count = values->soft.count;
    for (uint32_t i = 0; i < values->soft.count; i++)
        view->soft.terms[i] = values->soft.terms[i];
    /* what crs needs was checked with the camera */
    return crs->given ? spl_soft_to_world(&view->soft, (uint32_t)crs->n[0], defaults->places, err) : 0;
}
