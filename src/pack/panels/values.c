/* What a panel's points have beside colour, so that a pick on it says what was scanned there: of classes and of scalars
 * that are names what most have, of the others the mean, each point by what it stands for, as the splats of coarser
 * levels have it.
 *
 * A panel whose cells are all of discs that reach over its border has what their points have: it is never without a
 * class where the scan has one. One worker's, in the order of the points. */
#include "base/array.h"
#include "pack/level_scalars.h"
#include "pack/panels/raster_parts.h"

struct mix {
    struct spl_scalar_mix classification, scalar[SPL_POINT_SCALARS];
    double uncertainty, weight;
};

static void add_point(const struct spl_points *p, size_t i, const int *scalars, unsigned scalar_count, struct mix *mix)
{
    double weight = (double)p->radius[i] * (double)p->radius[i];
    spl_scalar_mix_add(&mix->classification, p->color_class[i] >> 24, weight);
    mix->uncertainty += weight * (double)p->uncertainty[i];
    mix->weight += weight;
    for (unsigned s = 0; s < scalar_count; s++)
        spl_scalar_mix_add(&mix->scalar[s], spl_scalar_number(&p->scalar[scalars[s]], i), weight);
}

bool spl_panel_values_add(const struct spl_panel_raster *r, const struct spl_panel_grid *g, size_t place,
                          struct spl_node_panels *out)
{
    const struct spl_points *p = g->group->points;
    int scalars[SPL_POINT_SCALARS];
    unsigned scalar_count = spl_points_list_scalars(p, scalars);
    struct mix mix = {0};
    for (int own = 1; own >= 0 && !(mix.weight > 0); own--)
        for (uint32_t t = spl_panel_first_touch(r, place); t < r->places[place].touches; t++)
            if (!own || r->sorted[t].own)
                add_point(p, g->group->first + r->sorted[t].member, scalars, scalar_count, &mix);
    size_t at = out->panel_count;
    if (spl_array_reserve(out->values, out->value_capacity, at + 1, NULL) ||
        (scalar_count && spl_array_reserve(out->numbers, out->number_capacity, (at + 1) * scalar_count, NULL)))
        return false;
    out->values[at].uncertainty = mix.uncertainty / mix.weight;
    out->values[at].classification = (uint8_t)spl_scalar_mix_finish(&mix.classification, true);
    for (unsigned s = 0; s < scalar_count; s++)
        out->numbers[at * scalar_count + s] = spl_scalar_mix_finish(&mix.scalar[s], p->scalar[scalars[s]].votes);
    out->panel_count++;
    return true;
}
