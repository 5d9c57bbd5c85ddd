/* One point of an image instead of the image: how it is rendered, and what comes of it. Pure; any thread. */
#ifndef SPL_RENDER_PICK_H
#define SPL_RENDER_PICK_H

#include <splatd/render.h>

/* The view of one pixel whose centre is point (x, y) of `view`'s image: principal point moved, nothing else, so the
 * splats, their sizes and the level of detail are those of the whole image, of which it is a piece. Of a bent camera 3
 * x 3 pixels of a face, in whose middle one the image is looked up. All layers but primitive, which follows from the
 * dataset; colours are the splats', without textures. `out` may be `view`. SPL_E_LIMIT, as spl_faces_init() names it,
 * of a camera whose faces are too large; SPL_E_USAGE of rays. */
int spl_pick_view(const struct spl_view *view, double x, double y, struct spl_view *out, struct spl_error *err);

/* Reads the pixel of `frame`, whose layers are those of spl_pick_view() (normals may be missing); `camera` is the
 * whole image's. `dataset` may be NULL where classes and primitives do not matter, else this may block on disk. */
void spl_pick_read(const struct spl_camera *camera, double x, double y, const struct spl_frame *frame,
                   const struct spl_dataset *dataset, struct spl_pick *pick);

#endif
