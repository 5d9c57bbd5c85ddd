/* The patch is the parallelogram between a pulse and its neighbours in the line and in the next line of the same way,
 * cast onto the plane of the surface (Igehy, Tracing Ray Differentials, 1999, by differences). It is sampled as finely
 * as the textures' finest features ask for, so that a dense scan costs one sample a point. Samples beyond the
 * primitive's edge belong to something else and are left out. Pure functions; any thread. */
#include "synth/footprint.h"

#include <string.h>

#include "geom/vector.h"

static const double finest = 0.006; /* metres between samples; edges of textures are ramps of 5 mm */
static const double longest = 4;    /* of a patch at a grazing angle, times its width across the ray */
enum { samples_max = 4 };           /* per side */

/* Light of a colour, 0..1, within two levels of sRGB's curve where colours are mixed, and its inverse. */
static double light_of(double level)
{
    double s = level / 255;
    return s * (s * (s * 0.305306011 + 0.682171111) + 0.012522878);
}

static double level_of(double light)
{
    double s = sqrt(light);
    for (int i = 0; i < 4; i++) /* Newton; the curve is convex and steep enough */
        s -= (s * (s * (s * 0.305306011 + 0.682171111) + 0.012522878) - light) /
             (s * (s * 3 * 0.305306011 + 2 * 0.682171111) + 0.012522878);
    return 255 * s;
}

/* Where the ray through `pulse` meets the plane of `hit`, from the hit; of bounded length. */
static void step_to(const struct spl_pulse *pulse, const struct spl_pulse *from, const struct spl_hit *hit,
                    double share, double step[3])
{
    double to[3], across[3], point[3], n[3] = {hit->normal[0], hit->normal[1], hit->normal[2]};
    sub3(hit->position, pulse->origin, to);
    double range = sqrt(dot3(to, to)), slant = dot3(pulse->direction, n), away = dot3(to, n);
    for (int i = 0; i < 3; i++)
        across[i] = pulse->origin[i] + range * pulse->direction[i] - from->origin[i] - hit->t * from->direction[i];
    double bound = longest * sqrt(dot3(across, across));
    double t = away * slant > 0 ? away / slant : INFINITY;
    if (t < 4 * range)
        mad3(pulse->origin, t, pulse->direction, point);
    else
        mad3(hit->position, 1, across, point);
    sub3(point, hit->position, step);
    double length = sqrt(dot3(step, step)), scale = share * (length > bound ? bound / length : 1);
    for (int i = 0; i < 3; i++)
        step[i] *= scale;
}

static bool is_on(const struct spl_primitive *p, const double position[3])
{
    double from[3];
    sub3(position, p->center, from);
    double u = dot3(from, p->u), v = dot3(from, p->v);
    switch (p->kind) {
    case SPL_PRIMITIVE_RECTANGLE:
        return fabs(u) <= p->half[0] && fabs(v) <= p->half[1];
    case SPL_PRIMITIVE_DISC:
        return u * u + v * v <= p->half[0] * p->half[0];
    case SPL_PRIMITIVE_SPHERE:
    case SPL_PRIMITIVE_CONE:
        break;
    }
    return true;
}

static int samples_along(const double step[3])
{
    double count = ceil(sqrt(dot3(step, step)) / finest);
    return count < 1 ? 1 : count > samples_max ? samples_max : (int)count;
}

void spl_footprint_color(const struct spl_scene *scene, const struct spl_scan_grid *grid, size_t pass, uint64_t column,
                         uint64_t row, const struct spl_hit *hit, uint8_t color[3])
{
    const struct spl_primitive *p = &scene->primitives[hit->primitive];
    const struct spl_material *material = &scene->materials[p->material];
    struct spl_pulse pulse, next;
    double steps[2][3], light[3] = {0};
    unsigned count = 0;
    memcpy(color, hit->color, 3 * sizeof *color);
    if (material->kind == SPL_MATERIAL_FLAT)
        return;
    spl_scanner_pulse(scene, grid, pass, column, row, &pulse);
    if (scene->scanner.kind == SPL_SCANNER_SWEEP) {
        spl_scanner_spacing(scene, grid, pass, column, row, steps);
    } else {
        spl_scanner_pulse(scene, grid, pass, column + 2, row, &next); /* lines may go to and fro */
        step_to(&next, &pulse, hit, 0.5, steps[0]);
        spl_scanner_pulse(scene, grid, pass, column, row + 1, &next);
        step_to(&next, &pulse, hit, 1, steps[1]);
    }
    int columns = samples_along(steps[0]), rows = samples_along(steps[1]);
    if (columns == 1 && rows == 1)
        return;
    for (int i = 0; i < columns * rows; i++) {
        double at[3], sample[3];
        mad3(hit->position, (i % columns + 0.5) / columns - 0.5, steps[0], at);
        mad3(at, (i / columns + 0.5) / rows - 0.5, steps[1], at);
        if (!is_on(p, at))
            continue;
        spl_material_shade(material, p, at, sample);
        for (int c = 0; c < 3; c++)
            light[c] += light_of(sample[c]);
        count++;
    }
    for (int c = 0; c < 3 && count; c++)
        color[c] = (uint8_t)lround(level_of(light[c] / count));
}
