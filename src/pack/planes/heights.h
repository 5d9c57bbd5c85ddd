/* The relief of a smooth piece: its surface as heights over its plane, at any place.
 *
 * A grid over the plane, a few spacings of its points wide, has at each vertex near points the quadratic that fits the
 * points around it by moving least squares; between vertices the four around are blended (a partition of unity: Ohtake
 * et al., "Multi-level partition of unity implicits", 2003). So it is one surface without seams, wherever it is asked,
 * and what is flat or evenly curved comes out exactly. */
#ifndef SPL_PACK_PLANES_HEIGHTS_H
#define SPL_PACK_PLANES_HEIGHTS_H

#include <stddef.h>

#include "pack/planes/quadratic.h"
#include "pack/points.h"

struct spl_heights_vertex {
    int32_t column, row;
    double q[6]; /* about the vertex, in edges of the grid's squares */
};

struct spl_heights {
    double origin[3], u[3], v[3], normal[3]; /* its plane, as panels on it have it; u x v = normal */
    double edge;                             /* of the grid's squares */
    struct spl_heights_vertex *vertices;     /* owned */
    uint32_t count, mask;
    uint32_t *slots; /* hash of vertices: index + 1; owned */
};

/* The frame of panels on a plane of that normal: `relief` keeps the origin, and the normal as such panels decode it. */
void spl_heights_init(struct spl_heights *heights, const double origin[3], const double normal[3], double edge);
void spl_heights_finish(struct spl_heights *heights);

/* Fits the surface to points `member[0..count)`, twice: the second time without those that are off the first by more
 * than `bound[]` of each. Any thread. False: no memory. */
bool spl_heights_fit(struct spl_heights *heights, const struct spl_points *points, const uint32_t *member, size_t count,
                     const float *bound);

/* Where a point lies over the plane. */
void spl_heights_place(const struct spl_heights *heights, const struct spl_points *points, size_t i, double at[3]);

/* The surface's height over the plane at (x, y), and, unless NULL, its slope along u and v. Far from all points it goes
 * on as the nearest vertex has it. False: it is farther than `rings` squares from any vertex; *height is 0 then. */
bool spl_heights_get(const struct spl_heights *heights, double x, double y, int rings, double *height, double slope[2]);

/* Index of the vertex nearest to (at[0], at[1]); UINT32_MAX: there is none in that place. */
uint32_t spl_heights_vertex_at(const struct spl_heights *heights, const double at[2]);

/* How far point `i` is off the surface, across it; INFINITY where there is none, and where it is steeper than a piece
 * may be. normal[], unless NULL: of the surface there, unit; of the plane, where there is none. */
double spl_heights_off(const struct spl_heights *heights, const struct spl_points *points, size_t i, double normal[3]);

/* The same, and `at` is where the point lies over the plane; signed, above the surface > 0. */
double spl_heights_measure(const struct spl_heights *heights, const struct spl_points *points, size_t i, double at[3],
                           double normal[3]);

#endif
