#include "support/reference_of.h"

#include <math.h>
#include <string.h>

#include "render/soft/models.h"

/* Optical depth of an item on the ray of (x, y), from the eye to view depth `until`. */
static double depth_of(const struct spl_frame_params *params, const struct soft_item *item, int x, int y, double until,
                       const struct spl_soft_params *soft)
{
    const double slope[2] = {(x + (double)params->tile_x + 0.5 - (double)params->cx) / (double)params->fx,
                             (y + (double)params->tile_y + 0.5 - (double)params->cy) / (double)params->fy};
    const double length = sqrt(slope[0] * slope[0] + slope[1] * slope[1] + 1), z = (double)item->z;
    const double r = fmax((double)item->radius, (double)params->low_pass * z / (double)params->fx);
    const double left = (double)item->radius * (double)item->radius / (r * r),
                 a = left < 1 ? spl_soft_thin(soft->opacity) : 1;
    const double off[2] = {(double)item->x - slope[0] * z, (double)item->y - slope[1] * z};
    const double along = (off[0] * slope[0] + off[1] * slope[1]) / length;
    const double delta = sqrt(fmax(off[0] * off[0] + off[1] * off[1] - along * along, 0)) / r;
    if (delta >= 1)
        return 0;
    const double depth = spl_soft_depth(soft->opacity), edge = sqrt(1 - delta * delta), middle = z * length + along;
    if (soft->model == SPL_SOFT_MODEL_LAYER)
        return depth;
    const double ends[3] = {fmin(fmax(((double)params->near * length - middle) / r, -edge), edge),
                            fmin(fmax((until * length - middle) / r, -edge), edge), edge};
    double parts[3];
    for (int i = 0; i < 3; i++)
        parts[i] =
            soft->model == SPL_SOFT_MODEL_BASE
                ? spl_soft_base_part(delta, ends[i])
                : spl_soft_concentric_part(spl_soft_shells((double)params->fx * r / fmax(z, 1e-9)), delta, ends[i]);
    double whole = 2 * depth * parts[2], share = (parts[1] - parts[0]) / fmax(2 * parts[2], 1e-12);
    const double thinned = left * (a + (1 - a) * left);
    if (soft->blend > 0 && item->mark < SPL_MARK_WHOLE) {
        const double w = (item->mark - 1.0) / 254, opacity = (1 - delta) * (1 - w) - expm1(-whole) * w;
        return -log1p(-fmin(opacity * left, 1 - 1.0 / 1024)) * share;
    }
    return whole * thinned * share;
}

uint32_t soft_find(const struct spl_frame_params *params, const struct soft_item *items, uint32_t count, int x, int y,
                   uint32_t solid, const struct spl_soft_params *soft, double *doubt)
{
    const bool layer = soft->model == SPL_SOFT_MODEL_LAYER; /* all or nothing, by one opacity */
    const bool exact = (soft->of == SPL_SOFT_OF_FIRST && !layer) || soft->model == SPL_SOFT_MODEL_EXPRESS;
    const double wanted = soft->of == SPL_SOFT_OF_FIRST ? log(255 / 254.0) : M_LN2;
    uint32_t clear = SPL_SOFT_CLEAR;
    double depth = 0, until = (double)params->far;
    float surface;
    memcpy(&surface, &solid, 4);
    until = solid == SPL_NOTHING ? until : fmin((double)surface, until);
    *doubt = INFINITY;
    for (uint32_t i = 0; i < count; i++) {
        uint32_t key;
        memcpy(&key, &items[i].z, 4);
        if (key > solid)
            break;
        if (exact) {
            uint32_t opacity = soft_express(params, &items[i], x, y, soft->opacity, soft->blend > 0);
            if (soft->of == SPL_SOFT_OF_FIRST && opacity >= (uint32_t)lround(65536 / 255.0))
                return i;
            clear -= ((clear >> 8) * opacity) >> 8;
            if (soft->of == SPL_SOFT_OF_MEDIAN && clear < 1u << 23)
                return i;
            continue;
        }
        const double own = depth_of(params, &items[i], x, y, until, soft);
        depth = layer ? fmax(depth, own) : depth + own;
        *doubt = layer ? *doubt : fmin(*doubt, fabs(depth - wanted));
        if (depth > wanted)
            return i;
    }
    return UINT32_MAX;
}
