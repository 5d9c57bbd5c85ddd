/* "bytes=FIRST-LAST", "bytes=FIRST-", "bytes=-COUNT". Numbers too large for 64 bits are past the end like any other.
 * Pure, any thread. */
#include "service/range.h"

#include <ctype.h>
#include <errno.h>
#include <stdbool.h>
#include <stdlib.h>
#include <string.h>
#include <strings.h>

static bool take_number(const char **at, uint64_t *out)
{
    char *end;
    if (!isdigit((unsigned char)**at))
        return false;
    errno = 0;
    *out = strtoull(*at, &end, 10); // UINT64_MAX beyond its range
    *at = end;
    return true;
}

enum spl_range spl_range_parse(const char *header, uint64_t size, uint64_t *first, uint64_t *length)
{
    uint64_t from = 0, to = UINT64_MAX;
    *first = 0;
    *length = size;
    if (!header || strncasecmp(header, "bytes=", 6))
        return SPL_RANGE_ALL;
    const char *at = header + 6;
    bool has_from = take_number(&at, &from);
    if (*at++ != '-')
        return SPL_RANGE_ALL;
    bool has_to = take_number(&at, &to);
    if (*at || (!has_from && !has_to) || (has_from && has_to && to < from))
        return SPL_RANGE_ALL;
    if (!has_from) {
        if (!to || !size)
            return SPL_RANGE_UNSATISFIABLE;
        *first = to < size ? size - to : 0;
        *length = size - *first;
        return SPL_RANGE_PART;
    }
    if (from >= size)
        return SPL_RANGE_UNSATISFIABLE;
    *first = from;
    *length = (has_to && to < size ? to + 1 : size) - from;
    return SPL_RANGE_PART;
}
