/* The table of parameters, and the syntax of single values that queries and JSON share.
 *
 * Invariant: a value that passed spl_value_check() holds only finite numbers, as many as its kind asks for, whole ones
 * for counts. Pure functions, any thread. */
#include "service/values.h"

#include <math.h>
#include <string.h>
#include <strings.h>

const struct param_info spl_params[PARAM_COUNT] = {
#define PARAM(name, alias, kind, places, help) {#name, alias, KIND_##kind, places},
#include "service/view_params.def"
#undef PARAM
};

enum param spl_param_find(const char *name, enum value_place place, struct spl_error *err)
{
    for (int i = 0; i < PARAM_COUNT; i++) {
        const struct param_info *info = &spl_params[i];
        bool alias = place == QUERY && info->alias[0] && !strcasecmp(name, info->alias);
        if (strcmp(name, info->name) && !alias)
            continue;
        if (info->places & place)
            return (enum param)i;
        spl_fail_field(err, SPL_E_INPUT, name, "'%s' does not belong here; %s", name,
                       info->places & CAMERA ? "give it in the \"camera\" object of a POST"
                                             : "give it beside \"camera\"");
        return PARAM_COUNT;
    }
    spl_fail_field(err, SPL_E_INPUT, name, "unknown parameter '%s'; api/openapi.yaml lists those of a view", name);
    return PARAM_COUNT;
}

int spl_values_claim(struct values *values, enum param param, const char *name, struct spl_error *err)
{
    if (values->v[param].given)
        return spl_fail_field(err, SPL_E_INPUT, name, "'%s' is given twice", spl_params[param].name);
    values->v[param].given = true;
    return 0;
}

void spl_kind_get_count(enum value_kind kind, unsigned *least, unsigned *most)
{
    *least = *most = kind == KIND_NUMBER || kind == KIND_COUNT     ? 1
                     : kind == KIND_VECTOR                         ? 3
                     : kind == KIND_QUATERNION                     ? 4
                     : kind == KIND_MATRIX || kind == KIND_NUMBERS ? VALUE_NUMBERS_MAX
                                                                   : 0;
    if (kind == KIND_NUMBERS)
        *least = 1;
}

int spl_hex_digit(char c)
{
    return c >= '0' && c <= '9'   ? c - '0'
           : c >= 'a' && c <= 'f' ? c - 'a' + 10
           : c >= 'A' && c <= 'F' ? c - 'A' + 10
                                  : -1;
}

static int parse_color(struct value *value, const char *name, const char *text, struct spl_error *err)
{
    if (!strcmp(text, "transparent")) {
        value->n[3] = 0; // the rest is 0 already
        return 0;
    }
    const char *digits = text[0] == '#' ? text + 1 : !strncasecmp(text, "0x", 2) ? text + 2 : text;
    size_t length = strlen(digits);
    bool good = length == 6 || length == 8;
    for (size_t i = 0; good && i < length; i++)
        good = spl_hex_digit(digits[i]) >= 0;
    if (!good)
        return spl_fail_field(err, SPL_E_INPUT, name, "%s '%.32s' is no colour; write RRGGBB, RRGGBBAA or transparent",
                              name, text);
    value->n[3] = 255;
    for (size_t i = 0; i < length / 2; i++)
        value->n[i] = spl_hex_digit(digits[2 * i]) * 16 + spl_hex_digit(digits[2 * i + 1]);
    return 0;
}

static int axes_from_name(const char *name)
{
    return !strcmp(name, "opencv") ? SPL_AXES_OPENCV : !strcmp(name, "opengl") ? SPL_AXES_OPENGL : -1;
}

static int flag_from_name(const char *name)
{
    return !strcasecmp(name, "true") ? 1 : !strcasecmp(name, "false") ? 0 : -1;
}

int spl_value_from_text(struct value *value, enum value_kind kind, const char *name, const char *text,
                        struct spl_error *err)
{
    static const struct {
        int (*lookup)(const char *name);
        const char *choices;
    } table[] = {
        [KIND_FLAG] = {flag_from_name, "true, false"},
        [KIND_METHOD] = {spl_method_from_name, "splat, points"},
        [KIND_LAYER] = {spl_layer_from_name, "color, depth, range, normal, id, coverage"},
        [KIND_FORMAT] = {spl_format_from_name, "jpeg, png, npy, raw"},
        [KIND_AXES] = {axes_from_name, "opengl, opencv"},
        [KIND_MODEL] = {spl_colmap_model_from_name, "SIMPLE_PINHOLE, PINHOLE, SIMPLE_RADIAL, RADIAL, OPENCV"},
    };
    if (kind == KIND_COLOR)
        return parse_color(value, name, text, err);
    int choice = table[kind].lookup(text);
    if (choice < 0)
        return spl_fail_field(err, SPL_E_INPUT, name, "%s '%.32s' is unknown; known are %s", name, text,
                              table[kind].choices);
    value->n[0] = choice;
    return 0;
}

int spl_value_check(const struct value *value, enum value_kind kind, const char *name, struct spl_error *err)
{
    unsigned least, most;
    spl_kind_get_count(kind, &least, &most);
    if (value->count < least || value->count > most)
        return spl_fail_field(err, SPL_E_INPUT, name, "%s needs %u number%s, not %u", name, most, most > 1 ? "s" : "",
                              value->count);
    for (unsigned i = 0; i < value->count; i++)
        if (!isfinite(value->n[i]))
            return spl_fail_field(err, SPL_E_INPUT, name, "%s must be finite", name);
    if (kind == KIND_COUNT && (value->n[0] < 0 || value->n[0] > 1e15 || value->n[0] != floor(value->n[0])))
        return spl_fail_field(err, SPL_E_INPUT, name, "%s must be a whole number from 0 on, not %g", name, value->n[0]);
    return 0;
}
