/* Shading for shape in a tile (shaders/shade.comp): light from normals, which a group of their own is drawn for first,
 * then eye-dome lighting from the depths that the colours leave. What they come to is a factor a sample, which
 * resolving multiplies colours with: so it is the same for every method, under soft spheres and in every tile. Belongs
 * to the renderer's thread. */
#include <math.h>

#include "render/method.h"
#include "render/renderer.h"

uint32_t spl_shade_get_kinds(const struct spl_view *view, const struct spl_dataset_info *info)
{
    return view->layers >> SPL_LAYER_COLOR & 1 ? spl_shade_for(view, info) : 0;
}

uint32_t spl_tile_get_shades(const struct spl_tile *tile)
{
    return spl_shade_get_kinds(tile->view, spl_dataset_get_info(tile->resident->dataset));
}

uint32_t spl_shade_get_reach(const struct spl_view *view, const struct spl_dataset_info *info)
{
    const bool looks = spl_shade_get_kinds(view, info) & SPL_SHADE_EDL;
    return looks ? view->shade.radius * (uint32_t)view->supersample : 0;
}

/* Towards the sun, view space. */
static void see_sun(const struct spl_tile *tile, float out[3])
{
    const double degree = acos(-1) / 180, *sun = tile->view->shade.sun;
    const double flat = cos(sun[1] * degree);
    const double world[3] = {flat * sin(sun[0] * degree), flat * cos(sun[0] * degree), sin(sun[1] * degree)};
    for (int i = 0; i < 3; i++) {
        const double *r = tile->camera.rotation + 3 * i;
        out[i] = (float)(r[0] * world[0] + r[1] * world[1] + r[2] * world[2]);
    }
}

/* The steps in which splats overlap: of the finest, in units; of coarser ones, which are as large as lod samples, as a
 * share of the distance, or in units along parallel rays. */
static void see_splats(const struct spl_tile *tile, float out[2])
{
    out[0] = SPL_SHADE_ROUGH * (float)spl_dataset_get_info(tile->resident->dataset)->splat_radius;
    out[1] = SPL_SHADE_ROUGH * (float)(tile->view->lod / (tile->view->camera.fx * tile->params.supersample));
}

static int dispatch(struct spl_tile *tile, uint32_t kinds, bool lit, struct spl_error *err)
{
    const struct spl_method_row *method = spl_method_row(tile->view->method);
    const struct spl_view *view = tile->view;
    struct spl_frame_params params = tile->params;
    const uint32_t side = params.supersample;
    const int64_t from[2] = {(int64_t)tile->x * side - params.crop_x, (int64_t)tile->y * side - params.crop_y};
    const int64_t size[2] = {(int64_t)view->camera.width * side, (int64_t)view->camera.height * side};
    const uint32_t drawn[2] = {params.width, params.height};
    uint32_t *const low[2] = {&params.fill_level, &params.fill_from};
    uint32_t *const end[2] = {&params.fill_to, &params.fill_stride};
    for (int i = 0; i < 2; i++) { /* what of the tile lies in the image, or around one that goes on */
        const bool cut = !view->surrounded;
        *low[i] = cut && from[i] < 0 ? (uint32_t)-from[i] : 0;
        *end[i] = cut && size[i] - from[i] < drawn[i] ? (uint32_t)(size[i] - from[i]) : drawn[i];
    }
    params.entries = (uint32_t)tile->samples;
    params.map_near = (float)view->shade.strength;
    params.map_sides = view->shade.radius * side;
    see_sun(tile, params.map_pose);
    see_splats(tile, params.map_pose + 3);
    const struct spl_kernel_key key = {"shade", !method->sums, {method->resolve, kinds, lit}};
    return spl_tile_dispatch_items(tile, &key, &params, params.entries, err);
}

_Static_assert((int)SPL_SHADE_EDL == SPL_SHADES_EDL && (int)SPL_SHADE_HEADLIGHT == SPL_SHADES_HEADLIGHT &&
                   (int)SPL_SHADE_SUN == SPL_SHADES_SUN,
               "the kernel knows each kind by the same bit");

int spl_tile_light(struct spl_tile *tile, bool *first, struct spl_error *err)
{
    const uint32_t kinds = spl_tile_get_shades(tile) & (SPL_SHADE_HEADLIGHT | SPL_SHADE_SUN);
    if (!kinds)
        return SPL_OK;
    int rc = spl_method_row(tile->view->method)->record(tile, SPL_SUMS_NORMAL, *first, err);
    *first = false;
    rc = rc ? rc : dispatch(tile, kinds, false, err);
    spl_tile_end_group(tile);
    spl_tile_stamp(tile, SPL_STAGE_SHADE);
    return rc;
}

int spl_tile_deepen(struct spl_tile *tile, struct spl_error *err)
{
    const uint32_t kinds = spl_tile_get_shades(tile);
    if (!(kinds & SPL_SHADE_EDL))
        return SPL_OK;
    int rc = dispatch(tile, SPL_SHADE_EDL, kinds != SPL_SHADE_EDL, err);
    spl_tile_stamp(tile, SPL_STAGE_SHADE);
    return rc;
}
