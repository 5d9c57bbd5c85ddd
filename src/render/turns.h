/* Frames that others wait for, for who lets frames take turns. The renderer's thread. */
#ifndef SPL_RENDER_TURNS_H
#define SPL_RENDER_TURNS_H

#include <splatd/render.h>

#include "render/soft/pause.h"

/* `asked` is called, with `context`, while a step draws what may take long, and says whether it shall end. Until then
 * steps draw what they began to its end. */
void spl_frame_set_gives_way(struct spl_frame_steps *steps, spl_frame_gives_way *asked, void *context);

/* Did the last step end in the middle of a piece? Its samples are left, and the next goes on there. */
bool spl_frame_is_paused(const struct spl_frame_steps *steps);

#endif
