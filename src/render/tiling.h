/* An image cut into tiles that fit the scratch buffers. Tiles overlap by as far as samples act on each other.
 * Everything belongs to the renderer's thread. */
#ifndef SPL_RENDER_TILING_H
#define SPL_RENDER_TILING_H

#include <splatd/render.h>

#include "base/error.h"
#include "render/fill.h"
#include "render/pieces.h"

struct spl_tile;

/* How far samples act on each other. */
struct spl_reach {
    uint32_t align; /* tiles begin at multiples of it from where the guard begins; at least 1 */
    uint32_t guard; /* drawn around the image, and looked at */
    uint32_t apron; /* drawn around a tile; a multiple of align */
};

struct spl_tiling {
    struct spl_reach reach;    /* set before spl_tiling_init(), as the next */
    struct spl_fill_plan fill; /* of methods that fill */
    uint32_t width, height;    /* of the largest tile, pixels */
};

/* The view's camera in samples. */
void spl_tiling_get_camera(const struct spl_view *view, struct spl_camera *camera);

/* How large tiles of at most `samples` can be. SPL_E_LIMIT where what samples reach does not fit. */
int spl_tiling_init(struct spl_tiling *tiling, const struct spl_view *view, uint64_t samples, struct spl_error *err);

/* The tile with its corner at pixel (x, y) of the view's image. */
struct spl_piece spl_tiling_get_tile(const struct spl_tiling *tiling, const struct spl_camera *whole, uint32_t x,
                                     uint32_t y);

/* Fills in the camera, place and parameters of the tile, or of a piece of one; its renderer, dataset and view are set.
 */
void spl_tiling_place(const struct spl_tiling *tiling, const struct spl_piece *place, struct spl_tile *tile);

#endif
