/* Normal and radius of one point from its neighbours (soft-transparency paper, eq. 20).
 *
 * The radius is eq. 20 with the square that its unit asks for, r = 2 sqrt(max |pi - pj|^2 / K): right amid a surface.
 * Elsewhere it would make blobs or leave gaps, so the neighbours' spread (sigma_0 <= sigma_1 <= sigma_2, from the
 * normal's PCA) changes it:
 * - along a line (a wire) the share of a point is a length: the disc reaches over the next point. Neighbours of two
 * wires beside each other look like a surface's: the search for lines sees farther, and bounds it (linear_pieces.c);
 * - in a volume (foliage) a disc does not stand for the surface between its neighbours, most of which are on other
 * leaves: it takes what its nearest ones say, as spread grows round. A noisy surface looks like a volume too: the
 * neighbours' neighbours tell, as noise fades in a wider view, and give the normal where they show a surface;
 * - at a border a disc of full size would stick out: it is as small as the discs behind it allow;
 * - scan lines are often denser than they are apart, or come in bundles: then the neighbours lie along a line, or all
 * on one side. Where several stations' points lie over each other they fall at random, and leave empty places that no
 * disc of a mean size reaches into. So the radius reaches towards the nearest point in each direction that has one;
 * where a quarter of the surface holds none of the neighbours, more are asked, and what is empty then counts as a
 * border: neighbours that fill half a disc are that much closer.
 *
 * Pure functions of the points; any thread. */
#include "pack/radius.h"

#include <math.h>
#include <string.h>

#include "geom/eigen.h"

#define SPL_INLINE static inline __attribute__((always_inline))

static const double linear_below = 0.15;                /* sigma_1 / sigma_2 */
static const double coplanar = 0.25;                    /* slope within which a far point continues a surface */
static const double round_from = 0.25, round_to = 0.75; /* sigma_0 / sigma_1 where a surface ends and a volume begins */
static const double volume_from = 0.4;                  /* roundness from which all of a radius is that of a volume */
static const double fades = 0.8, lasts = 1.2; /* growth of sigma_0 / sigma_1 over a wider view: noise, a volume */
static const double in_volume = 0.6, at_border = 0.6, along_border = 0.8; /* of a radius amid a surface */
static const double well_within = 0.8; /* of a wide view, where it is no border's: nearest point in each quarter */
static const int row[6] = {0, 0, 0, 1, 1, 2}, column[6] = {0, 1, 2, 1, 2, 2};

struct spl_moments spl_moments_of(const struct spl_points *p, size_t i, const struct spl_nearest *near)
{
    double at[3], sum[3] = {0}, m[6] = {0};
    spl_points_place(p, i, at);
    for (unsigned a = 0; a < near->count; a++) {
        double d[3];
        spl_points_apart(p, at, near->index[a], d);
        for (int c = 0; c < 3; c++)
            sum[c] += d[c];
        m[0] += d[0] * d[0];
        m[1] += d[0] * d[1];
        m[2] += d[0] * d[2];
        m[3] += d[1] * d[1];
        m[4] += d[1] * d[2];
        m[5] += d[2] * d[2];
    }
    struct spl_moments moments = {.count = (float)near->count + 1};
    for (int c = 0; c < 3; c++)
        moments.sum[c] = (float)sum[c];
    for (int e = 0; e < 6; e++)
        moments.square[e] = (float)m[e];
    return moments;
}

/* Moments as vectors: of count and sums, and of squares. */
typedef float spl_four __attribute__((vector_size(16), aligned(4), may_alias));
typedef float spl_eight __attribute__((vector_size(32), aligned(4), may_alias));
/* What begins with a count, by the rows and the columns of squares. */
#define BY_ROW(v) __builtin_shufflevector(v, v, 1, 1, 1, 2, 2, 3, 0, 0)
#define BY_COLUMN(v) __builtin_shufflevector(v, v, 1, 2, 3, 2, 3, 3, 0, 0)

/* The moments of point i and of its neighbours within the block together, about point i: a wider view at little cost.
 */
