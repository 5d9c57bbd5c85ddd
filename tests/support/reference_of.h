/* Which soft sphere layers speak of, in plain C: the counterpart of shaders/soft_of.comp. First, and the median of
 * express, in its fixed point, so that it is equal to the bit; the median of other models in doubles. */
#ifndef TEST_SUPPORT_REFERENCE_OF_H
#define TEST_SUPPORT_REFERENCE_OF_H

#include <splatd/soft.h>

#include "support/reference_soft.h"

/* What sample (x, y) finds of `count` items, which lie in the order of depth and ids, in front of depth word `solid`:
 * an index, UINT32_MAX where none. *doubt: how near another answer was, in optical depth; INFINITY where it is
 * exact. */
uint32_t soft_find(const struct spl_frame_params *params, const struct soft_item *items, uint32_t count, int x, int y,
                   uint32_t solid, const struct spl_soft_params *soft, double *doubt);

#endif
