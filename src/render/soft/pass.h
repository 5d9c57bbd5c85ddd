/* The stage of a tile that draws what is soft, over what a method drew of the rest: counting, windows of depth,
 * sorting, lists, blending, finding. What it leaves is a share and a colour a sample, for resolving to put over the
 * solid, and where it is asked for a sphere in place of it. Everything belongs to the renderer's thread. */
#ifndef SPL_RENDER_SOFT_PASS_H
#define SPL_RENDER_SOFT_PASS_H

#include "render/renderer.h"

/* Makes room for the list's soft spheres on a tile of such a camera, at the cost of pages that the frame has not asked
 * for, and tells chunks where their slots start; before the list is uploaded. Nothing where there are none. SPL_E_LIMIT
 * as spl_scratch_upload(). */
int spl_soft_prepare(struct spl_renderer *renderer, const struct spl_camera *camera, const struct spl_view *view,
                     struct spl_error *err);

/* Is there anything soft to draw? */
bool spl_soft_is_drawn(const struct spl_tile *tile);

/* Records and runs it, once the solid depth is there: blends it where the layers of this `group` (SPL_SUMS_*) are
 * colours, and finds what the other layers of the view speak of. Of a tile's first group alone: the colours, where it
 * has any. SPL_FRAME_TOO_MUCH: the tile has more than a pixel, and more spheres overlap in it than are held at once;
 * its pieces are to be drawn instead. SPL_FRAME_PAUSED: tile->pause was due. SPL_E_LIMIT, field soft_model, where a
 * pixel has so many. */
int spl_soft_record(struct spl_tile *tile, uint32_t group, struct spl_error *err);

#endif
