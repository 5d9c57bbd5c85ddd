/* What lies on the other side is told by the plane through those neighbours that the point's own station saw: the other
 * side's stations are behind it, however aslant they look, and so are their points, by more than the surface is thick.
 * What two stations see of one floor does not lie behind, whichever way they look. Where normals were given, the
 * point's own is the plane's. Leaves lie within the thickness of theirs and wires have none: they keep their
 * neighbours. */
#include "pack/facing.h"

#include <math.h>
#include <string.h>

#include "geom/eigen.h"

static const double opposite = -0.7; /* cosine between normals of two sides */
static const double sheet = 0.3;     /* sigma_0 / sigma_1 below which all neighbours are of one side */
static const double no_line = 0.15;  /* sigma_1 / sigma_2 of a surface at least; radius.c's */
static const double behind = 0.7;    /* slope out of the plane from which a neighbour lies behind it */
static const double thick = 4;       /* times sigma_0 */
static const double near_enough = 8; /* times the distance of the k-th point of any side */
/* Neighbours that give a plane, that are asked for where they are fewer, that are better than those of another side. */
enum { enough = 5, asked = 8, least = 3 };

/* The side that point i is of, while others are held against it. */
struct side {
    const struct spl_facing *facing;
    size_t point;
    double at[3], seen[3]; /* the direction that it is seen from, or its normal; not of unit length */
    double normal[3];      /* of the plane, to where it is seen from */
    double depth, slope;   /* behind by more than so much, and so much of its distance */
};

struct spl_facing spl_facing_of(const struct spl_points *p, const struct spl_neighbours *neighbours)
{
    struct spl_facing facing = {p, neighbours, SPL_FACING_NORMALS};
    for (size_t i = 0; i < p->count && facing.from == SPL_FACING_NORMALS; i++)
        if (p->normal[i][0] == 0 && p->normal[i][1] == 0 && p->normal[i][2] == 0)
            facing.from = p->station && p->station_count > 1 ? SPL_FACING_STATIONS : SPL_FACING_UNKNOWN;
    return facing;
}

/* Where point i, at `at`, is seen from; false: nobody knows. */
static inline bool find_seen(const struct spl_facing *f, size_t i, const double at[3], double seen[3])
{
    const struct spl_points *p = f->points;
    if (f->from == SPL_FACING_NORMALS) {
        for (int c = 0; c < 3; c++)
            seen[c] = (double)p->normal[i][c];
        return true;
    }
    if (p->station[i] == SPL_NO_STATION)
        return false;
    for (int c = 0; c < 3; c++)
        seen[c] = p->stations[p->station[i]][4 * c + 3] - at[c];
    return true;
}

static inline double dot(const double a[3], const double b[3])
{
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
}

/* Whether the cosine between two directions is below `cosine`. */
static inline bool is_below(const double a[3], const double b[3], double cosine)
{
    return dot(a, b) < cosine * sqrt(dot(a, a) * dot(b, b));
}

static bool is_of_station(const void *context, size_t j)
{
    const struct side *side = context;
    const uint16_t *station = side->facing->points->station;
    return station[j] == station[side->point];
}

/* How far point j of the other side lies behind the plane; 0: it is of this side. */
static double find_behind(const struct side *side, size_t j)
{
    const struct spl_facing *f = side->facing;
    double at[3], seen[3], apart[3];
    spl_points_place(f->points, j, at);
    for (int c = 0; c < 3; c++)
        apart[c] = at[c] - side->at[c];
    const double depth = -dot(side->normal, apart);
    if (depth <= side->depth || depth * depth <= side->slope * side->slope * dot(apart, apart) ||
        !find_seen(f, j, at, seen))
        return 0;
    const bool other =
        f->from == SPL_FACING_NORMALS ? is_below(side->seen, seen, opposite) : dot(side->normal, seen) < 0;
    return other ? depth : 0;
}

static bool is_of_side(const void *context, size_t j)
{
    return find_behind(context, j) <= 0;
}

/* The spread of the point and its neighbours, or those of its station alone: xx xy xz yy yz zz; false: these are too
 * few for a plane. */
static bool find_spread(const struct side *side, const struct spl_nearest *near, bool own, double m[6])
{
    static const int row[6] = {0, 0, 0, 1, 1, 2}, column[6] = {0, 1, 2, 1, 2, 2};
    double sum[3] = {0}, n = 1;
    memset(m, 0, 6 * sizeof *m);
    for (unsigned a = 0; a < near->count; a++) {
        double d[3];
        if (near->index[a] == side->point || (own && !is_of_station(side, near->index[a])))
            continue;
        spl_points_apart(side->facing->points, side->at, near->index[a], d);
        n++;
        for (int c = 0; c < 3; c++)
            sum[c] += d[c];
        for (int e = 0; e < 6; e++)
            m[e] += d[row[e]] * d[column[e]];
    }
    for (int e = 0; e < 6; e++)
        m[e] = m[e] / n - sum[row[e]] * sum[column[e]] / (n * n);
    return n > enough;
}

