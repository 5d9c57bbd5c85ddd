/* Smooth pieces of what no plane took. The room of pack/planes/. */
#ifndef SPL_PACK_PLANES_SMOOTH_H
#define SPL_PACK_PLANES_SMOOTH_H

#include "pack/planes/lists.h"
#include "pack/planes/patches.h"
#include "pack/planes/planes.h"

/* Appends pieces with relief to planes->list, takes those planes from it that are facets of them, and sets label[] of
 * points, indices into the list before and after. Uses the levels' lists. Parallel; the result does not depend on the
 * number of threads. What it allocates in `planes` is the caller's, on failure too. SPL_E_NOMEM, SPL_E_CANCELLED. */
int spl_smooth_find(struct spl_planes *planes, uint32_t *label, struct spl_plane_levels *levels,
                    const struct spl_points *points, const struct spl_plane_limits_list *limits,
                    struct spl_stage *stage, struct spl_error *err);

#endif
