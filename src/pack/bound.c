/* A bound is what points may lie off what stands for them. Far above what noise and spacing ask for, a room's furniture
 * is its floor; below the noise, the points of a wall are on no plane. Both are said with the figures that were
 * measured; what can be no scan's bound is refused before the work. Stateless; any thread. */
#include "pack/bound.h"

#include <math.h>
#include <stdio.h>

#include "pack/median.h"

static const double size_share = 0.1;     /* of the longest side: no plane is found in what is not ten bounds long */
static const double spacing_share = 1e-4; /* of the median spacing: a micrometre where points are a centimetre apart */
static const double wide = 10;            /* times the largest bound that is chosen without one */
static const double noise_sigmas = 2;     /* below it one point of a wall in twenty and more lies farther off */
static const double radius_spacing = 1.128; /* radius of a disc amid a surface, over its points' spacing */

enum { length_text_max = 32 };

static const char *print_length(double length, double unit_m, char text[length_text_max])
{
    if (length * unit_m < 1)
        snprintf(text, length_text_max, "%.3g mm", length * unit_m * 1e3);
    else
        snprintf(text, length_text_max, "%.3g m", length * unit_m);
    return text;
}

int spl_bound_check(const struct spl_bound *bound, const struct spl_points *points, struct spl_error *err)
{
    char chosen[length_text_max], measured[length_text_max];
    if (!(bound->error > 0) || !points->count)
        return SPL_OK;
    float radii[1024];
    size_t sample = points->count < 1024 ? points->count : 1024;
    for (size_t i = 0; i < sample; i++)
        radii[i] = points->radius[i * points->count / sample];
    double spacing = spl_median(radii, sample) / radius_spacing;
    if (bound->error < spacing_share * spacing)
        return spl_fail_field(err, SPL_E_USAGE, "error",
                              "--error %s: the scan's points are %s apart, and none of them is known to a ten "
                              "thousandth of that: name some millimetres, or leave --error out",
                              print_length(bound->error, bound->unit_m, chosen),
                              print_length(spacing, bound->unit_m, measured));
    return SPL_OK;
}

int spl_bound_check_size(const struct spl_bound *bound, const struct spl_points *points, struct spl_error *err)
{
    char chosen[length_text_max], measured[length_text_max];
    double longest = 0;
    for (int c = 0; c < 3; c++)
        longest = fmax(longest, points->bounds_max[c] - points->bounds_min[c]);
    if (longest > 0 && bound->error > size_share * longest)
        return spl_fail_field(err, SPL_E_USAGE, "error",
                              "--error %s: the whole scan is %s long, and what primitives may be off their points is "
                              "at most a tenth of that: name some millimetres, or leave --error out",
                              print_length(bound->error, bound->unit_m, chosen),
                              print_length(longest, bound->unit_m, measured));
    return SPL_OK;
}

const char *spl_bound_find_doubt(const struct spl_bound *bound, const struct spl_planes *planes,
                                 char text[SPL_BOUND_TEXT_MAX])
{
    char chosen[length_text_max], noise[length_text_max], own[length_text_max];
    if (!(bound->error > 0))
        return NULL;
    print_length(bound->error, bound->unit_m, chosen);
    print_length(planes->noise, bound->unit_m, noise);
    print_length(planes->own_bound, bound->unit_m, own);
    if (bound->error > wide * planes->own_bound)
        snprintf(text, SPL_BOUND_TEXT_MAX,
                 "--error %s is how far points may lie off their plane, mesh or line, so things up to that thick are "
                 "one: the scan's noise is %s, and without --error the bound would be at most %s",
                 chosen, noise, own);
    else if (bound->error < noise_sigmas * planes->noise)
        snprintf(text, SPL_BOUND_TEXT_MAX,
                 "--error %s is how far points may lie off their plane, mesh or line, and the scan's noise is %s "
                 "(sigma): many points of walls lie farther off and stay splats; without --error the bound would be at "
                 "most %s",
                 chosen, noise, own);
    else
        return NULL;
    return text;
}
