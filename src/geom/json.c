/* JSON beyond what jansson has; see json.h. */
#include "geom/json.h"

#include <string.h>

#include "base/decimal.h"
#include "base/reading.h"

bool spl_json_is_marked(const void *text, size_t length)
{
    return length >= SPL_JSON_MARK && !memcmp(text, "\xef\xbb\xbf", SPL_JSON_MARK);
}

json_t *spl_json_load(const char *text, size_t length, json_error_t *where)
{
    size_t mark = spl_json_is_marked(text, length) ? SPL_JSON_MARK : 0;
    return json_loadb(text + mark, length - mark, JSON_REJECT_DUPLICATES, where);
}

struct stream {
    FILE *file;
    bool begun;
};

static size_t read_stream(void *buffer, size_t size, void *context)
{
    struct stream *stream = context;
    char *bytes = buffer;
    size_t count = fread(bytes, 1, size, stream->file);
    if (ferror(stream->file))
        return (size_t)-1;
    if (!stream->begun && spl_json_is_marked(bytes, count)) {
        count -= SPL_JSON_MARK;
        memmove(bytes, bytes + SPL_JSON_MARK, count);
    }
    stream->begun = true;
    return count;
}

json_t *spl_json_load_stream(FILE *file, json_error_t *where)
{
    struct stream stream = {.file = file};
    return json_load_callback(read_stream, &stream, JSON_REJECT_DUPLICATES, where);
}

json_t *spl_json_load_file(const char *path, json_error_t *where)
{
    struct spl_error why = {0};
    FILE *file;
    if (spl_open_for_reading(path, &file, &why)) { /* as json_load_file() says it */
        *where = (json_error_t){.line = -1, .column = -1};
        snprintf(where->text, sizeof where->text - 1, "%.*s", (int)sizeof where->text - 2, why.message);
        return NULL;
    }
    json_t *json = spl_json_load_stream(file, where);
    fclose(file);
    return json;
}

char *spl_json_print(json_t *json)
{
    char *text = spl_decimal_shorten(json ? json_dumps(json, JSON_INDENT(1) | JSON_REAL_PRECISION(17)) : NULL);
    json_decref(json);
    return text;
}

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

bool spl_json_get_flag(const json_t *json, bool *out)
{
    const double number = json_number_value(json); // of what is no number 0
    if (!json_is_boolean(json) && !(json_is_number(json) && (number == 0 || number == 1)))
        return false;
    *out = json_is_true(json) || number == 1;
    return true;
}

const char *spl_json_flag_fault(const json_t *json)
{
    return json_is_number(json) ? "another number" : spl_json_type_name(json);
}

const char *spl_json_show_shape(const json_t *json, char text[40])
{
    int length = snprintf(text, 40, "%s", spl_json_type_name(json));
    if (json_is_array(json))
        snprintf(text + length, 40 - (size_t)length, " of %zu", json_array_size(json));
    return text;
}