SPL_INLINE void widen_any(const struct spl_vicinity *v, size_t i,
                                                            struct spl_moments *out)
{
    const struct spl_points *p = v->points;
    const uint32_t *list = v->lists + (i - v->begin) * v->k;
    double at[3], d[3];
    spl_points_place(p, i, at);
    *out = v->moments[i - v->begin];
    spl_four sums = *(const spl_four *)&out->count;
    spl_eight squares = *(const spl_eight *)out->square;
    for (unsigned a = 0; a < v->k && list[a] != UINT32_MAX; a++) {
        size_t j = list[a];
        if (j < v->begin || j >= v->end)
            continue;
        const struct spl_moments *m = &v->moments[j - v->begin];
        spl_points_apart(p, at, j, d);
        const spl_eight apart = {0, (float)d[0], (float)d[1], (float)d[2]};
        const spl_eight of = *(const spl_eight *)&m->count;
        const spl_eight row_apart = BY_ROW(apart), column_apart = BY_COLUMN(apart);
        sums += *(const spl_four *)&m->count + m->count * (spl_four){apart[0], apart[1], apart[2], apart[3]};
        squares += *(const spl_eight *)m->square + row_apart * BY_COLUMN(of) + BY_ROW(of) * column_apart +
                   m->count * row_apart * column_apart;
    }
    *(spl_four *)&out->count = sums;
    *(spl_eight *)out->square = squares;
}

#if defined(__x86_64__)
__attribute__((target("avx2"))) static void widen_avx2(const struct spl_vicinity *v, size_t i, struct spl_moments *out)
{
    widen_any(v, i, out);
}
#endif

/* Compiled twice; contraction is off, so both give the same bits. */
static void widen(const struct spl_vicinity *v, size_t i, struct spl_moments *out)
{
#if defined(__x86_64__)
    if (__builtin_cpu_supports("avx2")) {
        widen_avx2(v, i, out);
        return;
    }
#endif
    widen_any(v, i, out);
}

/* Neither is NaN, which fmin() and fmax() look for. */
static double smaller(double a, double b)
{
    return a < b ? a : b;
}

static double larger(double a, double b)
{
    return a > b ? a : b;
}

static struct spl_spread spread_of(const struct spl_moments *moments)
{
    double m[6], n = moments->count, most[3];
    struct spl_spread spread;
    for (int e = 0; e < 6; e++)
        m[e] = moments->square[e] / n - (double)moments->sum[row[e]] * moments->sum[column[e]] / (n * n);
    spl_eigen_symmetric(m, spread.sigma, spread.normal, most);
    for (int c = 0; c < 3; c++)
        spread.sigma[c] = sqrt(larger(spread.sigma[c], 0));
    return spread;
}

/* The same of up to SPL_EIGEN_LANES moments. */
static void spread_some(const struct spl_moments *const moments[], unsigned count, struct spl_spread *const spreads[])
{
    enum { lanes = SPL_EIGEN_LANES };
    double m[6][lanes] = {0}, sum[3][lanes] = {0}, n[lanes], sigma[3][lanes], normal[3][lanes];
    if (count < 3) { /* eight at once take as long as two or three */
        for (unsigned a = 0; a < count; a++)
            *spreads[a] = spread_of(moments[a]);
        return;
    }
    for (unsigned a = 0; a < lanes; a++)
        n[a] = 1;
    for (unsigned a = 0; a < count; a++) {
        n[a] = moments[a]->count;
        for (int c = 0; c < 3; c++)
            sum[c][a] = moments[a]->sum[c];
        for (int e = 0; e < 6; e++)
            m[e][a] = moments[a]->square[e];
    }
    for (int e = 0; e < 6; e++)
        for (unsigned a = 0; a < lanes; a++)
            m[e][a] = m[e][a] / n[a] - sum[row[e]][a] * sum[column[e]][a] / (n[a] * n[a]);
    spl_eigen_symmetric_eight((const double(*)[lanes])m, sigma, normal);
    for (unsigned a = 0; a < count; a++)
        for (int c = 0; c < 3; c++) {
            spreads[a]->sigma[c] = sqrt(larger(sigma[c][a], 0));
            spreads[a]->normal[c] = normal[c][a];
        }
}

