/* Central moments that add up (Chan, Golub and LeVeque, "Updating formulae and a pairwise algorithm for computing
 * sample variances", 1982). Sums are taken about a point beside the others and brought to the mean: squares of metres
 * in doubles leave 10^-8 of a cell's edge. */
#include "pack/planes/moments.h"

#include <math.h>

#include "geom/eigen.h"

static const int row[6] = {0, 0, 0, 1, 1, 2}, column[6] = {0, 1, 2, 1, 2, 2};

struct spl_plane_moments spl_plane_moments_of(const double origin[3], double count, const double sum[3],
                                              const double square[6])
{
    struct spl_plane_moments m = {.count = count};
    if (count <= 0)
        return m;
    for (int c = 0; c < 3; c++)
        m.mean[c] = origin[c] + sum[c] / count;
    for (int e = 0; e < 6; e++)
        m.square[e] = square[e] - sum[row[e]] * sum[column[e]] / count;
    return m;
}

void spl_plane_moments_add(struct spl_plane_moments *to, const struct spl_plane_moments *from)
{
    double both = to->count + from->count, shift[3];
    if (from->count <= 0)
        return;
    for (int c = 0; c < 3; c++)
        shift[c] = from->mean[c] - to->mean[c];
    for (int e = 0; e < 6; e++)
        to->square[e] += from->square[e] + shift[row[e]] * shift[column[e]] * (to->count * from->count / both);
    if (to->count <= 0)
        for (int c = 0; c < 3; c++)
            to->mean[c] = from->mean[c];
    else
        for (int c = 0; c < 3; c++)
            to->mean[c] += shift[c] * (from->count / both);
    to->count = both;
}

double spl_plane_moments_spread(const struct spl_plane_moments *m, const double v[3])
{
    double sum = 0;
    for (int e = 0; e < 6; e++)
        sum += (row[e] == column[e] ? 1 : 2) * v[row[e]] * v[column[e]] * m->square[e];
    return sqrt(fmax(0, sum / m->count));
}

void spl_plane_moments_fit(const struct spl_plane_moments *m, double sigma[3], double normal[3])
{
    double values[3], most[3];
    spl_eigen_symmetric(m->square, values, normal, most);
    for (int c = 0; c < 3; c++)
        sigma[c] = sqrt(fmax(0, values[c] / m->count));
}
