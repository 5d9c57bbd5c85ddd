/* Normal equations, solved by Cholesky's factors: six unknowns, held away from zero by the ridge, so no pivots. */
#include "pack/planes/quadratic.h"

#include <math.h>

enum { terms = 6 };

void spl_quadratic_add(struct spl_quadratic_sums *s, double x, double y, double z, double weight)
{
    const double basis[terms] = {1, x, y, x * x, x * y, y * y};
    s->weight += weight;
    for (int r = 0, e = 0; r < terms; r++) {
        double w = weight * basis[r];
        for (int c = 0; c <= r; c++, e++)
            s->square[e] += w * basis[c];
        s->right[r] += w * z;
    }
}

bool spl_quadratic_solve(const struct spl_quadratic_sums *s, double ridge, double q[terms])
{
    const double held[terms] = {0, 0.01, 0.01, 1, 1, 1};
    double l[21];
    if (!(s->weight > 0))
        return false;
    for (int r = 0, row = 0; r < terms; row += ++r)
        for (int c = 0, column = 0; c <= r; column += ++c) {
            double sum = s->square[row + c] + (r == c ? (ridge * held[r] + 1e-12) * s->weight : 0);
            for (int k = 0; k < c; k++)
                sum -= l[row + k] * l[column + k];
            l[row + c] = r == c ? sqrt(fmax(sum, 1e-12 * s->weight)) : sum / l[column + c];
        }
    for (int r = 0, row = 0; r < terms; row += ++r) {
        double sum = s->right[r];
        for (int k = 0; k < r; k++)
            sum -= l[row + k] * q[k];
        q[r] = sum / l[row + r];
    }
    for (int r = terms - 1; r >= 0; r--) {
        double sum = q[r];
        for (int k = r + 1; k < terms; k++)
            sum -= l[k * (k + 1) / 2 + r] * q[k];
        q[r] = sum / l[r * (r + 1) / 2 + r];
    }
    return true;
}