/* `count` neighbours, more than are listed, of the point's side as those. */
static void find_wide(const struct spl_vicinity *v, size_t i, unsigned count, struct spl_nearest *near)
{
    spl_neighbours_find(v->neighbours, i, count, near);
    spl_facing_keep(v->facing, i, count, near);
}

/* How many of `count` listed neighbours there are. */
SPL_INLINE unsigned count_listed(const uint32_t *neighbours, unsigned count)
{
    while (count && neighbours[count - 1] == UINT32_MAX)
        count--;
    return count;
}

/* Squared distance to the nearest of `count` points in each eighth of the plane across `normal`; infinity where none
 * is. Points that stand out of the plane by more than `slope` of their distance do not count. */
SPL_INLINE void eighths(const struct spl_points *p, size_t i, const uint32_t *neighbours, unsigned count,
                    const double normal[3], double slope, double nearest[8])
{
    /* any two axes across the normal, of equal length */
    int least = fabs(normal[0]) < fabs(normal[1]) ? 0 : 1;
    least = fabs(normal[2]) < fabs(normal[least]) ? 2 : least;
    int b = (least + 1) % 3, c = (least + 2) % 3;
    double at[3], x[3], y[3];
    spl_points_place(p, i, at);
    x[least] = 0, x[b] = normal[c], x[c] = -normal[b];
    y[least] = normal[b] * x[c] - normal[c] * x[b], y[b] = normal[c] * x[least] - normal[least] * x[c];
    y[c] = normal[least] * x[b] - normal[b] * x[least];
    for (int e = 0; e < 8; e++)
        nearest[e] = INFINITY;
    double d[3][SPL_NEIGHBOURS_MAX], squared[SPL_NEIGHBOURS_MAX];
    int64_t eighth[SPL_NEIGHBOURS_MAX];
    unsigned n = count_listed(neighbours, count);
    spl_points_list_apart(p, at, neighbours, n, d);
    for (unsigned a = 0; a < n; a++) {
        double u = d[0][a] * x[0] + d[1][a] * x[1] + d[2][a] * x[2];
        double v = d[0][a] * y[0] + d[1][a] * y[1] + d[2][a] * y[2];
        double h = d[0][a] * normal[0] + d[1][a] * normal[1] + d[2][a] * normal[2];
        double all = d[0][a] * d[0][a] + d[1][a] * d[1][a] + d[2][a] * d[2][a];
        squared[a] = h * h > slope * slope * all ? INFINITY : all;
        eighth[a] = (u > 0 ? 4 : 0) | (v > 0 ? 2 : 0) | (fabs(v) > fabs(u) ? 1 : 0);
    }
    for (unsigned a = 0; a < n; a++) {
        static const uint8_t turn[8] = {4, 5, 3, 2, 7, 6, 0, 1}; /* counted around */
        double *least_there = &nearest[turn[eighth[a]]];
        *least_there = squared[a] < *least_there ? squared[a] : *least_there;
    }
}

/* What the eighths say of a point's place. */
struct place {
    double gap;     /* largest distance to the nearest point in a quarter of the plane, of quarters that hold any */
    double filled;  /* share of the eighths that hold any */
    bool open;      /* a quarter is empty */
    bool on_line;   /* two opposite quarters are empty */
    bool one_sided; /* three eighths in a row are empty */
};

SPL_INLINE struct place place_of(const double nearest[8])
{
    struct place place = {0};
    double quarter[8];
    unsigned empty = 0;
    for (int e = 0; e < 8; e++) {
        double next = nearest[(e + 1) % 8];
        quarter[e] = nearest[e] < next ? nearest[e] : next;
        if (quarter[e] < INFINITY)
            place.gap = quarter[e] > place.gap ? quarter[e] : place.gap;
        else
            place.open = true;
        place.filled += nearest[e] < INFINITY ? 0.125 : 0;
        empty |= (unsigned)!(nearest[e] < INFINITY) << e;
    }
    empty |= empty << 8;
    place.one_sided = empty & empty >> 1 & empty >> 2;
    for (int e = 0; e < 4; e++)
        place.on_line |= !(quarter[e] < INFINITY) && !(quarter[e + 4] < INFINITY);
    place.gap = sqrt(place.gap);
    return place;
}

