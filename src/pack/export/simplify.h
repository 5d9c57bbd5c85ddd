/* Fewer vertices that say the same: Douglas and Peucker's, "Algorithms for the reduction of the number of points
 * required to represent a digitized line or its caricature", 1973. */
#ifndef SPL_PACK_EXPORT_SIMPLIFY_H
#define SPL_PACK_EXPORT_SIMPLIFY_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

/* Sets kept[i] of `count` >= 1 vertices: none that is left out lies farther than `tolerance` from the piece that is
 * drawn instead. Of a `ring`, whose last vertex is joined to the first, at least two are kept, else both ends. Returns
 * how many are kept. `stack` has room for 2 * count + 2 numbers. O(n log n) of what is usual, O(n^2) at worst. Any
 * thread. */
size_t spl_simplify(const double (*vertices)[3], size_t count, bool ring, double tolerance, uint8_t *kept,
                    size_t *stack);

#endif
