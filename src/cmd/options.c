/* Numbers from the command line: all of the text must be the value, so "12abc", "", "1e999" and "nan" are refused here
 * and nowhere else. Pure functions; any thread. */
#include "cmd/options.h"

#include <ctype.h>
#include <errno.h>
#include <inttypes.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

int spl_cmd_parse_real(const char *option, const char *text, double min, double max, double *out,
                       struct spl_error *err)
{
    char *end;
    double value = strtod(text, &end);
    if (end == text || *end || !isfinite(value) || value < min || value > max)
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
    if (!isdigit((unsigned char)*text) || *end || errno || value < min || value > max)
        return spl_fail(err, SPL_E_USAGE, "%s takes a whole number from %" PRIu64 " to %" PRIu64 ", not '%s'", option,
                        min, max, text);
    *out = value;
    return 0;
}

int spl_cmd_parse_vector(const char *option, const char *text, double out[3], struct spl_error *err)
{
    const char *at = text;
    double value[3];
    for (int i = 0; i < 3; i++) {
        char *end;
        value[i] = strtod(at, &end);
        if (end == at || !isfinite(value[i]) || *end != (i < 2 ? ',' : 0))
            return spl_fail(err, SPL_E_USAGE, "%s takes three numbers X,Y,Z, not '%s'", option, text);
        at = end + 1;
    }
    for (int i = 0; i < 3; i++)
        out[i] = value[i];
    return 0;
}

int spl_cmd_parse_size(const char *option, const char *text, uint32_t *width, uint32_t *height,
                       struct spl_error *err)
{
    char *middle, *end = NULL;
    errno = 0;
    unsigned long w = strtoul(text, &middle, 10), h = 0;
    if (*middle == 'x' && isdigit((unsigned char)middle[1]))
        h = strtoul(middle + 1, &end, 10);
    if (!isdigit((unsigned char)*text) || !end || *end || errno || w < 1 || h < 1 || w > UINT32_MAX || h > UINT32_MAX)
        return spl_fail(err, SPL_E_USAGE, "%s takes WIDTHxHEIGHT in pixels, such as 1280x720, not '%s'", option,
                        text);
    *width = (uint32_t)w;
    *height = (uint32_t)h;
    return 0;
}

int spl_cmd_parse_color(const char *option, const char *text, uint8_t out[4], struct spl_error *err)
{
    unsigned char rgba[4] = {0, 0, 0, 255};
    size_t digits = text[0] == '#' ? strspn(text + 1, "0123456789abcdefABCDEF") : 0;
    if (!strcmp(text, "transparent"))
        rgba[3] = 0;
    else if ((digits != 6 && digits != 8) || text[1 + digits])
        return spl_fail(err, SPL_E_USAGE, "%s takes #rrggbb, #rrggbbaa or transparent, not '%s'", option, text);
    else
        sscanf(text, "#%2hhx%2hhx%2hhx%2hhx", &rgba[0], &rgba[1], &rgba[2], &rgba[3]);
    memcpy(out, rgba, sizeof rgba);
    return 0;
}
