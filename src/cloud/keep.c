/* Names of fields that are kept. A name that only means a known column ("label") may be that of a field beside the one
 * that fills it, so it stays in the list: the first field takes the column, the other one what was named. Pure. */
#include "cloud/keep.h"

#include <string.h>
#include <strings.h>

#include "base/text.h"
#include "cloud/rows.h"

static bool is_name(const char *name, size_t length, const char *other, size_t other_length)
{
    return length == other_length && strncasecmp(name, other, length) == 0;
}

static bool is_kept_name(const char *kept, const char *name, size_t length)
{
    static const char prefix[] = "scalar_"; /* that CloudCompare writes */
    size_t skip = sizeof prefix - 1;
    if (is_name(name, length, kept, strlen(kept)))
        return true;
    return length > skip && strncasecmp(name, prefix, skip) == 0 &&
           is_name(name + skip, length - skip, kept, strlen(kept));
}

static int take_name(struct spl_keep *keep, const char *name, size_t length, struct spl_error *err)
{
    int column = spl_column_from_name(name, length);
    const char *own = spl_column_name(column);
    bool printable = true;
    for (size_t i = 0; i < length; i += spl_text_next(name + i, &printable))
        if (!printable)
            break;
    if (!printable)
        return spl_fail_field(err, SPL_E_USAGE, "keep",
                              "keep: a name has a control character, or another that cannot be shown");
    if (length == 0)
        return spl_fail_field(err, SPL_E_USAGE, "keep",
                              "keep: a name is empty; names lie between commas, as in \"gps_time,user_data\"");
    if (length >= SPL_KEPT_NAME)
        return spl_fail_field(err, SPL_E_USAGE, "keep", "keep: \"%.40s\" is longer than %d bytes", name,
                              SPL_KEPT_NAME - 1);
    if (is_name(name, length, "none", 4)) {
        keep->none = true;
    } else if (is_name(name, length, "scan", 4)) {
        keep->scan = true;
    } else if (column >= 0 && is_name(name, length, own, strlen(own))) {
        if (column < SPL_COLUMN_CLASS)
            return spl_fail_field(err, SPL_E_USAGE, "keep", "keep: %s is in every dataset; leave it out", own);
        keep->named |= 1u << column;
    } else {
        for (unsigned i = 0; i < keep->count; i++)
            if (is_name(name, length, keep->names[i], strlen(keep->names[i])))
                return spl_fail_field(err, SPL_E_USAGE, "keep", "keep: \"%s\" is named twice", keep->names[i]);
        if (keep->count == SPL_KEPT_MAX)
            return spl_fail_field(err, SPL_E_USAGE, "keep",
                                  "keep: more than %d names beside class, intensity, return_number, "
                                  "number_of_returns and scan",
                                  SPL_KEPT_MAX);
        memcpy(keep->names[keep->count], name, length);
        keep->names[keep->count++][length] = 0;
    }
    return SPL_OK;
}

int spl_keep_parse(struct spl_keep *keep, const char *list, struct spl_error *err)
{
    *keep = (struct spl_keep){0};
    for (const char *end = list; end; list = end + 1) {
        end = strchr(list, ',');
        int code = take_name(keep, list, end ? (size_t)(end - list) : strlen(list), err);
        if (code < 0)
            return code;
        if (!end)
            break;
    }
    return SPL_OK;
}

int spl_keep_find_column(const struct spl_keep *keep, uint32_t taken, const char *name, size_t length)
{
    int column = spl_column_from_name(name, length);
    if (column >= 0 && !(taken >> column & 1))
        return column;
    for (unsigned i = 0; keep && i < keep->count; i++)
        if (!(taken >> (SPL_COLUMN_KEPT + i) & 1) && is_kept_name(keep->names[i], name, length))
            return SPL_COLUMN_KEPT + (int)i;
    return SPL_COLUMN_SKIP;
}

const char *spl_keep_find_missing(const struct spl_keep *keep, uint32_t columns)
{
    for (int column = SPL_COLUMN_CLASS; column < SPL_COLUMN_KEPT; column++)
        if (keep->named >> column & 1 && !(columns >> column & 1))
            return spl_column_name(column);
    for (unsigned i = 0; i < keep->count; i++) {
        int known = spl_column_from_name(keep->names[i], strlen(keep->names[i]));
        if (!(columns >> (SPL_COLUMN_KEPT + i) & 1) && !(known >= 0 && columns >> known & 1))
            return keep->names[i];
    }
    return NULL;
}
