/* The Pareto front of settings: those that no other one beats in time and in error. */
#ifndef SPL_MEASURE_FRONT_H
#define SPL_MEASURE_FRONT_H

#include <stdbool.h>
#include <stddef.h>

/* front[i] = true where no other entry has at most i's cost and at most i's error, and less of one of them. Entries
 * that are equal in both are on the front together. An entry whose cost or error is NaN is never on it and beats
 * nobody; infinities are ordinary. Less is better on both axes: hand over -PSNR. O(count²), no allocation, any thread.
 */
void spl_front_mark(const double *cost, const double *error, size_t count, bool *front);

#endif
