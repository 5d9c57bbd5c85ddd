/* Faults on demand, for tests of whoever renders. */
#ifndef SPL_RENDER_FAULT_H
#define SPL_RENDER_FAULT_H

#include <splatd/render.h>

/* The next submit reports a lost device. */
void spl_renderer_inject_loss(struct spl_renderer *renderer);

/* How much work the device is given at a time (render/draw_list.h). */
void spl_renderer_set_work_at_once(struct spl_renderer *renderer, uint64_t work);

/* How much a step of a frame has, before its tile is cut. */
void spl_renderer_set_work_a_step(struct spl_renderer *renderer, uint64_t work);

#endif
