/* Method fill's filter in plain C, level by level, on whole arrays of samples. */
#ifndef TEST_SUPPORT_REFERENCE_FILL_H
#define TEST_SUPPORT_REFERENCE_FILL_H

#include <stdbool.h>
#include <stdint.h>

#include <splatd/render.h>

#include "dataset/chunk.h"

struct fill_sample {
    uint32_t word; /* depth with spacing and linear bit, SPL_NOTHING = none; afterwards the plain depth's bits */
    uint32_t id;
    double color[3]; /* whole numbers */
    double normal[3];
};

/* What an image is filtered with. Lengths in samples. */
struct fill_plan {
    double kernel;          /* the farthest that a point hides others */
    uint32_t rings, levels; /* of the pyramids that visibility looks at and that holes are filled from */
    uint32_t guard;         /* drawn around the image */
};

/* That of points which lie `spacing` samples apart where they are sparsest. */
struct fill_plan fill_plan_of(const struct spl_view *view, double spacing);

/* The code of a splat's radius, of a dataset whose median radius is `median`. */
uint32_t reference_fill_code(float radius, double median);

/* Filters the samples in place; `focal` along x and y, in samples: points reach as far as the longer one
 * says. */
void reference_fill(struct fill_sample *samples, const struct spl_camera *camera, double median,
                    const struct spl_view *view, const struct fill_plan *plan);

#endif
