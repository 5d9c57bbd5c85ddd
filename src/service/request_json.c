/* JSON bodies: the parameters of a view at the top, those of its camera in a "camera" object.
 *
 * jansson parses; duplicate keys, unknown keys and wrong types are refused by name, broken JSON by line and column.
 * Invariant: no reference to the document outlives the call. Pure functions, any thread. */
#include "service/request.h"

#include <jansson.h>
#include <string.h>

#include "service/values.h"

static const char *type_name(const json_t *json)
{
    static const char *const names[] = {
        [JSON_OBJECT] = "an object", [JSON_ARRAY] = "an array", [JSON_STRING] = "text", [JSON_INTEGER] = "a number",
        [JSON_REAL] = "a number",    [JSON_TRUE] = "true",      [JSON_FALSE] = "false", [JSON_NULL] = "null",
    };
    return names[json_typeof(json)];
}

static int parse_number(struct value *value, const json_t *json, const char *name, struct spl_error *err)
{
    if (!json_is_number(json))
        return spl_fail_field(err, SPL_E_INPUT, name, "%s must hold numbers, not %s", name, type_name(json));
    if (value->count < VALUE_NUMBERS_MAX)
        value->n[value->count] = json_number_value(json);
    value->count++;
    return 0;
}

static int parse_value(struct value *value, enum value_kind kind, const json_t *json, const char *name,
                       struct spl_error *err)
{
    unsigned least, most;
    spl_kind_get_count(kind, &least, &most);
    if (!most) {
        if (kind == KIND_FLAG && json_is_boolean(json)) {
            value->n[0] = json_is_true(json);
            return 0;
        }
        if (kind == KIND_FLAG || !json_is_string(json))
            return spl_fail_field(err, SPL_E_INPUT, name, "%s must be %s, not %s", name,
                                  kind == KIND_FLAG ? "true or false" : "text", type_name(json));
        return spl_value_from_text(value, kind, name, json_string_value(json), err);
    }
    int rc = 0;
    if (most == 1) {
        rc = parse_number(value, json, name, err);
    } else if (!json_is_array(json)) {
        return spl_fail_field(err, SPL_E_INPUT, name, "%s must be an array of numbers, not %s", name, type_name(json));
    } else {
        for (size_t i = 0; !rc && i < json_array_size(json); i++)
            rc = parse_number(value, json_array_get(json, i), name, err);
    }
    return rc ? rc : spl_value_check(value, kind, name, err);
}

static int parse_object(struct values *values, json_t *object, enum value_place place, struct spl_error *err)
{
    const char *name;
    json_t *json;
    json_object_foreach(object, name, json)
    {
        int rc;
        if (place == BODY && !strcmp(name, "camera")) {
            if (!json_is_object(json))
                return spl_fail_field(err, SPL_E_INPUT, name, "camera must be an object, not %s", type_name(json));
            if ((rc = parse_object(values, json, CAMERA, err)))
                return rc;
            continue;
        }
        enum param param = spl_param_find(name, place, err);
        if (param == PARAM_COUNT)
            return SPL_E_INPUT;
        if ((rc = spl_values_claim(values, param, name, err)) ||
            (rc = parse_value(&values->v[param], spl_params[param].kind, json, name, err)))
            return rc;
    }
    return 0;
}

int spl_view_request_from_json(const char *body, size_t length, const struct spl_view_defaults *defaults,
                               const struct spl_view_limits *limits, struct spl_view_request *out,
                               struct spl_error *err)
{
    struct values values = {0};
    if (length) {
        json_error_t where;
        json_t *document = json_loadb(body, length, JSON_REJECT_DUPLICATES, &where);
        int rc;
        if (!document)
            rc = spl_fail_field(err, SPL_E_INPUT, "body", "broken JSON at line %d, column %d: %s", where.line,
                                where.column, where.text);
        else if (!json_is_object(document))
            rc =
                spl_fail_field(err, SPL_E_INPUT, "body", "the body must be a JSON object, not %s", type_name(document));
        else
            rc = parse_object(&values, document, BODY, err);
        json_decref(document);
        if (rc)
            return rc;
    }
    return spl_values_resolve(&values, defaults, limits, out, err);
}