static bool is_linear(const struct spl_spread *spread)
{
    return spread->sigma[1] < linear_below * spread->sigma[2];
}

/* 0 on a surface or a line, 1 in a volume. */
static double roundness(const struct spl_spread *spread)
{
    if (is_linear(spread))
        return 0;
    double t = (spread->sigma[0] / spread->sigma[1] - round_from) / (round_to - round_from);
    t = smaller(1, larger(0, t));
    return t * t * (3 - 2 * t);
}

void spl_radius_spread(const struct spl_vicinity *v, size_t begin, size_t end, struct spl_spreads *spreads)
{
    struct spl_moments around[SPL_EIGEN_LANES];
    const struct spl_moments *from[SPL_EIGEN_LANES];
    struct spl_spread *to[SPL_EIGEN_LANES];
    unsigned count = 0;
    for (size_t i = begin; i < end; i++) {
        from[count] = &v->moments[i - v->begin];
        to[count++] = &spreads->own[i - begin];
        if (count == SPL_EIGEN_LANES || i + 1 == end) {
            spread_some(from, count, to);
            count = 0;
        }
    }
    for (size_t i = begin; i < end; i++) {
        if (roundness(&spreads->own[i - begin]) > 0) {
            widen(v, i, &around[count]);
            from[count] = &around[count];
            to[count++] = &spreads->wide[i - begin];
        }
        if (count == SPL_EIGEN_LANES || i + 1 == end) {
            spread_some(from, count, to);
            count = 0;
        }
    }
}

/* Eq. 20 over as few neighbours as two, the least of them all: what points of another leaf or wall do not enlarge. */
SPL_INLINE double least_radius(const struct spl_points *p, size_t i, const uint32_t *neighbours, unsigned count)
{
    double d[3][SPL_NEIGHBOURS_MAX], squared[SPL_NEIGHBOURS_MAX], within[SPL_NEIGHBOURS_MAX], least = INFINITY, at[3];
    spl_points_place(p, i, at);
    unsigned n = count_listed(neighbours, count);
    spl_points_list_apart(p, at, neighbours, n, d);
    for (unsigned a = 0; a < n; a++) {
        squared[a] = d[0][a] * d[0][a] + d[1][a] * d[1][a] + d[2][a] * d[2][a];
        within[a] = 0; /* neighbours as near as this one */
    }
    for (unsigned b = 0; b < n; b++)
        for (unsigned a = 0; a < n; a++)
            within[a] += squared[b] <= squared[a] ? 1 : 0;
    for (unsigned a = 0; a < n; a++) {
        double mean = within[a] >= 2 || n < 2 ? squared[a] / within[a] : INFINITY;
        least = mean < least ? mean : least;
    }
    return 2 * sqrt(least);
}

/* Do the points of a wide view lie on a surface? Its normal, and what the eighths say there. */
static bool shows_surface(const struct spl_vicinity *v, size_t i, const struct spl_nearest *near, double normal[3],
                          struct place *place)
{
    double nearest[8];
    struct spl_moments around = spl_moments_of(v->points, i, near);
    struct spl_spread wide = spread_of(&around);
    if (is_linear(&wide) || roundness(&wide) > 0)
        return false;
    memcpy(normal, wide.normal, sizeof wide.normal);
    eighths(v->points, i, near->index, near->count, normal, coplanar, nearest);
    *place = place_of(nearest);
    return true;
}

/* Is point i, whose row is all that a wide view shows, of a surface of rows that are farther apart? The widest view has
 * some on both sides then. No wire is asked: wires that hang side by side are no surface. */
static bool shows_rows(const struct spl_vicinity *v, size_t i, struct spl_nearest *widest, double normal[3],
                       struct place *place)
{
    if ((v->points->linear && v->points->linear[i]) || v->wide >= SPL_NEIGHBOURS_MAX)
        return false;
    find_wide(v, i, SPL_NEIGHBOURS_MAX, widest);
    return shows_surface(v, i, widest, normal, place) && !place->open;
}

