/* What strtod takes and people do not mean is refused here once: its result counts only where it has read to the end of
 * the decimal digits and no farther. Stateless; any thread. */
#include "base/decimal.h"

#include <math.h>
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

const char *spl_decimal_print(double value, char text[SPL_DECIMAL_TEXT])
{
    for (int count = 6; count <= 17; count++) {
        snprintf(text, SPL_DECIMAL_TEXT, "%.*g", count, value);
        if (strtod(text, NULL) == value)
            break;
    }
    return text;
}
