/* Which soft sphere layers and picks speak of, where a view asks for the first or the median: of each sample its depth,
 * id, normal and what it is drawn as, for resolving to take in place of the solid's. Belongs to the renderer's
 * thread. */
#ifndef SPL_RENDER_SOFT_OF_H
#define SPL_RENDER_SOFT_OF_H

#include <splatd/render.h>

#include "render/soft/order.h"

/* Do layers of the view speak of anything but the solid? */
bool spl_soft_is_found(const struct spl_view *view);

/* Looks through what was listed from depth `from` (float bits) on, whose items have details, in front of the solid
 * depth; windows front to back, each from the end of the one before. `thin`: some are narrower than a sample. What was
 * found lies in SPL_SOFT_FOUND, which is cleared (to SPL_NOTHING) before the first. Runs what was recorded, and what it
 * records. */
int spl_soft_find(struct spl_soft_order *order, const struct spl_soft_params *soft, uint32_t from,
                  bool thin, struct spl_error *err);

#endif
