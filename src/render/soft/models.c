/* Models of soft spheres from the one number that a view says; see models.h. Seemann et al.: Soft-Transparency for
 * point clouds, section 3, with these readings:
 *   the densities of shells add, else they would not be "the same accumulated density for every N" (eq. 17 prints the
 *   innermost alone, which at the centre gives 1.22, 0.31, 0.06 for N = 3, 25, 200 instead of 2);
 *   eq. 15 for few shells only: for many it halves the width of a sphere. It fades as 1 / N here, so that a sphere that
 *   comes nearer does not change its width;
 *   express takes base's own opacity, not eq. 19's cosine of it. */
#include "render/soft/models.h"

#include <math.h>

#include "shared_soft.h"

double spl_soft_depth(double opacity)
{
    return -log1p(-fmin(opacity, 1 - 1.0 / 1024));
}

double spl_soft_base_part(double delta, double zeta)
{
    double s = sqrt(zeta * zeta + delta * delta);
    double tail = delta > 1e-9 ? delta * delta * asinh(zeta / delta) : 0;
    return zeta - (zeta * s + tail) / 2;
}

double spl_soft_concentric_part(uint32_t shells, double delta, double zeta)
{
    double part = 0;
    for (uint32_t i = 0; i < shells; i++) {
        double radius = 1 - (double)i / shells;
        if (radius <= delta)
            break;
        double half = sqrt(radius * radius - delta * delta), weight = 1 - delta / (shells * radius);
        part += weight / (shells * radius) * fmin(fmax(zeta, -half), half);
    }
    return part / 2;
}

uint32_t spl_soft_shells(double radius_samples)
{
    return (uint32_t)fmin(fmax(radius_samples / SPL_SOFT_SHELL_SAMPLES, 1), SPL_SOFT_SHELLS_MAX);
}

double spl_soft_thin(double opacity)
{
    enum { RINGS = 256 };
    double depth = spl_soft_depth(opacity), hidden = 0, depths = 0;
    for (int ring = 0; ring < RINGS; ring++) {
        double delta = (ring + 0.5) / RINGS, own = 2 * depth * spl_soft_base_part(delta, sqrt(1 - delta * delta));
        hidden += delta * -expm1(-own);
        depths += delta * own;
    }
    return depths > 0 ? hidden / depths : 1;
}

/* Least squares over rings of equal width, weighted by their area. That all of it adds up to `opacity` at m = 1 leaves
 * four unknowns, of terms m^(i + 2) - m. */
void spl_soft_falloff(double opacity, float f[SPL_SOFT_FALLOFF])
{
    enum { RINGS = 256, N = SPL_SOFT_FALLOFF - 1 };
    double depth = spl_soft_depth(opacity), rows[N][N + 1] = {{0}}, first = opacity;
    for (int ring = 0; ring < RINGS; ring++) {
        double delta = (ring + 0.5) / RINGS, m = 1 - delta * delta, power = m, terms[N];
        double wanted = -expm1(-2 * depth * spl_soft_base_part(delta, sqrt(m))) - m * opacity;
        for (int i = 0; i < N; i++)
            terms[i] = (power *= m) - m;
        for (int i = 0; i < N; i++) {
            for (int j = 0; j < N; j++)
                rows[i][j] += delta * terms[i] * terms[j];
            rows[i][N] += delta * terms[i] * wanted;
        }
    }
    for (int i = 0; i < N; i++) /* positive definite: no pivot is needed */
        for (int k = 0; k < N; k++) {
            double factor = k == i ? 0 : rows[k][i] / rows[i][i];
            for (int j = i; j <= N; j++)
                rows[k][j] -= factor * rows[i][j];
        }
    for (int i = 0; i < N; i++) {
        f[i + 1] = (float)(rows[i][N] / rows[i][i]);
        first -= (double)f[i + 1];
    }
    f[0] = (float)first;
}
