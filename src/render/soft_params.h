/* What is judged of soft transparency; include/splatd/soft.h has the rest. Pure; any thread. */
#ifndef SPL_RENDER_SOFT_PARAMS_H
#define SPL_RENDER_SOFT_PARAMS_H

#include <splatd/render.h>
#include <splatd/soft.h>

enum { SPL_SOFT_FAULT_MAX = 96 };

/* Is it in range? Else `fault` goes on from "the term": "has a direction without length". */
bool spl_soft_check_term(const struct spl_soft_term *term, char fault[SPL_SOFT_FAULT_MAX]);

/* Does a view show soft spheres, if there are any? Not where nothing is soft, nothing of it is drawn, or its layers speak
 * of the solid alone. */
bool spl_view_shows_soft(const struct spl_view *view);

#endif
