/* Points far off all others: a zero coordinate in a scan of the world, an echo from a cloud. */
#ifndef SPL_PACK_STRAYS_H
#define SPL_PACK_STRAYS_H

#include "pack/points.h"

enum { SPL_STRAYS_TEXT_MAX = 400 };

/* Says in `text` where nearly all points lie and how far the others are, if that is far beyond; false: it is not, or
 * there is no memory. Needs ordered points. */
bool spl_strays_find(const struct spl_points *points, char text[SPL_STRAYS_TEXT_MAX]);

/* The same of points that are not kept, batch by batch, in whatever order. Zeroed before the first one. */
struct spl_strays {
    double *sample;  // x, y, z of places, each once, and room for one more; NULL: nothing added
    uint32_t *slots; // 1 + its number in the sample, by a place's hash
    size_t count;
    unsigned halved; // the sample has one place of 2^halved
};

void spl_strays_add(struct spl_strays *strays, const struct spl_point_batch *batch);

/* `min` and `max` are those of all that was added, which is forgotten. */
bool spl_strays_tell(struct spl_strays *strays, const double min[3], const double max[3],
                     char text[SPL_STRAYS_TEXT_MAX]);

#endif
