/* JSON beyond what jansson has; see json.h. */
#include "geom/json.h"

#include <stdio.h>

bool spl_json_get_numbers(const json_t *array, size_t count, double *out)
{
    bool good = json_array_size(array) == count;
    for (size_t i = 0; good && i < count; i++) {
        good = json_is_number(json_array_get(array, i));
        out[i] = json_number_value(json_array_get(array, i));
    }
    return good;
}

const char *spl_json_fault(const json_error_t *where)
{
    switch (json_error_code(where)) {
    case json_error_null_character:
        return "\\u0000 stands in a text, where none may be";
    case json_error_null_byte_in_key:
        return "\\u0000 stands in a name, where none may be";
    default:
        return where->text;
    }
}

const char *spl_json_type_name(const json_t *json)
{
    static const char *const names[] = {
        [JSON_OBJECT] = "an object", [JSON_ARRAY] = "an array", [JSON_STRING] = "text", [JSON_INTEGER] = "a number",
        [JSON_REAL] = "a number",    [JSON_TRUE] = "true",      [JSON_FALSE] = "false", [JSON_NULL] = "null",
    };
    return json ? names[json_typeof(json)] : "missing";
}

const char *spl_json_show_shape(const json_t *json, char text[40])
{
    int length = snprintf(text, 40, "%s", spl_json_type_name(json));
    if (json_is_array(json))
        snprintf(text + length, 40 - (size_t)length, " of %zu", json_array_size(json));
    return text;
}
