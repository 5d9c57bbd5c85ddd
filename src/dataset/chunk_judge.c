/* Opening: what a chunk's header may say, so that whatever its page holds, each code decodes to finite numbers and
 * nobody looks beyond its words. Pure; any thread. */
#include "dataset/codec.h"

#include <math.h>
#include <stdlib.h>

#include "dataset/chunk_clip.h"

static bool positive(float value)
{
    return value > 0 && isfinite(value);
}

static bool ends_finite(float origin, float step, unsigned bits)
{
    return isfinite(origin) && isfinite(step) && isfinite(origin + step * (float)((1u << bits) - 1));
}

const char *spl_discs_judge(const struct spl_chunk *c)
{
    uint32_t g = c->geometry_bits, color = c->color_bits, extra = c->extra_bits;
    unsigned u = g >> SPL_GEOMETRY_U & 15, v = g >> SPL_GEOMETRY_V & 15, radius = g >> SPL_GEOMETRY_RADIUS & 15;
    if (c->count == 0 || c->count > SPL_CHUNK_SPLATS)
        return "has no splats, or more than 128";
    if (!positive(c->step) || !positive(c->radius_min) || !positive(c->radius_mean) || !positive(c->radius_step) ||
        !positive(c->normal_step))
        return "has a step or radius that is not positive";
    for (int a = 0; a < 3; a++) {
        unsigned bits = g >> (SPL_GEOMETRY_X + 5 * a) & 31;
        if (bits > 24 || !ends_finite(c->origin[a], c->step, bits))
            return "has positions that are not finite, or more than 24 bits wide";
    }
    if (u > 12 || v > 12 || radius > 12 || !ends_finite(c->normal_u, c->normal_step, u) ||
        !ends_finite(c->normal_v, c->normal_step, v) || !ends_finite(c->radius_min, c->radius_step, radius))
        return "has normals or radii that are not finite, or more than 12 bits wide";
    if (fabsf(c->normal_u) > 4 || fabsf(c->normal_v) > 4 || c->normal_u + c->normal_step * (float)((1u << u) - 1) > 4 ||
        c->normal_v + c->normal_step * (float)((1u << v) - 1) > 4)
        return "has normals off the octahedron";
    if ((g >> SPL_GEOMETRY_AXIS & 3) == 3 || g >> SPL_GEOMETRY_LINEAR > SPL_LINEAR_SOME)
        return "has geometry bits that version 2 does not know";
    int base_u = (int16_t)(c->color_base & 0xffff), base_v = (int16_t)(c->color_base >> 16);
    if ((color >> SPL_COLOR_Y & 15) > 8 || (color >> SPL_COLOR_U & 15) > 9 || (color >> SPL_COLOR_V & 15) > 9 ||
        color & 0xff00f000u || abs(base_u) > 255 || abs(base_v) > 255)
        return "has colours wider than 8 bits";
    if (extra & ~(255u << SPL_EXTRA_CLIP | 255u << SPL_EXTRA_KIND))
        return "has extra bits that version 2 does not know";
    if (spl_clip_count(c) > c->count)
        return "has more clip lines than splats";
    return NULL;
}
