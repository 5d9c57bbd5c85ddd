/* A caller's view as the renderer knows it. */
#ifndef SPL_RENDER_VIEW_H
#define SPL_RENDER_VIEW_H

#include <splatd/render.h>

#include "base/error.h"

/* Reads `given` by its size, with defaults where it ends, and checks it: errors as of spl_view_check(). Pure; any
 * thread. */
int spl_view_read(const struct spl_view *given, struct spl_view *view, struct spl_error *err);

#endif
