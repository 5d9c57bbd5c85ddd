/* Ray crossings in closed form. Quadratics are solved from the ray's point nearest to the primitive, so that a wire of
 * millimetres keeps its exact radius when it is looked at from far away. Pure functions; any thread. */
#include "synth/primitive.h"

#include <string.h>

#include "geom/vector.h"

static bool nearer(double candidate, double *t)
{
    if (!(candidate > 0) || candidate >= *t)
        return false;
    *t = candidate;
    return true;
}

static bool plane_hit(const struct spl_primitive *p, const double o[3], const double d[3], double *t)
{
    double slope = dot3(p->normal, d), to_center[3], at[3];
    sub3(p->center, o, to_center);
    double candidate = dot3(p->normal, to_center) / slope; /* parallel: infinite or NaN, neither is nearer */
    if (!(candidate > 0) || candidate >= *t)
        return false;
    for (int i = 0; i < 3; i++)
        at[i] = candidate * d[i] - to_center[i];
    if (p->kind == SPL_PRIMITIVE_DISC) {
        if (dot3(at, at) > p->half[0] * p->half[0])
            return false;
    } else if (fabs(dot3(at, p->u)) > p->half[0] || fabs(dot3(at, p->v)) > p->half[1]) {
        return false;
    }
    *t = candidate;
    return true;
}

static bool sphere_hit(const struct spl_primitive *p, const double o[3], const double d[3], double *t)
{
    double to_center[3], away[3], dd = dot3(d, d);
    sub3(p->center, o, to_center);
    double middle = dot3(to_center, d) / dd;
    for (int i = 0; i < 3; i++)
        away[i] = middle * d[i] - to_center[i];
    double rest = p->half[0] * p->half[0] - dot3(away, away);
    if (rest < 0)
        return false;
    double reach = sqrt(rest / dd);
    return nearer(middle - reach, t) || nearer(middle + reach, t);
}

static bool cone_hit(const struct spl_primitive *p, const double o[3], const double d[3], double *t)
{
    double mid[3], from[3], to_mid[3], dd = dot3(d, d);
    mad3(p->center, p->length / 2, p->normal, mid);
    sub3(mid, o, to_mid);
    double shift = dot3(to_mid, d) / dd;
    mad3(o, shift, d, from);
    sub3(from, p->center, from);
    /* |x - (x.n) n| = r0 + k x.n along x = from + s d */
    double k = (p->half[1] - p->half[0]) / p->length;
    double fn = dot3(from, p->normal), dn = dot3(d, p->normal);
    double rf = p->half[0] + k * fn, rd = k * dn;
    double a = dd - dn * dn - rd * rd;
    double b = dot3(from, d) - fn * dn - rf * rd;
    double c = dot3(from, from) - fn * fn - rf * rf;
    double roots[2];
    if (fabs(a) < 1e-14 * dd) { /* along the axis of a cylinder, or along a generator of a cone */
        roots[0] = roots[1] = -c / (2 * b);
    } else {
        double discriminant = b * b - a * c;
        if (discriminant < 0)
            return false;
        double q = -(b + copysign(sqrt(discriminant), b));
        double first = q / a, second = q != 0 ? c / q : first;
        roots[0] = first < second ? first : second;
        roots[1] = first < second ? second : first;
    }
    for (int i = 0; i < 2; i++) {
        double along = fn + roots[i] * dn;
        if (along >= 0 && along <= p->length && nearer(shift + roots[i], t))
            return true;
    }
    return false;
}

bool spl_primitive_hit(const struct spl_primitive *p, const double origin[3], const double direction[3], double *t)
{
    switch (p->kind) {
    case SPL_PRIMITIVE_SPHERE:
        return sphere_hit(p, origin, direction, t);
    case SPL_PRIMITIVE_CONE:
        return cone_hit(p, origin, direction, t);
    case SPL_PRIMITIVE_RECTANGLE:
    case SPL_PRIMITIVE_DISC:
        break;
    }
    return plane_hit(p, origin, direction, t);
}

void spl_primitive_normal(const struct spl_primitive *p, const double position[3], double normal[3])
{
    switch (p->kind) {
    case SPL_PRIMITIVE_SPHERE:
        sub3(position, p->center, normal);
        break;
    case SPL_PRIMITIVE_CONE: {
        double from[3], radial[3], k = (p->half[1] - p->half[0]) / p->length;
        sub3(position, p->center, from);
        mad3(from, -dot3(from, p->normal), p->normal, radial);
        normalise3(radial);
        mad3(radial, -k, p->normal, normal);
        break;
    }
    case SPL_PRIMITIVE_RECTANGLE:
    case SPL_PRIMITIVE_DISC:
        memcpy(normal, p->normal, sizeof p->normal);
        return;
    }
    normalise3(normal);
}

void spl_primitive_bounds(const struct spl_primitive *p, double bounds[2][3])
{
    for (int i = 0; i < 3; i++) {
        double across = sqrt(fmax(0, 1 - p->normal[i] * p->normal[i])); /* of a unit circle around the normal */
        double low = p->center[i], high = p->center[i];
        switch (p->kind) {
        case SPL_PRIMITIVE_RECTANGLE: {
            double reach = fabs(p->u[i]) * p->half[0] + fabs(p->v[i]) * p->half[1];
            low -= reach;
            high += reach;
            break;
        }
        case SPL_PRIMITIVE_DISC:
            low -= across * p->half[0];
            high += across * p->half[0];
            break;
        case SPL_PRIMITIVE_SPHERE:
            low -= p->half[0];
            high += p->half[0];
            break;
        case SPL_PRIMITIVE_CONE: {
            double end = p->center[i] + p->length * p->normal[i];
            double first = across * p->half[0], last = across * p->half[1];
            low = fmin(low - first, end - last);
            high = fmax(high + first, end + last);
            break;
        }
        }
        double pad = 1e-9 * (1 + fmax(fabs(low), fabs(high)));
        bounds[0][i] = low - pad;
        bounds[1][i] = high + pad;
    }
}
