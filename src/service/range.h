/* One byte range of RFC 9110. Pure, any thread. */
#ifndef SPL_SERVICE_RANGE_H
#define SPL_SERVICE_RANGE_H

#include <stdint.h>

enum spl_range { SPL_RANGE_ALL, SPL_RANGE_PART, SPL_RANGE_UNSATISFIABLE };

/* What the value of a Range header (may be NULL) asks of `size` bytes: PART with [*first, *first + *length) inside
 * them, UNSATISFIABLE for a range that begins behind them, ALL for no range, several, another unit and anything
 * malformed, which are ignored as RFC 9110 allows. */
enum spl_range spl_range_parse(const char *header, uint64_t size, uint64_t *first, uint64_t *length);

#endif
