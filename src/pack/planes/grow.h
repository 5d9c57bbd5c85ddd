/* Planes take the points beside them, and are settled. The room of pack/planes/. */
#ifndef SPL_PACK_PLANES_GROW_H
#define SPL_PACK_PLANES_GROW_H

#include "pack/planes/planes.h"
#include "pack/planes/regions.h"

/* Gives points without a label (of regions) that of a region which lies beside them, when they lie on it. Uses the
 * levels' lists. Parallel; SPL_E_NOMEM, SPL_E_CANCELLED. */
int spl_planes_grow(uint32_t *label, const struct spl_regions *regions, struct spl_plane_levels *levels,
                    const struct spl_points *points, const struct spl_plane_limits_list *limits,
                    struct spl_stage *stage, struct spl_error *err);

/* Fits each region's plane to all of its points, lets those go that are off by more than the bound, dissolves planes of
 * too few points, and numbers what is left: labels become indices into planes->list. Parallel. What it allocates in
 * `planes` is the caller's, on failure too. SPL_E_NOMEM. */
int spl_planes_settle(struct spl_planes *planes, uint32_t *label, struct spl_regions *regions,
                      const struct spl_points *points, const struct spl_plane_limits_list *limits, unsigned threads,
                      struct spl_error *err);

#endif
