/* An image cut into tiles that fit the scratch buffers. Tiles overlap by as far as samples act on each other: with
 * method fill as its plan says, with splat by one. Everything belongs to the renderer's thread. */
#ifndef SPL_RENDER_TILING_H
#define SPL_RENDER_TILING_H

#include <splatd/render.h>

#include "base/error.h"
#include "render/fill.h"

struct spl_tile;

struct spl_tiling {
    struct spl_fill_plan fill; /* method fill: set before spl_tiling_init(), which sets the overlap of the others */
    uint32_t width, height;    /* of the largest tile, pixels */
};

/* The view's camera in samples. */
void spl_tiling_get_camera(const struct spl_view *view, struct spl_camera *camera);

/* How large tiles of at most `samples` can be. SPL_E_LIMIT names `kernel` where what it reaches does not fit. */
int spl_tiling_init(struct spl_tiling *tiling, const struct spl_view *view, uint64_t samples, struct spl_error *err);

/* Fills in the camera, place and parameters of the tile with its corner at pixel (x, y); its renderer, dataset and view
 * are set. */
void spl_tiling_place(const struct spl_tiling *tiling, uint32_t x, uint32_t y, struct spl_tile *tile);

#endif
