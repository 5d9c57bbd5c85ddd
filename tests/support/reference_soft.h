/* Soft spheres in plain C, as the kernels draw them: every item on every sample, in the order of depth and then of ids.
 * With the same fixed point, so that it is equal to the bit. */
#ifndef TEST_SUPPORT_REFERENCE_SOFT_H
#define TEST_SUPPORT_REFERENCE_SOFT_H

#include <stdbool.h>
#include <stdint.h>

#include "shared_soft.h"

struct soft_item {
    float x, y, z, radius; /* view space; drawn no narrower than params->low_pass samples, and the thinner */
    uint8_t color[3], mark;
};

/* The rectangles of tiles that the item may reach, as items have them, at most 1024; returns how many there are.
 * `rects` may be NULL. */
uint32_t soft_rectangles(const struct spl_frame_params *params, const struct soft_item *item, uint32_t *rects);

/* Share that model express lets an item take of a sample of the image, of 65536. */
uint32_t soft_express(const struct spl_frame_params *params, const struct soft_item *item, int x, int y, double opacity,
                      bool border);

/* Blends items, which are in the order of their ids, over `state` (SPL_SOFT_STATE_WORDS a sample), in front of `solid`
 * (depth words). */
void soft_reference(const struct spl_frame_params *params, const struct soft_item *items, uint32_t count,
                    const uint32_t *solid, double opacity, bool border, uint32_t *state);

#endif
