/* Neighbours that lie on the other side of a wall: seen from its other side, behind the surface that a point is of.
 * Where a side is scanned less densely than a wall is thick, a point's nearest ones are the other side's, and say
 * nothing of its own. */
#ifndef SPL_PACK_FACING_H
#define SPL_PACK_FACING_H

#include "pack/neighbours.h"

struct spl_facing {
    const struct spl_points *points;
    const struct spl_neighbours *neighbours;
    enum { SPL_FACING_UNKNOWN, SPL_FACING_STATIONS, SPL_FACING_NORMALS } from;
};

/* Both borrowed. Which side points are seen from is what their normals say, where all were given, else the stations of
 * those that have one; where there is but one station, and no normals, nothing ever lies behind. Before any normal is
 * estimated. */
struct spl_facing spl_facing_of(const struct spl_points *points, const struct spl_neighbours *neighbours);

/* `near`, what spl_neighbours_find() found for point i and k, without what lies on the other side, and with the next
 * nearest of this side in its place, as far as they are near enough. Any thread; depends on the points alone. */
void spl_facing_keep(const struct spl_facing *facing, size_t i, unsigned k, struct spl_nearest *near);

#endif
