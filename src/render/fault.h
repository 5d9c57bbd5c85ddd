/* Faults on demand, for tests of whoever renders. */
#ifndef SPL_RENDER_FAULT_H
#define SPL_RENDER_FAULT_H

#include <splatd/render.h>

/* The next submit reports a lost device. */
void spl_renderer_inject_loss(struct spl_renderer *renderer);

/* How much work the device is given at a time (render/draw_list.h). */
void spl_renderer_set_work_at_once(struct spl_renderer *renderer, uint64_t work);

/* How many soft spheres are held at once (render/soft/pass.h); 0 = as memory has room. */
void spl_renderer_set_soft_items(struct spl_renderer *renderer, uint32_t items);

#endif
