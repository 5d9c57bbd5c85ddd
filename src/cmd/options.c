/* Numbers from the command line: all of the text must be the value, so "12abc", "", "1e999", "nan" and "0x10" are
 * refused here and nowhere else. Pure functions; any thread. */
#include "cmd/options.h"

#include <ctype.h>
#include <errno.h>
#include <inttypes.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "base/decimal.h"
#include "base/memory.h"
#include "geom/size.h"
#include "image/color.h"

int spl_cmd_parse_real(const char *option, const char *text, double min, double max, double *out, struct spl_error *err)
{
    double value;
    const char *end = spl_decimal_parse(text, &value);
    if (!end || *end || value < min || value > max)
        return spl_fail(err, SPL_E_USAGE, "%s takes a number from %g to %g, not '%s'", option, min, max, text);
    *out = value;
    return 0;
}

int spl_cmd_parse_count(const char *option, const char *text, uint64_t min, uint64_t max, uint64_t *out,
                        struct spl_error *err)
{
    char *end;
    errno = 0;
    uint64_t value = strtoull(text, &end, 10);
    const char *rest = end;
    if (isdigit((unsigned char)*text) && (*end == '.' || *end == 'e' || *end == 'E')) { /* "2e6" */
        double real = -1;
        rest = spl_decimal_parse(text, &real);
        value = real >= 0 && real <= 0x1p53 ? (uint64_t)real : 0;
        errno = (double)value == real ? 0 : ERANGE;
    }
    if (!isdigit((unsigned char)*text) || !rest || *rest || errno || value < min || value > max)
        return spl_fail(err, SPL_E_USAGE, "%s takes a whole number from %" PRIu64 " to %" PRIu64 ", not '%s'", option,
                        min, max, text);
    *out = value;
    return 0;
}

int spl_cmd_parse_bytes(const char *option, const char *text, uint64_t unit, uint64_t min, uint64_t max, uint64_t *out,
                        struct spl_error *err)
{
    uint64_t value;
    if (!spl_bytes_from_text(text, unit, &value) || value < min * unit || value / unit > max)
        return spl_fail(err, SPL_E_USAGE,
                        "%s takes a whole number from %" PRIu64 " to %" PRIu64 "%s, or bytes with K, M, G or T, not "
                        "'%s'",
                        option, min, max, unit == 1 ? "" : " MiB", text);
    *out = value;
    return 0;
}

int spl_cmd_parse_vector(const char *option, const char *text, double out[3], struct spl_error *err)
{
    const char *at = text;
    double value[3];
    for (int i = 0; i < 3; i++) {
        const char *end = spl_decimal_parse(at, &value[i]);
        if (!end || *end != (i < 2 ? ',' : 0))
            return spl_fail(err, SPL_E_USAGE, "%s takes three numbers X,Y,Z, not '%s'", option, text);
        at = end + 1;
    }
    for (int i = 0; i < 3; i++)
        out[i] = value[i];
    return 0;
}

static bool parse_side(const char **at, double *side)
{
    char *end = NULL;
    errno = 0;
    unsigned long value = isdigit((unsigned char)**at) ? strtoul(*at, &end, 10) : 0;
    if (!value || errno || value > UINT32_MAX)
        return false;
    *side = (double)value;
    *at = end;
    return true;
}

int spl_cmd_parse_size(const char *option, const char *text, uint32_t *width, uint32_t *height, struct spl_error *err)
{
    const double shape[2] = {*width, *height};
    const char *at = text;
    double size[2] = {0};
    bool good = *at == 'x' || parse_side(&at, &size[0]);
    if (good && *at == 'x') {
        at++;
        good = parse_side(&at, &size[1]);
    }
    if (!good || *at)
        return spl_fail(err, SPL_E_USAGE,
                        "%s takes WIDTHxHEIGHT in pixels, such as 1280x720, or one side, 1280 or x720, not '%s'",
                        option, text);
    spl_size_follow(size, shape);
    if (size[0] > UINT32_MAX || size[1] > UINT32_MAX)
        return spl_fail(err, SPL_E_USAGE, "%s %s makes an image of %.0f x %.0f pixels", option, text, size[0], size[1]);
    *width = (uint32_t)size[0];
    *height = (uint32_t)size[1];
    return 0;
}

int spl_cmd_parse_color(const char *option, const char *text, uint8_t out[4], struct spl_error *err)
{
    if (spl_color_from_text(text, out))
        return 0;
    return spl_fail(err, SPL_E_USAGE, "%s takes " SPL_COLOR_FORMS ", not '%s'", option, text);
}

void spl_cmd_print_wrapped(FILE *out, size_t used, size_t column, const char *text)
{
    enum { line_length = 112 };
    if (used + 2 > column)
        fputc('\n', out);
    fprintf(out, "%*s", (int)(used + 2 > column ? column : column - used), "");
    size_t at = column;
    for (bool first = true; *text; first = false) {
        size_t blanks = strspn(text, " "), word = strcspn(text + blanks, " "), width = 0;
        for (size_t i = 0; i < word; i++)
            width += ((unsigned char)text[blanks + i] & 0xc0) != 0x80; // of UTF-8
        if (!first && at + 1 + width > line_length) {
            fprintf(out, "\n%*s", (int)column, "");
            at = column;
            first = true;
        }
        fprintf(out, "%s%.*s", first ? "" : " ", (int)word, text + blanks);
        at += width + !first;
        text += blanks + word;
    }
    fputc('\n', out);
}