/* Whether points of this spread lie in one sheet, by what its eigenvalues sum up and multiply to: far quicker than they
 * are found. */
static bool is_sheet(const double m[6])
{
    const double trace = m[0] + m[3] + m[5];
    const double pairs = m[0] * m[3] - m[1] * m[1] + m[0] * m[5] - m[2] * m[2] + m[3] * m[5] - m[4] * m[4];
    const double all =
        m[0] * (m[3] * m[5] - m[4] * m[4]) - m[1] * (m[1] * m[5] - m[4] * m[2]) + m[2] * (m[1] * m[4] - m[3] * m[2]);
    return all * trace < sheet * sheet * pairs * pairs;
}

/* The plane of a spread, which looks to where the point is seen from; false: it is a line. */
static bool fit(struct side *side, const double m[6])
{
    double sigma[3], most[3];
    spl_eigen_symmetric(m, sigma, side->normal, most);
    for (int c = 0; c < 3; c++)
        sigma[c] = sqrt(fmax(sigma[c], 0));
    const double sign = dot(side->normal, side->seen) < 0 ? -1 : 1;
    for (int c = 0; c < 3; c++)
        side->normal[c] *= sign;
    side->depth = thick * sigma[0];
    return sigma[1] > no_line * sigma[2];
}

/* The plane of a point's side, through what its station saw of the neighbours that are there, or farther away; false:
 * there is none. */
static bool find_plane(struct side *side, const struct spl_nearest *near)
{
    double m[6];
    if (side->facing->from == SPL_FACING_NORMALS) {
        const double length = sqrt(dot(side->seen, side->seen));
        for (int c = 0; c < 3; c++)
            side->normal[c] = side->seen[c] / length;
        return true;
    }
    if (find_spread(side, near, true, m) && fit(side, m))
        return true;
    struct spl_nearest farther;
    spl_neighbours_find_some(side->facing->neighbours, side->point, asked, near->farthest, near_enough, is_of_station,
                             side, &farther);
    return find_spread(side, &farther, false, m) && fit(side, m);
}

/* Whether the point's neighbours are no sheet of one side, and some are another station's. */
static bool may_lie_behind(const struct side *side, const struct spl_nearest *near)
{
    bool others = side->facing->from == SPL_FACING_NORMALS;
    double m[6];
    for (unsigned a = 0; a < near->count && !others; a++)
        others = !is_of_station(side, near->index[a]);
    if (!others)
        return false;
    find_spread(side, near, false, m);
    return !is_sheet(m);
}

/* Whether point j, so deep behind the side, is of a sheet along it, and the two clear of each other however rough they
 * are: of a face around an edge it is not. */
static bool is_along(const struct side *side, size_t j, double depth, const struct spl_nearest *near)
{
    struct side other = {.facing = side->facing, .point = j};
    if (side->facing->from == SPL_FACING_NORMALS)
        return true; /* its normal has said so */
    spl_points_place(side->facing->points, j, other.at);
    find_seen(side->facing, j, other.at, other.seen);
    return find_plane(&other, near) && dot(side->normal, other.normal) < opposite && depth > side->depth + other.depth;
}

void spl_facing_keep(const struct spl_facing *facing, size_t i, unsigned k, struct spl_nearest *near)
{
    struct side side = {.facing = facing, .point = i, .slope = behind};
    double depth = INFINITY;
    uint32_t first = 0;
    if (facing->from == SPL_FACING_UNKNOWN)
        return;
    spl_points_place(facing->points, i, side.at);
    if (!find_seen(facing, i, side.at, side.seen) || !may_lie_behind(&side, near) || !find_plane(&side, near))
        return;
    for (unsigned a = 0; a < near->count; a++) {
        const double at = find_behind(&side, near->index[a]);
        if (at > 0 && at < depth) {
            depth = at;
            first = near->index[a];
        }
    }
    if (!(depth < INFINITY) || !is_along(&side, first, depth, near))
        return;
    side.depth = depth / 2; /* of that sheet, however far aside */
    side.slope = 0;
    struct spl_nearest own;
    spl_neighbours_find_some(facing->neighbours, i, k, near->farthest, near_enough, is_of_side, &side, &own);
    if (own.count < least)
        return;
    near->count = own.count;
    near->farthest = own.farthest;
    memcpy(near->index, own.index, own.count * sizeof *own.index);
    memcpy(near->squared, own.squared, own.count * sizeof *own.squared);
}
