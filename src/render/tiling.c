/* Tiles of whole pixels, as wide as the image where they fit. A tile is the image's camera shifted by whole samples.
 * Kernels are told the image's camera and where the tile begins, so that nothing is rounded from a tile's own corner;
 * cells of the fill pyramid begin at multiples of their size from the guard's corner. So a pixel has the same bytes
 * however the image is cut. Supersampling is a larger tile that the resolve pass averages. */
#include "render/tiling.h"

#include <math.h>

#include "geom/size.h"
#include "render/method.h"
#include "render/renderer.h"

void spl_tiling_get_camera(const struct spl_view *view, struct spl_camera *camera)
{
    uint32_t side = (uint32_t)view->supersample;
    *camera = view->camera;
    camera->width *= side;
    camera->height *= side;
    spl_camera_scale(camera, side, side);
}

int spl_tiling_init(struct spl_tiling *tiling, const struct spl_view *view, uint64_t samples, struct spl_error *err)
{
    uint32_t side = (uint32_t)view->supersample, layers = (uint32_t)__builtin_popcount(view->layers);
    const struct spl_reach *reach = &tiling->reach;
    uint64_t guard = 2 * (uint64_t)reach->guard, around = 2 * (uint64_t)reach->apron + reach->align - 1;
    uint64_t square = (uint64_t)sqrt((double)samples);
    if ((view->camera.width * side + guard) * (view->camera.height * side + guard) <= samples)
        around = guard;
    if (square < around + side)
        return spl_fail_field(err, SPL_E_LIMIT, "kernel",
                              "what is looked at around a pixel, %llu samples across, needs tiles of more than %llu "
                              "samples; ask for a smaller kernel",
                              (unsigned long long)(around + side), (unsigned long long)samples);
    uint64_t per_pixel = (uint64_t)side * side > layers ? (uint64_t)side * side : layers;
    uint64_t widest = around
                          ? (samples / 2 / (around + side) > square ? samples / 2 / (around + side) : square) - around
                          : samples / per_pixel * side;
    tiling->width = view->camera.width < widest / side ? view->camera.width : (uint32_t)(widest / side);
    uint64_t rows = (samples / (tiling->width * side + around) - around) / side,
             most = samples / layers / tiling->width;
    rows = rows < most ? rows : most;
    tiling->height = view->camera.height < rows ? view->camera.height : (uint32_t)rows;
    return SPL_OK;
}

/* The range [begin, end) of pixels along an axis of `size` pixels, in samples, with what is drawn around it. */
static void widen(const struct spl_reach *reach, uint32_t side, uint32_t size, uint32_t begin, uint32_t end,
                  int64_t *from, int64_t *to)
{
    int64_t guarded = (int64_t)begin * side - reach->apron + reach->guard;
    *from = (guarded > 0 ? guarded - guarded % reach->align : 0) - reach->guard;
    *to = (int64_t)end * side + reach->apron;
    *to = *to > (int64_t)size * side + reach->guard ? (int64_t)size * side + reach->guard : *to;
}

/* Do backs of discs lie behind what faces the eye? Only where sides are not guessed: a room turned inside out would
 * show its neighbours' walls. */
static bool has_sides(const struct spl_dataset_info *info, const struct spl_view *view)
{
    return info->has_sides || info->panels || info->meshes || (info->maps && spl_view_get_maps(view));
}

/* Can depth words of method splat spare the bits that say which side is seen? */
static bool tells_sides(const struct spl_tile *tile)
{
    const struct spl_camera *camera = &tile->camera;
    const struct spl_dataset_info *info = spl_dataset_get_info(tile->resident->dataset);
    double farthest = 0, margin = tile->view->disc.margin * (double)SPL_LOW_PASS / camera->fx;
    if (camera->projection != SPL_ORTHOGRAPHIC)
        return margin >= (double)SPL_SIDE_SHARE;
    for (int a = 0; a < 3; a++) {
        double axis = camera->rotation[6 + a];
        farthest += axis * ((axis > 0 ? info->bounds_max : info->bounds_min)[a] - camera->eye[a]);
    }
    return margin >= (double)SPL_SIDE_SHARE * farthest;
}

