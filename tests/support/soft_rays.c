/* The reference of soft spheres; see soft_rays.h. Written from the paper's equations and the comments of
 * src/render/soft/models.h; of the product only the integrals of one sphere and the number of shells are used, which
 * soft_march() holds against densities. */
#include "support/soft_rays.h"

#include <math.h>
#include <stdint.h>
#include <stdlib.h>

#include "render/soft/models.h"

/* A sphere as the ray meets it; lengths along the ray of length 1. */
struct met {
    double middle, half; /* where it is next to the centre; half of the chord */
    double delta;        /* how near, radii */
    double radius, depth; /* optical depth of the whole chord */
    uint32_t shells;
    const double *color;
};

static double dot(const double a[3], const double b[3])
{
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
}

static bool meets(const struct soft_sphere *s, const double ray[2], double *middle, double *delta)
{
    double length = sqrt(ray[0] * ray[0] + ray[1] * ray[1] + 1), u[3] = {ray[0] / length, ray[1] / length, 1 / length};
    double z = s->center[2], o[3] = {s->center[0] - ray[0] * z, s->center[1] - ray[1] * z, 0}, along = dot(o, u);
    *middle = dot(s->center, u);
    *delta = sqrt(fmax(dot(o, o) - along * along, 0)) / s->radius;
    return *delta < 1;
}

static double part(const struct soft_look *look, const struct met *m, double zeta)
{
    return look->model == SPL_SOFT_MODEL_BASE ? spl_soft_base_part(m->delta, zeta)
                                              : spl_soft_concentric_part(m->shells, m->delta, zeta);
}

/* Eq. 22 of a whole chord, with 1 - d / r as dense as a solid splat. */
static double modulated(double opacity, double delta, double soft)
{
    return (1 - delta) * (1 - soft) + opacity * soft;
}

static double express(const struct soft_look *look, double delta)
{
    static float f[SPL_SOFT_FALLOFF];
    static double known = -1; /* a fit takes long */
    double m = 1 - delta * delta, sum = 0;
    if (look->eq19)
        return look->opacity * (cos(M_PI * delta) + 1) / 2;
    if (known != look->opacity)
        spl_soft_falloff(known = look->opacity, f);
    for (int i = SPL_SOFT_FALLOFF - 1; i >= 0; i--)
        sum = sum * m + (double)f[i];
    return fmin(fmax(m * sum, 0), 1);
}

static void blend(struct soft_seen *seen, double opacity, const double color[3])
{
    for (int i = 0; i < 3; i++)
        seen->color[i] += seen->transmittance * opacity * color[i];
    seen->transmittance *= 1 - opacity;
}

static struct soft_seen see_express(const struct soft_look *look, const struct soft_sphere *spheres, size_t count,
                                    const double ray[2], double near, double far)
{
    struct soft_seen seen = {.transmittance = 1};
    for (size_t i = 0; i < count; i++) {
        double middle, delta, z = spheres[i].center[2];
        if (z >= near && z <= far && meets(&spheres[i], ray, &middle, &delta))
            blend(&seen, modulated(express(look, delta), delta, spheres[i].soft) * (1 - spheres[i].thin),
                  spheres[i].color);
    }
    return seen;
}

/* What splatting would show: the nearest and what lies within its margin, weighted as splats are. */
static struct soft_seen see_layer(const struct soft_look *look, const struct soft_sphere *spheres, size_t count,
                                  const double ray[2], double near, double far)
{
    struct soft_seen seen = {.transmittance = 1};
    double color[3] = {0}, weights = 0, last = INFINITY;
    for (size_t i = 0; i < count; i++) {
        double middle, delta, z = spheres[i].center[2], radius = spheres[i].radius;
        if (z < near || z > far || !meets(&spheres[i], ray, &middle, &delta))
            continue;
        last = fmin(last, z + look->margin * radius);
        if (z > last)
            continue;
        for (int c = 0; c < 3; c++)
            color[c] += (1 - delta * delta) * spheres[i].color[c];
        weights += 1 - delta * delta;
    }
    for (int c = 0; c < 3 && weights > 0; c++)
        color[c] /= weights;
    if (weights > 0)
        blend(&seen, look->opacity, color);
    return seen;
}

static int by_value(const void *a, const void *b)
{
    double x = *(const double *)a, y = *(const double *)b;
    return (x > y) - (x < y);
}

/* The stretch from a to b, which lies within whatever it meets. */
static void see_stretch(const struct soft_look *look, const struct met *met, size_t count, double a, double b,
                        struct soft_seen *seen)
{
    double depth = 0, weights = 0, color[3] = {0}, middle = (a + b) / 2;
    for (const struct met *m = met; m < met + count; m++) {
        if (fabs(middle - m->middle) >= m->half)
            continue;
        double edge = m->half / m->radius, whole = 2 * part(look, m, edge);
        double from = fmax((a - m->middle) / m->radius, -edge), to = fmin((b - m->middle) / m->radius, edge);
        depth += whole > 1e-12 ? m->depth * (part(look, m, to) - part(look, m, from)) / whole : 0;
        weights += 1 - m->delta;
        for (int i = 0; i < 3; i++)
            color[i] += (1 - m->delta) * m->color[i];
    }
    for (int i = 0; i < 3 && weights > 0; i++)
        color[i] /= weights; /* eq. 11 */
    blend(seen, -expm1(-depth), color);
}