/* Normal and radius of point i, which has `reach` to its farthest neighbour, and the roundness of its surroundings. */
SPL_INLINE double estimate_any(const struct spl_vicinity *v, size_t i, const struct spl_spread *spread,
                           const struct spl_spread *around, double reach, struct spl_nearest near[2], double normal[3],
                           double *round, enum spl_edge *edge)
{
    const struct spl_points *p = v->points;
    const uint32_t *list = v->lists + (i - v->begin) * v->k;
    double volume = 0, n = v->moments[i - v->begin].count - 1, radius = 2 * reach / sqrt(n), nearest[8];
    const bool linear = is_linear(spread);
    memcpy(normal, spread->normal, sizeof spread->normal);
    *round = roundness(spread);
    bool flat = *round <= 0;
    if (!flat) {
        double wide_round = roundness(around), thick = around->sigma[1] * spread->sigma[0];
        double growth = around->sigma[0] * spread->sigma[1] / (thick > 1e-300 ? thick : 1e-300);
        if (wide_round < *round) {
            memcpy(normal, around->normal, sizeof around->normal);
            *round = wide_round;
        }
        volume = smaller(1, *round / volume_from) * smaller(1, larger(0, (growth - fades) / (lasts - fades)));
    }
    if (volume > 0)
        radius = smaller(radius, radius + volume * (in_volume * least_radius(p, i, list, v->k) - radius));
    eighths(p, i, list, v->k, normal, 1, nearest);
    struct place place = place_of(nearest);
    *edge = !flat && place.open ? SPL_EDGE_LIKELY : SPL_EDGE_NONE; /* noise alone leaves no quarter empty */
    if (*round > 0.1)
        return radius;
    if (!linear && !place.open)
        return larger(radius, smaller(0.7 * place.gap, 2 * radius));

    find_wide(v, i, v->wide, near);
    if (linear) {
        double across[3];
        bool surface = shows_surface(v, i, near, across, &place) && !place.on_line;
        if (!surface && shows_rows(v, i, near + 1, across, &place)) {
            surface = true;
            near++;
            radius = 2 * near->farthest / sqrt(near->count);
        }
        if (!surface) /* a wire: its points are 2 reach / n apart */
            return smaller(radius, larger(1.5 * reach / n, 2 * spread->sigma[1]));
        memcpy(normal, across, sizeof across);
    }
    eighths(p, i, near->index, near->count, normal, coplanar, nearest);
    place = place_of(nearest);
    *edge = *edge || place.open ? SPL_EDGE_ASKED : SPL_EDGE_NONE;
    radius *= sqrt(larger(place.filled, 0.25));
    if (!place.one_sided)
        return larger(radius, smaller(0.65 * place.gap, 3 * radius));
    return smaller(larger(at_border * radius, smaller(0.5 * place.gap, 3 * radius)),
                   along_border * least_radius(p, i, list, v->k));
}

#if defined(__x86_64__)
__attribute__((target("avx2"))) static double
estimate_avx2(const struct spl_vicinity *v, size_t i, const struct spl_spread *spread, const struct spl_spread *around,
              double reach, struct spl_nearest near[2], double normal[3], double *round, enum spl_edge *edge)
{
    return estimate_any(v, i, spread, around, reach, near, normal, round, edge);
}
#endif

/* As widen(). */
double spl_radius_estimate(const struct spl_vicinity *v, size_t i, const struct spl_spread *spread,
                           const struct spl_spread *around, double reach, struct spl_nearest near[2], double normal[3],
                           double *round, enum spl_edge *edge)
{
#if defined(__x86_64__)
    if (__builtin_cpu_supports("avx2"))
        return estimate_avx2(v, i, spread, around, reach, near, normal, round, edge);
#endif
    return estimate_any(v, i, spread, around, reach, near, normal, round, edge);
}

bool spl_radius_on_surface(const struct spl_vicinity *v, size_t i, struct spl_nearest near[2])
{
    double normal[3];
    struct place place;
    find_wide(v, i, v->wide, near);
    if (shows_surface(v, i, near, normal, &place) && !place.open && place.gap < well_within * near->farthest)
        return true;
    struct spl_spread own = spread_of(&v->moments[i - v->begin]);
    return is_linear(&own) && shows_rows(v, i, near + 1, normal, &place);
}
