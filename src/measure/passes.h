/* What the passes of a frame take with and without textures (table 3 of the sparse-coding paper). */
#ifndef SPL_MEASURE_PASSES_H
#define SPL_MEASURE_PASSES_H

#include <splatd/render.h>

enum { SPL_PASSES_VIEWS = 3, SPL_PASSES_CAPS = 4, SPL_PASSES_ROUNDS_MAX = 1000 };

/* Medians, milliseconds. The paper's culling is `select`, its visibility pass `depth`, its attribute pass `shade`. */
struct spl_passes_times {
    double select, depth, shade, resolve, frame; /* frame: everything but reading back */
};

struct spl_passes_view {
    double distance; /* share of the default view's */
    uint64_t splats; /* drawn */
    double covered;  /* share of the image's pixels */
    struct spl_passes_times times[SPL_PASSES_CAPS];
};

extern const uint32_t spl_passes_caps[SPL_PASSES_CAPS]; /* atoms a splat at most: 0 (coloured), 1, 4, 8 */

/* Renders `dataset` (added to `renderer`) at its default view and at 2/5 and 1/5 of its distance, width x height,
 * lod 1, `rounds` times (1..SPL_PASSES_ROUNDS_MAX), the caps in turn, after a round that is not counted. The renderer's
 * thread; blocks. */
int spl_passes_measure(struct spl_renderer *renderer, const struct spl_dataset *dataset, uint32_t width,
                       uint32_t height, uint32_t rounds, struct spl_passes_view views[SPL_PASSES_VIEWS],
                       struct spl_error *err);

#endif
