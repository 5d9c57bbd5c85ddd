/* Places and directions of polar-capped maps; see polar.h. The float version is the kernels' arithmetic: shaders have
 * no arc functions that two drivers agree on, so polynomials stand for them. */
#include "geom/polar.h"

#include <math.h>

#include "shared.h"

/* Where the charts begin, without their aprons: texels of the atlas. */
static double chart_x(uint32_t side, uint32_t apron, int chart)
{
    return chart * (side + 2.0 * apron) + apron;
}

double spl_polar_texel(uint32_t side)
{
    return M_PI / (2.0 * side);
}

void spl_polar_direction(uint32_t side, uint32_t apron, const double place[2], double direction[3])
{
    double cap = side + 2.0 * apron, y = place[1] - apron;
    int chart = place[0] < cap ? 0 : place[0] < 2 * cap ? 1 : 2;
    double x = place[0] - chart_x(side, apron, chart);
    if (chart == 2) {
        double elevation = (y / side - 0.5) * M_PI / 2, azimuth = x / side * M_PI / 2;
        direction[0] = cos(elevation) * cos(azimuth);
        direction[1] = cos(elevation) * sin(azimuth);
        direction[2] = sin(elevation);
        return;
    }
    double u = x / side - 0.5, v = y / side - 0.5, r = sqrt(u * u + v * v), angle = r * M_PI / 2;
    double share = r > 0 ? sin(angle) / r : M_PI / 2;
    direction[0] = u * share;
    direction[1] = v * share;
    direction[2] = chart ? cos(angle) : -cos(angle);
}

void spl_polar_place(uint32_t side, uint32_t apron, const double d[3], double place[2])
{
    double flat = sqrt(d[0] * d[0] + d[1] * d[1]), elevation = atan2(d[2], flat);
    if (fabs(elevation) <= M_PI / 4) {
        double azimuth = atan2(d[1], d[0]);
        place[0] = chart_x(side, apron, 2) + (azimuth < 0 ? azimuth + 2 * M_PI : azimuth) * side * 2 / M_PI;
        place[1] = apron + (elevation / (M_PI / 2) + 0.5) * side;
        return;
    }
    double share = flat > 0 ? atan2(flat, fabs(d[2])) * (2 / M_PI) / flat : 0;
    place[0] = chart_x(side, apron, d[2] > 0) + (d[0] * share + 0.5) * side;
    place[1] = apron + (d[1] * share + 0.5) * side;
}

bool spl_polar_is_proper(uint32_t side, uint32_t apron, uint32_t x, uint32_t y)
{
    uint32_t cap = side + 2 * apron, chart = x < cap ? 0 : x < 2 * cap ? 1 : 2;
    double u = x + 0.5 - chart_x(side, apron, (int)chart), v = y + 0.5 - apron;
    if (chart == 2)
        return u > 0 && u < 4.0 * side && v > 0 && v < side;
    u -= 0.5 * side;
    v -= 0.5 * side;
    return u * u + v * v <= 0.25 * side * side;
}

/* acos(1 - t) / sqrt(1 - (1 - t)^2) * 2 / pi, for t of 0 to 1 - cos 45 degrees. */
static float cap_share(float t)
{
    static const float c[] = SPL_POLAR_CAP;
    return c[0] + t * (c[1] + t * (c[2] + t * (c[3] + t * (c[4] + t * c[5]))));
}

/* asin(z) / z * 2 / pi, by the square of z, to sin 45 degrees. */
static float band_share(float t)
{
    static const float c[] = SPL_POLAR_BAND;
    return c[0] + t * (c[1] + t * (c[2] + t * (c[3] + t * (c[4] + t * (c[5] + t * c[6])))));
}

/* atan(q) / q * 2 / pi, by the square of q, to 1. */
static float turn_share(float t)
{
    static const float c[] = SPL_POLAR_TURN;
    return c[0] + t * (c[1] + t * (c[2] + t * (c[3] + t * (c[4] + t * (c[5] + t * (c[6] + t * c[7]))))));
}

/* The azimuth in quarter turns, 0 to 4. */
static float quarter_turns(float x, float y)
{
    float ax = fabsf(x), ay = fabsf(y), most = fmaxf(fmaxf(ax, ay), 1e-30f), q = fminf(ax, ay) / most;
    float turn = q * turn_share(q * q);
    turn = ay > ax ? 1 - turn : turn;
    turn = x < 0 ? 2 - turn : turn;
    return y < 0 ? 4 - turn : turn;
}

void spl_polar_place_f(uint32_t side, uint32_t apron, const float d[3], float place[2])
{
    float h = (float)side, a = (float)apron;
    if (fabsf(d[2]) <= SPL_POLAR_EDGE) {
        place[0] = 2 * h + 5 * a + quarter_turns(d[0], d[1]) * h;
        place[1] = a + (d[2] * band_share(d[2] * d[2]) + 0.5f) * h;
        return;
    }
    float share = cap_share(1 - fabsf(d[2])), left = d[2] > 0 ? h + 3 * a : a;
    place[0] = left + (d[0] * share + 0.5f) * h;
    place[1] = a + (d[1] * share + 0.5f) * h;
}
