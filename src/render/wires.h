/* The wires of a dataset: its leaves' linear splats joined along themselves, as pieces of lines that method fill draws
 * whatever level of detail stands around them. */
#ifndef SPL_RENDER_WIRES_H
#define SPL_RENDER_WIRES_H

#include <splatd/camera.h>

#include "dataset/dataset.h"
#include "render/draw_list.h"

struct spl_wires;

/* Reads the linear splats of `dataset` and joins them. *out is the caller's. Blocks on disk; any thread. SPL_E_NOMEM,
 * SPL_E_CORRUPT when the file was cut short in place. */
int spl_wires_create(const struct spl_dataset *dataset, struct spl_wires **out, struct spl_error *err);
void spl_wires_destroy(struct spl_wires *wires);

/* Appends the pieces that `camera` may see to list->lines, in view space, ends at its near and far planes. SPL_E_NOMEM.
 */
int spl_wires_draw(const struct spl_wires *wires, const struct spl_camera *camera, struct spl_draw_list *list,
                   struct spl_error *err);

#endif
