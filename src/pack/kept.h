/* What of a scan's fields a dataset keeps: the list that a user gives, held against what datasets have anyway and
 * against what the scans have; names and units of the streams that come of it. */
#ifndef SPL_PACK_KEPT_H
#define SPL_PACK_KEPT_H

#include "pack/scalars.h"
#include "pack/scans.h"

/* spl_keep_parse(), and refuses names that other attributes of a dataset have. */
int spl_kept_read(struct spl_keep *keep, const char *list, struct spl_error *err);

/* SPL_E_USAGE where a field is named that no scan has. */
int spl_kept_check(const struct spl_scans *scans, struct spl_error *err);

/* Of the scalars of struct spl_points: borrowed from `keep`, or static. */
const char *spl_kept_name(const struct spl_keep *keep, int scalar);
const char *spl_kept_unit(const char *name);

/* Is it named, so that it is kept even where all points have the same? */
bool spl_kept_is_named(const struct spl_keep *keep, int scalar);

/* Do points know the number of their scan? Of the station where any scan has stations, else of the input. */
bool spl_kept_has_scan(const struct spl_scans *scans, bool *stations);

#endif
