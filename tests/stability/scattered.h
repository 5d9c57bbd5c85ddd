/* Points that lie where chance puts them, or a scanner's directions do, with a truth of their own: what screen-space
 * filling has to tell apart by the points' spacing alone. */
#ifndef STABILITY_SCATTERED_H
#define STABILITY_SCATTERED_H

#include "world.h"

enum scattered {
    SCATTERED_NOISE,   /* a sheet of 4 m by 3 m, upright, along x, around the origin: 100,000 points 11 mm apart, moved
                          before and behind it by noise of 30 mm */
    SCATTERED_STRAYS,  /* the sheet, 7500 points 40 mm apart on it, and 50 in the 3 m before it: balls of 3 mm */
    SCATTERED_SWARM,   /* 5000 of them */
    SCATTERED_GROUND,  /* level ground of 40 m by 60 m, y = 0 to 60 m, 40 points a square metre */
    SCATTERED_HORIZON, /* level ground of 2 km around, a ball 0.2 m from (0, 0, 1.6 m), posts at 2, 20 and 200 m, a
                          wall at 2 km, scanned from (0.4, -0.3, 1.9 m) in steps of 0.6 degrees */
    SCATTERED_COUNT
};

/* To be looked at along +y. */
void world_init_scattered(struct world *world, enum scattered what);

#endif
