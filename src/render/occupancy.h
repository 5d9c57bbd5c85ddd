/* An upper bound of how many splats can reach any one sample, so that the shade pass picks the largest fragment weight
 * whose 32 bit sums cannot wrap: cells of 16 x 16 samples count the splats of every chunk whose bounds touch them. */
#ifndef SPL_RENDER_OCCUPANCY_H
#define SPL_RENDER_OCCUPANCY_H

#include <stdint.h>

#include "base/error.h"

struct spl_occupancy {
    uint32_t columns, rows;
    uint64_t everywhere;   /* splats of chunks that have no bounded projection */
    uint64_t *cells;       /* 2-D differences until the bound is asked for: one add a corner, whatever the size */
};

int spl_occupancy_init(struct spl_occupancy *occupancy, uint32_t width, uint32_t height, struct spl_error *err);
void spl_occupancy_finish(struct spl_occupancy *occupancy);

/* Counts `splats` over the samples [low, high], or over the whole image. */
void spl_occupancy_add(struct spl_occupancy *occupancy, const double low[2], const double high[2], uint32_t splats);
void spl_occupancy_add_everywhere(struct spl_occupancy *occupancy, uint32_t splats);

/* Adds what another of the same size counted, before its bound is asked for. */
void spl_occupancy_join(struct spl_occupancy *to, const struct spl_occupancy *from);
/* The largest cell. Call once, after the last add. */
uint64_t spl_occupancy_bound(struct spl_occupancy *occupancy);

/* The largest weight of a fragment such that the sums over `splats` splats and `panels` panels stay below 2^32: each
 * fragment adds at most 512 weight to any word (shaders/splat_shade.comp). A panel may add one, and for each of its
 * cells one of weight 1 (shaders/common/panel_draw.glsl). 0 when even weight 1 is too much. */
uint32_t spl_occupancy_weight(uint64_t splats, uint64_t panels);

#endif
