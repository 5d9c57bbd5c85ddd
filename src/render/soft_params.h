/* What is judged of soft transparency; include/splatd/soft.h has the rest. Pure; any thread. */
#ifndef SPL_RENDER_SOFT_PARAMS_H
#define SPL_RENDER_SOFT_PARAMS_H

#include <splatd/render.h>

/* Does a view show soft spheres, if there are any? Not where nothing is soft, nothing of it is drawn, or its layers
 * speak of the solid alone. */
bool spl_view_shows_soft(const struct spl_view *view);

#endif
