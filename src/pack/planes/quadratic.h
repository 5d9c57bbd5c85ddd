/* Least squares of z = q0 + q1 x + q2 y + q3 xx + q4 xy + q5 yy. Sums add up; x and y are of the order of 1, or the
 * solution loses digits. Pure functions; any thread. */
#ifndef SPL_PACK_PLANES_QUADRATIC_H
#define SPL_PACK_PLANES_QUADRATIC_H

#include <stdbool.h>

struct spl_quadratic_sums {
    double weight;
    double square[21]; /* the lower triangle of the products of 1 x y xx xy yy, row by row */
    double right[6];   /* of those with z */
};

static inline double spl_quadratic_height(const double q[6], double x, double y)
{
    return q[0] + x * (q[1] + q[3] * x + q[4] * y) + y * (q[2] + q[5] * y);
}

static inline void spl_quadratic_slope(const double q[6], double x, double y, double slope[2])
{
    slope[0] = q[1] + 2 * q[3] * x + q[4] * y;
    slope[1] = q[2] + q[4] * x + 2 * q[5] * y;
}

void spl_quadratic_add(struct spl_quadratic_sums *sums, double x, double y, double z, double weight);

/* Bends are held back as if `ridge` of the weight said that there are none, tilts a hundredth as much: what points do
 * not settle, such as the bend across a single line of them, stays near 0. False: there is no weight. */
bool spl_quadratic_solve(const struct spl_quadratic_sums *sums, double ridge, double q[6]);

#endif
