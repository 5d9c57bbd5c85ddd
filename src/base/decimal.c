/* What strtod takes and people do not mean is refused here once: its result counts only where it has read to the end of
 * the decimal digits and no farther. Stateless; any thread. */
#include "base/decimal.h"

#include <math.h>
#include <stdbool.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

static const char digits[] = "0123456789";

const char *spl_decimal_parse(const char *text, double *value)
{
    const char *first = text + (*text == '-' || *text == '+'), *end = first + strspn(first, digits);
    size_t written = (size_t)(end - first);
    if (*end == '.') {
        size_t behind = strspn(end + 1, digits);
        written += behind;
        end += 1 + behind;
    }
    if (!written)
        return NULL;
    if (*end == 'e' || *end == 'E') {
        const char *power = end + 1 + (end[1] == '-' || end[1] == '+');
        size_t length = strspn(power, digits);
        end = length ? power + length : end;
    }
    char *stop;
    double number = strtod(text, &stop);
    if (stop != end || !isfinite(number))
        return NULL;
    *value = number;
    return end;
}

const char *spl_decimal_print(double value, char text[SPL_DECIMAL_MAX])
{
    double back = 0;
    for (int digits_shown = 15; digits_shown <= 17; digits_shown++) {
        snprintf(text, SPL_DECIMAL_MAX, "%.*g", digits_shown, value);
        if (spl_decimal_parse(text, &back) && back == value)
            break;
    }
    return text;
}

/* A number of JSON from `from` on, which ends at `end`, to `out`, which is not behind it; returns where that ends. What
 * is short stays as it is written. */
static char *shorten(const char *from, const char *end, char *out)
{
    char text[SPL_DECIMAL_MAX];
    double value;
    size_t length = (size_t)(end - from), shorter = length;
    if (length > 16 && memchr(from, '.', length) && spl_decimal_parse(from, &value) == end)
        shorter = strlen(spl_decimal_print(value, text));
    if (shorter >= length) {
        memmove(out, from, length);
        return out + length;
    }
    memcpy(out, text, shorter);
    return out + shorter;
}

static bool is_of_number(char c)
{
    return (c >= '0' && c <= '9') || c == '-' || c == '+' || c == '.' || c == 'e' || c == 'E';
}

/* Byte by byte: lists are megabytes of short texts, for each of which strcspn() would make its table anew. */
char *spl_decimal_shorten(char *json)
{
    const char *at = json;
    char *out = json;
    bool quoted = false;
    while (at && *at) {
        if (!quoted && (*at == '-' || (*at >= '0' && *at <= '9'))) {
            const char *end = at;
            while (is_of_number(*end))
                end++;
            out = shorten(at, end, out);
            at = end;
            continue;
        }
        if (quoted && *at == '\\' && at[1])
            *out++ = *at++;
        else if (*at == '"')
            quoted = !quoted;
        *out++ = *at++;
    }
    if (out)
        *out = '\0';
    return json;
}
