/* Which fields of a scan are kept beside position, colour and normal: class, intensity and returns where there are any,
 * and what a user names. Pure. */
#ifndef SPL_CLOUD_KEEP_H
#define SPL_CLOUD_KEEP_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#include "base/error.h"

enum { SPL_KEPT_MAX = 8, SPL_KEPT_NAME = 32 };

struct spl_keep {
    bool none;      /* nothing but what is named */
    bool scan;      /* "scan" is named */
    uint32_t named; /* 1 << enum spl_column of those that have a column of their own */
    unsigned count;
    char names[SPL_KEPT_MAX][SPL_KEPT_NAME]; /* others, as they are written */
};

/* From "NAME,NAME,…", of which "none" leaves out what is kept unasked; NULL: that alone. SPL_E_USAGE, field "keep". */
int spl_keep_parse(struct spl_keep *keep, const char *list, struct spl_error *err);

/* The column that a field of this name fills, if none before it does (`taken`, 1 << column), else SKIP. `keep` may be
 * NULL. */
int spl_keep_find_column(const struct spl_keep *keep, uint32_t taken, const char *name, size_t length);

/* The first name for which there is no column among `columns`; NULL = all have one. Of "scan" no column knows. */
const char *spl_keep_find_missing(const struct spl_keep *keep, uint32_t columns);

#endif
