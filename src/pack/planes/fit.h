/* The planes that the points of a small run lie on: one, or one a side of a thin wall. The room of pack/planes/. */
#ifndef SPL_PACK_PLANES_FIT_H
#define SPL_PACK_PLANES_FIT_H

#include <math.h>
#include <stdbool.h>
#include <stdint.h>

#include "pack/planes/moments.h"
#include "pack/points.h"

/* What lies on a plane, in units of the coordinates. */
struct spl_plane_limits {
    double bound; /* most distance of a point; INFINITY: as the points have it */
    double step;  /* most distance of the middle of some points that lie together: what is no noise */
    double noise; /* sigma of the scan; 0 = not known */
};

/* The limits all over a scan, whose noise grows with range: of each of `count` equal shares of its points. */
struct spl_plane_limits_list {
    struct spl_plane_limits *at; /* owned */
    uint32_t count;
    size_t points;
    double noise; /* sigma all over the scan */
    double own_bound; /* the largest that follows from noise and spacing, whatever bound is given */
};

static inline const struct spl_plane_limits *spl_plane_limits_at(const struct spl_plane_limits_list *list, size_t point)
{
    return &list->at[(uint64_t)point * list->count / list->points];
}

/* A patch that bends: heights over its plane through the middle of its points. */
struct spl_curve {
    double origin[3], u[3], v[3], normal[3]; /* of the plane */
    double q[6];                             /* in units of `scale`; see quadratic.h */
    double scale;                            /* about half its width */
};

struct spl_patch {
    size_t first; /* point of its cell */
    struct spl_plane_moments moments;
    double normal[3];       /* unit, towards the side that its points were seen from */
    double rms;             /* of their distances */
    struct spl_curve curve; /* of spl_fit_curve(); then the normal is that amid its points */
};

enum { SPL_PATCH_POINTS = 20, SPL_FIT_PATCHES = 4 }; /* fewest points; most patches of a run */

/* One worker's; borrowed arrays of `room` elements, index 0 = point `base`. */
struct spl_fit {
    const struct spl_points *points;
    struct spl_plane_limits limits;
    size_t base;
    uint8_t *group;
    float *off;
    const uint32_t *taken; /* by point: those that have another value than SPL_NO_PLANE are left out, and what is found
                              may bend; NULL: all, and flat ones */
};

/* The side of a plane through point `i` that it was seen from: whether that of `normal`. The station tells; where there
 * is none, or it sees the plane along its edge, the point's own normal. */
static inline bool spl_plane_is_seen(const struct spl_points *p, size_t i, const double normal[3])
{
    const double edge_on = 0.02; /* sine of the angle between the ray and the plane */
    if (p->station && p->station[i] != SPL_NO_STATION) {
        const double *pose = p->stations[p->station[i]];
        double above = 0, squared = 0;
        for (int c = 0; c < 3; c++) {
            double d = pose[4 * c + 3] - spl_points_at(p, c, i);
            above += normal[c] * d;
            squared += d * d;
        }
        if (above * above > edge_on * edge_on * squared)
            return above > 0;
    }
    const float *own = p->normal[i];
    return own[0] * normal[0] + own[1] * normal[1] + own[2] * normal[2] >= 0;
}

static inline double spl_plane_distance(const struct spl_points *p, size_t i, const double origin[3],
                                        const double normal[3])
{
    return normal[0] * (spl_points_at(p, 0, i) - origin[0]) + normal[1] * (spl_points_at(p, 1, i) - origin[1]) +
           normal[2] * (spl_points_at(p, 2, i) - origin[2]);
}

/* Fits planes to points [begin, end), which lie within the fit's arrays. Returns how many it found, of which each has
 * SPL_PATCH_POINTS at least and all together nine tenths of the points; then fit->group[i - base] is 1 + the patch of
 * point i, or 0. 0 = the points are not flat enough; the groups mean nothing then. */
unsigned spl_fit_find(const struct spl_fit *fit, size_t begin, size_t end, struct spl_patch patches[SPL_FIT_PATCHES]);

/* Likewise where several planes meet: the one that most of the points without a label lie on, by their normals, which
 * tell planes apart where cells cannot. Then group is 1 of its points. For some hundreds of points. */
bool spl_fit_corner(const struct spl_fit *fit, size_t begin, size_t end, const uint32_t *label,
                    struct spl_patch *patch);

/* Of both: fits a plane to the `count` points of a group. True where it is flat: then those that are beyond the bound
 * have left the group. *layers: it is not, but makes two layers, by the signs of fit->off. */
bool spl_fit_group(const struct spl_fit *fit, size_t begin, size_t end, uint8_t group, size_t count,
                   struct spl_patch *patch, bool *layers);

/* Likewise one patch that bends, smoothly and by no more than 45 degrees either way, seen from one side: group is 1 of
 * its points (curve.c). */
bool spl_fit_curve(const struct spl_fit *fit, size_t begin, size_t end, struct spl_patch *patch);

/* The parts of it. Sums over the points of a group that are no farther off than `limit`. */
struct spl_plane_moments spl_fit_sum(const struct spl_fit *fit, size_t begin, size_t end, uint8_t group, double limit);

/* Group 1 becomes groups 1 and 2 by what side of `normal` it was seen from. */
void spl_fit_part_sides(const struct spl_fit *fit, size_t begin, size_t end, const double normal[3], size_t count[2]);

/* Whether the distances of a group make two heaps that are mixed. */
bool spl_fit_has_layers(const struct spl_fit *fit, size_t begin, size_t end, uint8_t group);

/* Whether next to no dozen of points that lie together is off the surface as a whole. With `drop` those that are leave
 * the group: a low step or a thin board on what is large and flat. */
bool spl_fit_is_even(const struct spl_fit *fit, size_t begin, size_t end, uint8_t group, double rms, bool drop);

/* Turns the patch's normal to the side of `normal`. */
void spl_patch_face(struct spl_patch *patch, const double normal[3]);

#endif
