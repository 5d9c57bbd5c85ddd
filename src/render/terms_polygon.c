/* Polygons in plan: which are refused, and how far a point is from one. A polygon may turn either way around; a side of
 * no length, and sides that touch or cross others, are refused, so that inside is where a line to infinity crosses an
 * odd number of sides. Pure functions; any thread. */
#include <math.h>
#include <stdio.h>

#include "render/terms.h"

/* Twice the area of a, b, c; positive where they turn counter-clockwise. Relative to a: map coordinates are large. */
static double turn_of(const double a[2], const double b[2], const double c[2])
{
    return (b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0]);
}

static int sign_of(double x)
{
    return (x > 0) - (x < 0);
}

/* Does p, which lies on the line of a and b, lie between them? */
static bool is_between(const double a[2], const double b[2], const double p[2])
{
    return p[0] >= fmin(a[0], b[0]) && p[0] <= fmax(a[0], b[0]) && p[1] >= fmin(a[1], b[1]) && p[1] <= fmax(a[1], b[1]);
}

static bool meet(const double a[2], const double b[2], const double c[2], const double d[2])
{
    const int ac = sign_of(turn_of(a, b, c)), ad = sign_of(turn_of(a, b, d));
    const int ca = sign_of(turn_of(c, d, a)), cb = sign_of(turn_of(c, d, b));
    return (ac * ad < 0 && ca * cb < 0) || (!ac && is_between(a, b, c)) || (!ad && is_between(a, b, d)) ||
           (!ca && is_between(c, d, a)) || (!cb && is_between(c, d, b));
}

static const double farthest = 1e150; /* so that no product of two sides wraps to infinity */

bool spl_polygon_check(const double *corners, uint32_t count, char fault[SPL_TERM_FAULT_MAX])
{
    if (count < 3) {
        snprintf(fault, SPL_TERM_FAULT_MAX, "has a polygon of %u corners, which needs three", count);
        return false;
    }
    for (uint32_t i = 0; i < count; i++)
        if (!isfinite(corners[2 * i]) || !isfinite(corners[2 * i + 1])) {
            snprintf(fault, SPL_TERM_FAULT_MAX, "has a number that is not finite");
            return false;
        }
    for (uint32_t i = 0; i < 2 * count; i++)
        if (fabs(corners[i]) > farthest) {
            snprintf(fault, SPL_TERM_FAULT_MAX, "has a polygon with a corner at %.9g, beyond %g", corners[i], farthest);
            return false;
        }
    for (uint32_t i = 0; i < count; i++) {
        const double *a = corners + 2 * i, *b = corners + 2 * ((i + 1) % count), *c = corners + 2 * ((i + 2) % count);
        const bool back = turn_of(a, b, c) == 0 && (b[0] - a[0]) * (c[0] - b[0]) + (b[1] - a[1]) * (c[1] - b[1]) < 0;
        if ((a[0] == b[0] && a[1] == b[1]) || back) {
            snprintf(fault, SPL_TERM_FAULT_MAX, "has a polygon that goes nowhere or back at corner %u", i + 1);
            return false;
        }
    }
    for (uint32_t i = 0; i < count; i++)
        for (uint32_t j = i + 2; j < count; j++) {
            if (i == 0 && j == count - 1)
                continue;
            if (meet(corners + 2 * i, corners + 2 * (i + 1), corners + 2 * j, corners + 2 * ((j + 1) % count))) {
                snprintf(fault, SPL_TERM_FAULT_MAX, "has a polygon whose sides from corners %u and %u meet", i + 1,
                         j + 1);
                return false;
            }
        }
    return true;
}

double spl_polygon_distance(const double *corners, uint32_t count, const double p[2])
{
    double least = INFINITY;
    bool inside = false;
    for (uint32_t i = 0; i < count; i++) {
        const double *a = corners + 2 * i, *b = corners + 2 * ((i + 1) % count);
        const double way[2] = {b[0] - a[0], b[1] - a[1]}, off[2] = {p[0] - a[0], p[1] - a[1]};
        const double t = fmin(fmax((off[0] * way[0] + off[1] * way[1]) / (way[0] * way[0] + way[1] * way[1]), 0), 1);
        const double beside[2] = {off[0] - t * way[0], off[1] - t * way[1]};
        least = fmin(least, beside[0] * beside[0] + beside[1] * beside[1]);
        const bool above = off[1] < 0, ends_above = p[1] - b[1] < 0;
        const double side = way[0] * off[1] - way[1] * off[0];
        inside ^= above != ends_above && (ends_above ? side > 0 : side < 0);
    }
    return inside ? -sqrt(least) : sqrt(least);
}
