/* The middle of a sample. */
#ifndef SPL_PACK_MEDIAN_H
#define SPL_PACK_MEDIAN_H

#include <stddef.h>

/* Entry count / 2 of `values` (at least one), which are sorted in place. Pure. */
float spl_median(float *values, size_t count);

#endif
