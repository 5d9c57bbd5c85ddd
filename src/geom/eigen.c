/* Smith's trigonometric eigenvalues, eigenvectors as the longest cross product of two rows of m - value × 1.
 *
 * The matrix is scaled to a largest element of 1 first, so that neither products nor the tests for a double eigenvalue
 * depend on the unit. An eigenvalue is taken as double when the cross products vanish to rounding; then any vector
 * across the other end's eigenvector is right, and the one nearest to +z is taken: wires and vertical poles get the
 * same normal at every point. */
#include "geom/eigen.h"

#include <math.h>

static double cross(const double a[3], const double b[3], double out[3])
{
    out[0] = a[1] * b[2] - a[2] * b[1];
    out[1] = a[2] * b[0] - a[0] * b[2];
    out[2] = a[0] * b[1] - a[1] * b[0];
    return out[0] * out[0] + out[1] * out[1] + out[2] * out[2];
}

/* Unit eigenvector of a simple eigenvalue; 0 where it is not simple. */
static int vector_of(const double m[6], double value, double out[3])
{
    double rows[3][3] = {{m[0] - value, m[1], m[2]}, {m[1], m[3] - value, m[4]}, {m[2], m[4], m[5] - value}};
    double best[3], longest = cross(rows[0], rows[1], best);
    for (int i = 1; i < 3; i++) {
        double other[3], length = cross(rows[i == 1 ? 0 : 1], rows[2], other);
        if (length > longest) {
            longest = length;
            for (int c = 0; c < 3; c++)
                best[c] = other[c];
        }
    }
    if (longest < 1e-15)
        return 0;
    double scale = 1 / sqrt(longest);
    for (int c = 0; c < 3; c++)
        out[c] = best[c] * scale;
    return 1;
}

/* The unit vector across `axis` that is nearest to +z, or to +x where the axis is vertical. */
static void across(const double axis[3], double out[3])
{
    int up = fabs(axis[2]) < 0.999 ? 2 : 0;
    double length = 0;
    for (int c = 0; c < 3; c++) {
        out[c] = (c == up) - axis[up] * axis[c];
        length += out[c] * out[c];
    }
    for (int c = 0; c < 3; c++)
        out[c] /= sqrt(length);
}

void spl_eigen_symmetric(const double m[6], double values[3], double least[3], double most[3])
{
    double scale = 0, a[6];
    for (int i = 0; i < 6; i++)
        scale = fmax(scale, fabs(m[i]));
    values[0] = values[1] = values[2] = 0;
    least[0] = least[1] = most[1] = most[2] = 0;
    least[2] = most[0] = 1;
    if (scale == 0)
        return;
    for (int i = 0; i < 6; i++)
        a[i] = m[i] / scale;

    double mean = (a[0] + a[3] + a[5]) / 3;
    double off = a[1] * a[1] + a[2] * a[2] + a[4] * a[4];
    double dx = a[0] - mean, dy = a[3] - mean, dz = a[5] - mean;
    double p = sqrt((dx * dx + dy * dy + dz * dz + 2 * off) / 6);
    if (p < 1e-10) {
        values[0] = values[1] = values[2] = mean * scale;
        return;
    }
    double det = dx * (dy * dz - a[4] * a[4]) - a[1] * (a[1] * dz - a[4] * a[2]) + a[2] * (a[1] * a[4] - dy * a[2]);
    double r = det / (2 * p * p * p);
    double angle = acos(fmin(1, fmax(-1, r))) / 3;
    double high = mean + 2 * p * cos(angle), low = mean + 2 * p * cos(angle + 2.0943951023931953);
    double middle = fmin(high, fmax(low, 3 * mean - high - low));
    values[0] = low * scale;
    values[1] = middle * scale;
    values[2] = high * scale;

    int has_least = middle - low > 1e-7 && vector_of(a, low, least);
    int has_most = high - middle > 1e-7 && vector_of(a, high, most);
    if (!has_least && has_most)
        across(most, least);
    else if (has_least && !has_most)
        across(least, most);
}
