/* JSON bodies: the parameters of a view at the top, those of its camera in a "camera" object.
 *
 * jansson parses; duplicate keys, unknown keys and wrong types are refused by name, broken JSON by line and column.
 * Invariant: no reference to the document outlives the call. Pure functions, any thread. */
#include "service/request/request.h"

#include <jansson.h>
#include <string.h>

#include "geom/json.h"
#include "service/request/body.h"
#include "service/request/values.h"

static int parse_value(struct spl_value *value, int kind, const json_t *json, const char *name, struct spl_error *err)
{
    if (kind < SPL_KIND_END)
        return spl_value_from_json(value, (enum spl_value_kind)kind, json, name, err);
    bool on = false, flag = kind == SPL_KIND_FLAG;
    if (flag && spl_json_get_flag(json, &on)) {
        value->n[0] = on;
        return 0;
    }
    if (kind == SPL_KIND_DURATION && json_is_number(json)) {
        value->n[0] = json_number_value(json);
        return 0;
    }
    if (kind == SPL_KIND_LAYERS && json_is_array(json)) {
        if (!json_array_size(json))
            return spl_fail_field(err, SPL_E_INPUT, name, "%s is empty", name);
        int rc = 0;
        for (size_t i = 0; !rc && i < json_array_size(json); i++) {
            const char *text = json_string_value(json_array_get(json, i));
            rc = text ? spl_value_add_layer(value, name, text, err)
                      : spl_fail_field(err, SPL_E_INPUT, name, "%s must hold text, not %s", name,
                                       spl_json_type_name(json_array_get(json, i)));
        }
        return rc;
    }
    if (flag || !json_is_string(json))
        return spl_fail_field(err, SPL_E_INPUT, name, "%s must be %s, not %s", name,
                              flag ? SPL_JSON_FLAG_FORMS : "text",
                              flag ? spl_json_flag_fault(json) : spl_json_type_name(json));
    return spl_value_from_text(value, kind, name, json_string_value(json), err);
}

int spl_values_from_object(struct values *values, json_t *object, enum spl_value_place place, struct spl_error *err)
{
    const char *name;
    json_t *json;
    json_object_foreach(object, name, json)
    {
        int rc;
        if (place & (SPL_BODY | SPL_PICK_BODY) && !strcmp(name, "camera")) {
            if (!json_is_object(json))
                return spl_fail_field(err, SPL_E_INPUT, name, "camera must be an object, not %s",
                                      spl_json_type_name(json));
            if ((rc = spl_values_from_object(values, json, SPL_CAMERA, err)))
                return rc;
            continue;
        }
        enum param param = spl_param_find(name, place, err);
        if (param == PARAM_COUNT)
            return SPL_E_INPUT;
        int kind = spl_params[param].kind;
        if (kind == SPL_KIND_TERMS) {
            if ((rc = spl_values_add_terms_json(values, (int)param, json, err)))
                return rc;
            continue;
        }
        if (kind == SPL_KIND_COLOR_BY) {
            if (!json_is_string(json))
                return spl_fail_field(err, SPL_E_INPUT, name, "%s must be text, not %s", name,
                                      spl_json_type_name(json));
            if ((rc = spl_values_set_color(values, json_string_value(json), err)))
                return rc;
            continue;
        }
        if ((rc = spl_value_claim(&values->v[param], name, err)) ||
            (rc = kind == SPL_KIND_FORM ? spl_camera_form_from_json(values->v, (enum spl_camera_param)param, json, err)
                                        : parse_value(&values->v[param], kind, json, name, err)))
            return rc;
    }
    return 0;
}

int spl_values_from_body(struct values *values, const char *body, size_t length, enum spl_value_place place,
                         struct spl_error *err)
{
    if (!length)
        return 0;
    json_t *document = spl_body_parse(body, length, SPL_BODY_VALUES, SPL_BODY_TEXT, err);
    int rc;
    if (!document)
        return SPL_E_INPUT;
    if (!json_is_object(document))
        rc = spl_fail_field(err, SPL_E_INPUT, "body", "the body must be a JSON object, not %s",
                            spl_json_type_name(document));
    else
        rc = spl_values_from_object(values, document, place, err);
    json_decref(document);
    return rc;
}

int spl_view_request_from_json(const char *body, size_t length, const struct spl_camera_defaults *defaults,
                               const struct spl_camera_limits *limits, struct spl_view_request *out,
                               struct spl_error *err)
{
    struct values values = {0};
    int rc = spl_values_from_body(&values, body, length, SPL_BODY, err);
    return rc ? rc : spl_values_resolve(&values, defaults, limits, out, err);
}
