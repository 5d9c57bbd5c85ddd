/* Points far off all others: a zero coordinate in a scan of the world, an echo from a cloud. */
#ifndef SPL_PACK_STRAYS_H
#define SPL_PACK_STRAYS_H

#include "pack/points.h"

enum { SPL_STRAYS_TEXT_MAX = 400 };

/* Says in `text` where nearly all points lie and how far the others are, if that is far beyond; false: it is not, or
 * there is no memory. Needs ordered points. */
bool spl_strays_find(const struct spl_points *points, char text[SPL_STRAYS_TEXT_MAX]);

#endif
