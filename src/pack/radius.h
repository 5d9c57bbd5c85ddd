/* Normal and radius of one point from its neighbours. */
#ifndef SPL_PACK_RADIUS_H
#define SPL_PACK_RADIUS_H

#include "pack/facing.h"

/* What a point's neighbours sum up to, relative to the point. */
struct spl_moments {
    float count, sum[3], square[6]; /* xx xy xz yy yz zz; the point itself counts and adds nothing */
    float unused[2];                /* vectors are read whole */
};

struct spl_moments spl_moments_of(const struct spl_points *points, size_t i, const struct spl_nearest *near);

/* What is known of a run of points [begin, end) before their radii are made. */
struct spl_vicinity {
    const struct spl_points *points;
    const struct spl_neighbours *neighbours;
    size_t begin, end;
    const struct spl_moments *moments; /* one a point of the run */
    const uint32_t *lists;             /* k neighbours a point of the run, unused ones UINT32_MAX */
    const struct spl_facing *facing;   /* neighbours lie on a point's own side */
    unsigned k, wide;                  /* neighbours that are listed, and that are asked for where those do not tell */
};

/* How the points around one are spread. */
struct spl_spread {
    double sigma[3];  /* ascending */
    double normal[3]; /* of the least */
};

/* Of some points in a row: what their neighbours say, and, where that is no plane and no line, theirs too. */
enum { SPL_SPREADS = 64 };
struct spl_spreads {
    struct spl_spread own[SPL_SPREADS], wide[SPL_SPREADS];
};
void spl_radius_spread(const struct spl_vicinity *vicinity, size_t begin, size_t end, struct spl_spreads *spreads);

/* Whether a point's surface may end or turn there: the points around do not lie flat, or are asked for widely, and a
 * quarter of the plane holds none of them. */
enum spl_edge { SPL_EDGE_NONE, SPL_EDGE_LIKELY, SPL_EDGE_ASKED };

/* Radius of point i of the run, which has `reach` to its farthest listed neighbour, from its two spreads; its normal,
 * of either sign; and how round its surroundings are, from 0 (a surface or a line) to 1 (a volume); whether it lies at
 * an edge: SPL_EDGE_ASKED where near[0] holds the wide neighbours of i afterwards. `near` is scratch for searches in
 * order, for wide and for the widest views. */
double spl_radius_estimate(const struct spl_vicinity *vicinity, size_t i, const struct spl_spread *own,
                           const struct spl_spread *around, double reach, struct spl_nearest near[2], double normal[3],
                           double *round, enum spl_edge *edge);

/* Whether a wider view of point i shows a surface that goes on all around it. `near` as above. */
bool spl_radius_on_surface(const struct spl_vicinity *vicinity, size_t i, struct spl_nearest near[2]);

#endif
