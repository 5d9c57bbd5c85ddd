/* The screen-space filter: closes the holes between samples and removes those that shine through from behind.
 * Paper: screen-space-filling, section 2. Everything belongs to the renderer's thread. */
#ifndef SPL_RENDER_FILL_H
#define SPL_RENDER_FILL_H

#include <stdbool.h>
#include <stdint.h>

#include <splatd/render.h>

#include "base/error.h"

struct spl_tile;
struct spl_reach;

/* What one image is filtered with, whatever its tiles. Lengths in samples. */
struct spl_fill_plan {
    double kernel;   /* the farthest that a point hides others */
    uint32_t rings;  /* levels of the pyramid that visibility looks at */
    uint32_t levels; /* of the pyramid that holes are filled from */
};

/* `spacing`: how far points lie apart where the image shows them sparsest, samples. `reach`: what that makes of tiles.
 */
void spl_fill_plan_init(struct spl_fill_plan *plan, struct spl_reach *reach, const struct spl_view *view,
                        double spacing);

/* Fills in what the kernels read of the tile's parameters. */
void spl_fill_set_params(struct spl_tile *tile);

/* Records the filter over the depth and payloads of `group`, as spl_points_record() leaves them `filled`; leaves them
 * the same way, with plain depths. Normals of datasets without any are the filled depth's. What the `first` group
 * leaves in the planes, the visible samples, serves the tile's other groups. */
int spl_fill_record(struct spl_tile *tile, uint32_t group, bool first, struct spl_error *err);

#endif
