/* Query strings: name=value joined by '&', percent-encoded, numbers in decimal, vectors joined by commas.
 *
 * Invariant: every byte of the input is either understood or refused by the name of its parameter; nothing is read
 * past `length`, nothing is allocated. Pure functions, any thread. */
#include "service/request/request.h"

#include <string.h>
#include <strings.h>

#include "base/decimal.h"
#include "base/text.h"
#include "service/request/values.h"

enum { name_max = 64, text_max = 512 };

int spl_percent_decode(const char *text, size_t length, char *out, size_t capacity, const char *field,
                       struct spl_error *err)
{
    size_t used = 0;
    for (size_t i = 0; i < length; i++) {
        int byte = (unsigned char)text[i];
        if (byte == '%') {
            int high = i + 2 < length ? spl_text_get_hex(text[i + 1]) : -1;
            int low = i + 2 < length ? spl_text_get_hex(text[i + 2]) : -1;
            if (high < 0 || low < 0)
                return spl_fail_field(err, SPL_E_INPUT, field,
                                      "'%%' at byte %zu of %s is not followed by two hex digits", i + 1, field);
            byte = high * 16 + low;
            i += 2;
        }
        if (byte < 0x20 || byte == 0x7f)
            return spl_fail_field(err, SPL_E_INPUT, field, "%s holds the control character %d", field, byte);
        if (used + 1 >= capacity)
            return spl_fail_field(err, SPL_E_INPUT, field, "%s is longer than %zu bytes", field, capacity - 1);
        out[used++] = (char)byte;
    }
    out[used] = '\0';
    return 0;
}

static int parse_number(const char *text, size_t length, const char *name, bool several, double *out,
                        struct spl_error *err)
{
    char copy[text_max];
    memcpy(copy, text, length); // the caller's buffer has the same size
    copy[length] = '\0';
    const char *word = copy + (copy[0] == '-' || copy[0] == '+');
    if (!strcasecmp(word, "nan") || !strcasecmp(word, "inf") || !strcasecmp(word, "infinity"))
        return spl_fail_field(err, SPL_E_INPUT, name, "%s must be finite, not '%.16s'", name, copy);
    double number;
    if (spl_decimal_parse(copy, &number) != copy + length)
        return spl_fail_field(err, SPL_E_INPUT, name, "%s '%.32s' is not a number%s", name, copy,
                              several ? "; join them by commas, without blanks" : "");
    *out = number + 0.0; /* no -0: a reply of the one is the other's, too */
    return 0;
}

static int parse_numbers(struct spl_value *value, const char *text, const char *name, bool several,
                         struct spl_error *err)
{
    for (const char *p = text;;) {
        size_t length = strcspn(p, ",");
        double ignored;
        bool room = value->count < SPL_VALUE_NUMBERS;
        int rc = parse_number(p, length, name, several, room ? &value->n[value->count] : &ignored, err);
        if (rc)
            return rc;
        value->count++;
        if (!p[length])
            return 0;
        p += length + 1;
    }
}

static int parse_color(struct values *values, const char *text, size_t length, struct spl_error *err)
{
    char decoded[SPL_COLOR_TEXT_MAX];
    int rc = spl_percent_decode(text, length, decoded, sizeof decoded, "color_by", err);
    return rc ? rc : spl_values_set_color(values, decoded, err);
}

static bool is_digit(char c)
{
    return c >= '0' && c <= '9';
}

/* '+' is a blank, as forms in pages write it, but for an exponent's sign (1e+05). */
static void read_blanks(char *text)
{
    for (char *p = text; (p = strchr(p, '+')); p++)
        if (!(p - text >= 2 && (p[-1] == 'e' || p[-1] == 'E') && (is_digit(p[-2]) || p[-2] == '.') && is_digit(p[1])))
            *p = ' ';
}

/* May be given several times, and is longer than others. */
static int parse_terms(struct values *values, enum param param, const char *text, size_t length, struct spl_error *err)
{
    char decoded[SPL_TERMS_TEXT_MAX + 1];
    int rc = spl_percent_decode(text, length, decoded, sizeof decoded, spl_params[param].name, err);
    if (!rc)
        read_blanks(decoded);
    return rc ? rc : spl_values_add_terms(values, param, decoded, err);
}

static int parse_pair(struct values *values, const char *pair, size_t length, enum spl_value_place place,
                      struct spl_error *err)
{
    char name[name_max], text[text_max];
    const char *equals = memchr(pair, '=', length);
    size_t name_length = equals ? (size_t)(equals - pair) : length;
    int rc = spl_percent_decode(pair, name_length, name, sizeof name, "a parameter's name", err);
    if (rc)
        return rc;
    enum param param = spl_param_find(name, place, err);
    if (param == PARAM_COUNT)
        return SPL_E_INPUT;
    if (!equals)
        return spl_fail_field(err, SPL_E_INPUT, name, "%s has no value; write %s=…", name, name);
    struct spl_value *value = &values->v[param];
    if (spl_params[param].kind == SPL_KIND_TERMS)
        return parse_terms(values, param, equals + 1, length - name_length - 1, err);
    if (spl_params[param].kind == SPL_KIND_COLOR_BY)
        return parse_color(values, equals + 1, length - name_length - 1, err);
    if ((rc = spl_value_claim(&values->v[param], name, err)))
        return rc;
    if ((rc = spl_percent_decode(equals + 1, length - name_length - 1, text, sizeof text, name, err)))
        return rc;
    int kind = spl_params[param].kind;
    unsigned least, most;
    spl_kind_get_count((enum spl_value_kind)kind, &least, &most);
    if (!most)
        return spl_value_from_text(value, kind, name, text, err);
    if ((rc = parse_numbers(value, text, name, most > 1, err)))
        return rc;
    return spl_value_check(value, (enum spl_value_kind)kind, name, err);
}

int spl_values_from_query(struct values *values, const char *query, size_t length, enum spl_value_place place,
                          struct spl_error *err)
{
    for (size_t at = 0; at < length;) {
        const char *end = memchr(query + at, '&', length - at);
        size_t pair = end ? (size_t)(end - query) - at : length - at;
        int rc = pair ? parse_pair(values, query + at, pair, place, err) : 0;
        if (rc)
            return rc;
        at += pair + 1;
    }
    return 0;
}

int spl_view_request_from_query(const char *query, size_t length, const struct spl_camera_defaults *defaults,
                                const struct spl_camera_limits *limits, struct spl_view_request *out,
                                struct spl_error *err)
{
    struct values values = {0};
    int rc = spl_values_from_query(&values, query, length, SPL_QUERY, err);
    return rc ? rc : spl_values_resolve(&values, defaults, limits, out, err);
}
