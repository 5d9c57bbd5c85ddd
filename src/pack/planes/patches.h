/* Flat cells of the octree over sorted points. The room of pack/planes/. */
#ifndef SPL_PACK_PLANES_PATCHES_H
#define SPL_PACK_PLANES_PATCHES_H

#include "pack/planes/fit.h"
#include "pack/stage.h"

struct spl_patches {
    struct spl_patch *list; /* in the order of their cells; owned */
    uint32_t count;
};

/* Fills `limits`, which the caller finishes, on failure too. Noise is the sigma of the distances to small planes, the
 * median over places of each share of the scan, where they say something, and at most twice that of all; 0 where the
 * scan has none. Bounds are `error`, or where it is 0 follow from noise and spacing (planes.h). Parallel.
 * SPL_E_NOMEM. */
int spl_plane_limits_find(struct spl_plane_limits_list *limits, const struct spl_points *points, double error,
                          unsigned threads, struct spl_error *err);
void spl_plane_limits_finish(struct spl_plane_limits_list *limits);

/* Sets label[] of each point to its patch or SPL_NO_PLANE. With `taken` (else NULL) patches may bend (fit.h), and are
 * of points alone of which it has SPL_NO_PLANE. `patches` is finished by the caller, on failure too. Parallel.
 * SPL_E_NOMEM; a stage that is cancelled leaves what the caller does not use. */
int spl_patches_find(struct spl_patches *patches, uint32_t *label, const uint32_t *taken,
                     const struct spl_points *points, const struct spl_plane_limits_list *limits,
                     struct spl_stage *stage, struct spl_error *err);

void spl_patches_finish(struct spl_patches *patches);

#endif
