/* Pieces of wires that method fill draws, whatever level of detail stands around them. */
#ifndef SPL_RENDER_WIRES_H
#define SPL_RENDER_WIRES_H

#include <splatd/camera.h>

#include "dataset/wires.h"
#include "render/draw_list.h"

/* Appends the pieces that `camera` may see to list->lines, in view space, ends at its near and far planes. SPL_E_NOMEM.
 */
int spl_wires_draw(const struct spl_wires *wires, const struct spl_camera *camera, struct spl_draw_list *list,
                   struct spl_error *err);

#endif
