/* Splats as points: what methods points and those that filter them have in common. */
#ifndef SPL_RENDER_POINTS_H
#define SPL_RENDER_POINTS_H

#include "render/renderer.h"

/* Clears depths and payloads, and records the points of `group` into them: each splat's centre on the one sample it
 * falls on, the nearest wins. `filled`: depth words carry the points' spacing for the screen-space filter, and the
 * list's lines are drawn too. */
int spl_points_record(struct spl_tile *tile, uint32_t group, bool filled, struct spl_error *err);

#endif
