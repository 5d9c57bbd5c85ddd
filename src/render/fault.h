/* Faults on demand, for tests of whoever renders. */
#ifndef SPL_RENDER_FAULT_H
#define SPL_RENDER_FAULT_H

#include <splatd/render.h>

/* The next submit reports a lost device. */
void spl_renderer_inject_loss(struct spl_renderer *renderer);

#endif