static void set_params(struct spl_tile *tile)
{
    const struct spl_camera *camera = &tile->camera;
    const struct spl_view *view = tile->view;
    const struct spl_dataset_info *info = spl_dataset_get_info(tile->resident->dataset);
    const uint8_t *b = view->background;
    tile->params = (struct spl_frame_params){
        .fx = (float)camera->fx,
        .fy = (float)camera->fy,
        .near = (float)camera->near,
        .far = isfinite(camera->far) ? (float)camera->far : 3.4e38f,
        .low_pass = SPL_LOW_PASS,
        .margin = (float)view->disc.margin,
        .width = camera->width,
        .height = camera->height,
        .supersample = (uint32_t)view->supersample,
        .inverse_fx = 1 / (float)camera->fx,
        .inverse_fy = 1 / (float)camera->fy,
        .inverse_low_pass_squared = 1 / (SPL_LOW_PASS * SPL_LOW_PASS),
        .texture_size = info->texture_size,
        .background = b[0] | b[1] << 8 | b[2] << 16 | (uint32_t)b[3] << 24,
        .crop_width = tile->width,
        .crop_height = tile->height,
        .flags = has_sides(info, view) ? SPL_FRAME_SIDED : 0,
        .side_bits = tells_sides(tile) ? SPL_SIDE_BITS : 0,
    };
    for (int row = 0; row < 3; row++)
        for (int column = 0; column < 3; column++)
            tile->params.rotation[4 * row + column] = (float)camera->rotation[3 * row + column];
}

struct spl_piece spl_tiling_get_tile(const struct spl_tiling *tiling, const struct spl_camera *whole, uint32_t x,
                                     uint32_t y)
{
    uint32_t width = whole->width - x, height = whole->height - y;
    return (struct spl_piece){.x = x,
                              .y = y,
                              .width = width < tiling->width ? width : tiling->width,
                              .height = height < tiling->height ? height : tiling->height};
}

void spl_tiling_place(const struct spl_tiling *tiling, const struct spl_piece *place, struct spl_tile *tile)
{
    const struct spl_camera *whole = &tile->view->camera;
    const uint32_t side = (uint32_t)tile->view->supersample, x = place->x, y = place->y;
    tile->x = x;
    tile->y = y;
    tile->width = place->width;
    tile->height = place->height;
    tile->fill = tiling->fill;
    int64_t from[2], to[2];
    widen(&tiling->reach, side, whole->width, x, x + tile->width, &from[0], &to[0]);
    widen(&tiling->reach, side, whole->height, y, y + tile->height, &from[1], &to[1]);
    spl_tiling_get_camera(tile->view, &tile->camera);
    const double cx = tile->camera.cx + tiling->reach.guard, cy = tile->camera.cy + tiling->reach.guard;
    tile->camera.width = (uint32_t)(to[0] - from[0]);
    tile->camera.height = (uint32_t)(to[1] - from[1]);
    tile->camera.cx -= (double)from[0];
    tile->camera.cy -= (double)from[1];
    tile->samples = (uint64_t)tile->camera.width * tile->camera.height;
    set_params(tile);
    tile->params.cx = (float)cx;
    tile->params.cy = (float)cy;
    tile->params.tile_x = (uint32_t)(from[0] + tiling->reach.guard);
    tile->params.tile_y = (uint32_t)(from[1] + tiling->reach.guard);
    tile->params.crop_x = (uint32_t)((int64_t)x * side - from[0]);
    tile->params.crop_y = (uint32_t)((int64_t)y * side - from[1]);
    const struct spl_method_row *method = spl_method_row(tile->view->method);
    if (method->place)
        method->place(tile);
}
