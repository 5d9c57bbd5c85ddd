/* A run of points that bends smoothly: a quadratic over its plane, by least squares, then again of what lies near. What
 * makes it smooth is what makes a plane flat (fit.c), with distances to the quadratic instead: nine tenths of the
 * points within the bound, sigma a small share of the width, each dozen of points that lie together near it, no two
 * layers. Foliage and noise fail it at every size; a step fails it until the step is between two cells. */
#include "pack/planes/fit.h"
#include "pack/planes/planes.h"

#include <string.h>

#include "pack/planes/quadratic.h"

enum { tries = 4, unknowns = 6 };
static const double most_share = 0.9; /* of the points, that lies within the bound and was seen from one side */
static const double flat_first = 0.5; /* sigma across the plane over the smaller one along it */
static const double smooth = 0.15;    /* sigma across the quadratic over it */
static const double narrow =
    0.15; /* the smaller sigma along the plane over the larger: a single scan line is no surface */
static const double most_slope = 1.1; /* against the plane */
static const double ridge = 1e-6;

static void get_place(const struct spl_fit *f, const struct spl_patch *p, size_t i, double at[3])
{
    at[0] = at[1] = at[2] = 0;
    for (int c = 0; c < 3; c++) {
        double d = (spl_points_at(f->points, c, i) - p->curve.origin[c]) / p->curve.scale;
        at[0] += d * p->curve.u[c];
        at[1] += d * p->curve.v[c];
        at[2] += d * p->curve.normal[c];
    }
}

/* The frame on the side that most were seen from, whose group is returned in *group. 0: too many were not. */
static size_t settle_frame(const struct spl_fit *f, size_t begin, size_t end, size_t all, struct spl_patch *p,
                           uint8_t *group)
{
    size_t side[2];
    double sigma[3], normal[3], least = 2, length = 0;
    int axis = 0;
    spl_plane_moments_fit(&p->moments, sigma, normal);
    if (!(sigma[1] > narrow * sigma[2]) || sigma[0] > flat_first * sigma[1])
        return 0;
    spl_fit_part_sides(f, begin, end, normal, side);
    *group = side[1] > side[0] ? 2 : 1;
    for (int c = 0; c < 3; c++) {
        p->curve.normal[c] = *group == 2 ? -normal[c] : normal[c];
        if (fabs(normal[c]) < least)
            least = fabs(normal[axis = c]);
    }
    for (int c = 0; c < 3; c++) {
        p->curve.u[c] = (c == axis) - p->curve.normal[axis] * p->curve.normal[c];
        length += p->curve.u[c] * p->curve.u[c];
    }
    for (int c = 0; c < 3; c++)
        p->curve.u[c] /= sqrt(length);
    for (int c = 0; c < 3; c++)
        p->curve.v[c] = p->curve.normal[(c + 1) % 3] * p->curve.u[(c + 2) % 3] -
                        p->curve.normal[(c + 2) % 3] * p->curve.u[(c + 1) % 3];
    p->curve.scale = 1.7320508 * sigma[2];
    size_t most = side[*group - 1];
    return (double)most >= most_share * (double)all ? most : 0;
}

/* Fits the quadratic to those of the group that are within `limit`; returns how many, and their sigma in p->rms. */
static size_t fit(const struct spl_fit *f, size_t begin, size_t end, uint8_t group, double limit, struct spl_patch *p,
                  double *most)
{
    struct spl_quadratic_sums sums = {0};
    size_t count = 0;
    double squared = 0, at[3];
    for (size_t i = begin; i < end; i++) {
        if (f->group[i - f->base] != group || fabsf(f->off[i - f->base]) > limit)
            continue;
        get_place(f, p, i, at);
        spl_quadratic_add(&sums, at[0], at[1], at[2], 1);
        count++;
    }
    *most = 0;
    if (count <= unknowns || !spl_quadratic_solve(&sums, ridge, p->curve.q))
        return 0;
    for (size_t i = begin; i < end; i++) {
        if (f->group[i - f->base] != group)
            continue;
        get_place(f, p, i, at);
        double off = p->curve.scale * (at[2] - spl_quadratic_height(p->curve.q, at[0], at[1]));
        squared += fabsf(f->off[i - f->base]) <= limit ? off * off : 0;
        f->off[i - f->base] = (float)off;
        *most = fmax(*most, fabs(off));
    }
    p->rms = sqrt(squared / (double)(count - unknowns));
    return count;
}

static bool is_steep(const struct spl_fit *f, size_t begin, size_t end, uint8_t group, const struct spl_patch *p)
{
    for (size_t i = begin; i < end; i++) {
        double at[3], slope[2];
        if (f->group[i - f->base] != group)
            continue;
        get_place(f, p, i, at);
        spl_quadratic_slope(p->curve.q, at[0], at[1], slope);
        if (slope[0] * slope[0] + slope[1] * slope[1] > most_slope * most_slope)
            return true;
    }
    return false;
}

bool spl_fit_curve(const struct spl_fit *f, size_t begin, size_t end, struct spl_patch *patch)
{
    size_t all = 0, within = 0;
    uint8_t group;
    double sigma[3], normal[3], most, limit = INFINITY, bound = f->limits.bound;
    for (size_t i = begin; i < end; i++) {
        bool open = f->taken[i] == SPL_NO_PLANE && !(f->points->linear && f->points->linear[i]);
        f->group[i - f->base] = open;
        f->off[i - f->base] = 0;
        all += open;
    }
    if (all < SPL_PLANE_POINTS)
        return false;
    patch->moments = spl_fit_sum(f, begin, end, 1, INFINITY);
    memcpy(patch->curve.origin, patch->moments.mean, sizeof patch->curve.origin);
    size_t count = settle_frame(f, begin, end, all, patch, &group);
    if (count < SPL_PLANE_POINTS)
        return false;
    spl_plane_moments_fit(&patch->moments, sigma, normal);
    for (int t = 0; t < tries; t++) {
        if ((double)fit(f, begin, end, group, limit, patch, &most) < most_share * (double)count)
            return false;
        if (t == 0 && spl_fit_has_layers(f, begin, end, group))
            return false;
        if (limit <= bound || most <= bound)
            break;
        limit = fmax(bound, 1.5 * patch->rms);
    }
    if (patch->rms > smooth * sigma[1] || is_steep(f, begin, end, group, patch) ||
        !spl_fit_is_even(f, begin, end, group, patch->rms, false))
        return false;
    for (size_t i = begin; i < end; i++) {
        bool is = f->group[i - f->base] == group && fabsf(f->off[i - f->base]) <= bound;
        f->group[i - f->base] = is;
        within += is;
    }
    double length = sqrt(1 + patch->curve.q[1] * patch->curve.q[1] + patch->curve.q[2] * patch->curve.q[2]);
    for (int c = 0; c < 3; c++)
        patch->normal[c] =
            (patch->curve.normal[c] - patch->curve.q[1] * patch->curve.u[c] - patch->curve.q[2] * patch->curve.v[c]) /
            length;
    patch->moments = spl_fit_sum(f, begin, end, 1, INFINITY);
    return within >= SPL_PLANE_POINTS && (double)within >= most_share * (double)count;
}
