/* The middle of a sample. */
#ifndef SPL_PACK_MEDIAN_H
#define SPL_PACK_MEDIAN_H

#include <stddef.h>

/* Entry count / 2 of `values` (at least one), which are sorted in place. Pure. */
float spl_median(float *values, size_t count);

/* The same of up to SPL_MIDDLE_MAX values, none NaN, which stay as they are. Pure. */
enum { SPL_MIDDLE_MAX = 1024 };
float spl_middle(const float *values, size_t count);

/* The `nth` smallest, which comes to stand at its place, smaller ones before it, greater ones behind. None is NaN. */
double spl_nth(double *values, size_t count, size_t nth);

#endif
