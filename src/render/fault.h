/* Faults: on demand, for tests of whoever renders, and whose they were. */
#ifndef SPL_RENDER_FAULT_H
#define SPL_RENDER_FAULT_H

#include <splatd/render.h>

/* The next submit reports a lost device. */
void spl_renderer_inject_loss(struct spl_renderer *renderer);
/* The one after so many of them does: in the middle of a frame that has several. */
void spl_renderer_inject_loss_after(struct spl_renderer *renderer, uint32_t submits);

/* The dataset in whose page, on its way to the device, that was lost; NULL: in none. To be compared: it may have gone
 * since. */
const struct spl_dataset *spl_renderer_get_lost_dataset(const struct spl_renderer *renderer);

/* How much work the device is given at a time (render/draw_list.h). */
void spl_renderer_set_work_at_once(struct spl_renderer *renderer, uint64_t work);

/* How many soft spheres are held at once (render/soft/pass.h); 0 = as memory has room. */
void spl_renderer_set_soft_items(struct spl_renderer *renderer, uint32_t items);
/* How much a step of a frame has, before its tile is cut; then pieces may be of any size. */
void spl_renderer_set_work_a_step(struct spl_renderer *renderer, uint64_t work);
/* How long a step may take where that is known, and how long a unit of work is said to take, 0 = not known. After
 * spl_renderer_set_work_a_step(), with which steps have so much work however long it takes. */
void spl_renderer_set_pace(struct spl_renderer *renderer, uint64_t step_ns, double work_ns);
/* How many more kernels are kept than a service does (render/kernels.h): each is made once where so many are enough. */
void spl_renderer_set_kernels_more(struct spl_renderer *renderer, size_t more);
/* Whether discs are drawn by the kernels for hardware (shaders/common/walk.glsl) or those for software drivers. */
void spl_renderer_set_shares(struct spl_renderer *renderer, bool shares);

#endif
