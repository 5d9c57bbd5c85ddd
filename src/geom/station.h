/* Where a scanner stood, as a pose in a file says it: 16 numbers, row-major, station to world. Pure functions, any
 * thread. */
#ifndef SPL_GEOM_STATION_H
#define SPL_GEOM_STATION_H

#include <stdbool.h>

/* The nearest rotation to three axes that are about orthonormal: matrices in text have six digits at times. False where
 * they are mirrored or bent; `r`, row-major, is of no use then. */
bool spl_rotation_straighten(double r[9]);

/* What is wrong with a pose, before anybody reads it: a number that is none, or that no coordinate can be, or a last
 * row that is not 0 0 0 1. NULL = nothing. */
const char *spl_station_judge(const double pose[16]);

/* Where somebody looks who stands there, level: unit vectors, `forward` at right angles to `up`, which is `about`, of
 * any length but zero. A scanner, whose z axis is within 45 degrees of upright or hanging, looks along its x axis; what
 * lies otherwise is a camera, x right, y down, and looks along z. Axes that are none (mirrored, bent) are taken for
 * those of the world. */
void spl_station_look(const double pose[16], const double about[3], double forward[3], double up[3]);

#endif
