/* The bound that people choose for primitives, against the scan it is for. */
#ifndef SPL_PACK_BOUND_H
#define SPL_PACK_BOUND_H

#include "pack/planes/planes.h"
#include "pack/points.h"

enum { SPL_BOUND_TEXT_MAX = 512 };

struct spl_bound {
    double error;  /* in units of the scan's coordinates; 0 = none is chosen: nothing to say */
    double unit_m; /* metres each, > 0 */
};

/* As soon as the scan's bounds are known. SPL_E_USAGE, field "error": a bound as large as the scan's own things. */
int spl_bound_check_size(const struct spl_bound *bound, const struct spl_points *points, struct spl_error *err);

/* Before planes are looked for. The same: one finer than any scan says where a surface lies. */
int spl_bound_check(const struct spl_bound *bound, const struct spl_points *points, struct spl_error *err);

/* What the user should know of a bound far from what the scan's noise asks for, once that has been measured; NULL:
 * nothing. Returns `text`. */
const char *spl_bound_find_doubt(const struct spl_bound *bound, const struct spl_planes *planes,
                                 char text[SPL_BOUND_TEXT_MAX]);

#endif