static size_t meet(const struct soft_look *look, const struct soft_sphere *spheres, size_t count, const double ray[2],
                   struct met *met)
{
    size_t found = 0;
    for (size_t i = 0; i < count; i++) {
        const struct soft_sphere *s = &spheres[i];
        struct met m = {.radius = s->radius, .color = s->color};
        if (!meets(s, ray, &m.middle, &m.delta))
            continue;
        m.half = s->radius * sqrt(1 - m.delta * m.delta);
        m.shells = spl_soft_shells(look->focal * s->radius / fmax(s->center[2], 1e-9));
        double own = 2 * spl_soft_depth(look->opacity) * part(look, &m, m.half / m.radius);
        double share = 1 - s->thin, a = share < 1 ? spl_soft_thin(look->opacity) : 1;
        double opacity = modulated(-expm1(-own), m.delta, s->soft) * share;
        m.depth = s->soft < 1 ? -log1p(-fmin(opacity, 1 - 1.0 / 1024)) : own * share * (a + (1 - a) * share);
        met[found++] = m;
    }
    return found;
}

static struct soft_seen see_stretches(const struct soft_look *look, const struct soft_sphere *spheres, size_t count,
                                      const double ray[2], double near, double far)
{
    struct soft_seen seen = {.transmittance = 1};
    struct met *met = calloc(count + 1, sizeof *met);
    double *events = calloc(2 * count + 2, sizeof *events), length = sqrt(ray[0] * ray[0] + ray[1] * ray[1] + 1);
    size_t found = meet(look, spheres, count, ray, met), at = 0;
    events[at++] = near * length;
    events[at++] = far * length;
    for (size_t i = 0; i < found; i++)
        for (int side = -1; side < 2; side += 2)
            events[at++] = fmin(fmax(met[i].middle + side * met[i].half, near * length), far * length);
    qsort(events, at, sizeof *events, by_value);
    for (size_t i = 0; i + 1 < at; i++)
        if (events[i] < events[i + 1])
            see_stretch(look, met, found, events[i], events[i + 1], &seen);
    free(events);
    free(met);
    return seen;
}

struct soft_seen soft_see(const struct soft_look *look, const struct soft_sphere *spheres, size_t count,
                                const double ray[2], double near, double far)
{
    return look->model == SPL_SOFT_MODEL_EXPRESS ? see_express(look, spheres, count, ray, near, far)
         : look->model == SPL_SOFT_MODEL_LAYER   ? see_layer(look, spheres, count, ray, near, far)
                                                 : see_stretches(look, spheres, count, ray, near, far);
}

/* Density at `from` radii from the centre, times the radius: eq. 5 with lambda = depth / r^2, and eq. 13 to 15. */
static double density(const struct soft_look *look, const struct met *m, double from)
{
    double depth = spl_soft_depth(look->opacity), sum = 0;
    if (look->model == SPL_SOFT_MODEL_BASE)
        return fmax(depth * (1 - from), 0);
    for (uint32_t i = 0; i < m->shells; i++) {
        double own = 1 - (double)i / m->shells;
        sum += from < own ? (1 - m->delta / (m->shells * own)) / (m->shells * own) : 0;
    }
    return depth * sum / 2;
}

struct soft_seen soft_march(const struct soft_look *look, const struct soft_sphere *spheres, size_t count,
                            const double ray[2], double near, double far, size_t steps)
{
    struct soft_seen seen = {.transmittance = 1};
    double length = sqrt(ray[0] * ray[0] + ray[1] * ray[1] + 1), begin = far * length, end = near * length;
    struct met *met = calloc(count + 1, sizeof *met);
    size_t found = meet(look, spheres, count, ray, met);
    for (size_t i = 0; i < found; i++) {
        begin = fmax(fmin(begin, met[i].middle - met[i].half), near * length);
        end = fmin(fmax(end, met[i].middle + met[i].half), far * length);
    }
    for (size_t step = 0; step < steps && begin < end; step++) {
        double size = (end - begin) / (double)steps, at = begin + ((double)step + 0.5) * size;
        double depth = 0, weights = 0, color[3] = {0};
        for (const struct met *m = met; m < met + found; m++) {
            double from = hypot((at - m->middle) / m->radius, m->delta);
            if (from >= 1)
                continue;
            depth += density(look, m, from) * size / m->radius;
            weights += 1 - m->delta;
            for (int i = 0; i < 3; i++)
                color[i] += (1 - m->delta) * m->color[i];
        }
        for (int i = 0; i < 3 && weights > 0; i++)
            color[i] /= weights;
        blend(&seen, -expm1(-depth), color);
    }
    free(met);
    return seen;
}

double soft_profile(const struct soft_look *look, double radius_samples, double delta)
{
    struct soft_look close = *look;
    struct soft_sphere sphere = {.center = {delta, 0, 1000}, .radius = 1, .soft = 1};
    const double axis[2] = {0, 0};
    close.focal = 1000 * radius_samples;
    return 1 - soft_see(&close, &sphere, 1, axis, 1, 1e6).transmittance;
}
