/* Where most of the values of an axis lie, whatever a few of them say: heights of -9999 that mean none, a coordinate of
 * zero, birds. */
#ifndef SPL_PACK_BULK_H
#define SPL_PACK_BULK_H

#include <stddef.h>

/* Brings `values`, at least one and none NaN, into an order whose first and last twentieth are sorted, with what lies
 * between them between. Returns how wide that is. Pure. */
double spl_bulk_order(double *values, size_t count);

/* Of values in that order the first and the last that count: without the outermost `left_out` at either end, of which
 * twentieths have more, and without what lies beyond a gap wider than `gap` within a twentieth of them. */
void spl_bulk_find(const double *values, size_t count, size_t left_out, double gap, size_t *first, size_t *last);

#endif
