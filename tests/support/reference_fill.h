/* Method fill's filter in plain C, level by level, on whole arrays of samples. */
#ifndef TEST_SUPPORT_REFERENCE_FILL_H
#define TEST_SUPPORT_REFERENCE_FILL_H

#include <stdbool.h>
#include <stdint.h>

#include <splatd/render.h>

#include "dataset/chunk.h"
#include "render/fill.h"

struct fill_sample {
    uint32_t word; /* depth with spacing and linear bit, SPL_NOTHING = none; afterwards the plain depth's bits */
    uint32_t id;
    double color[3]; /* whole numbers */
    double normal[3];
};

/* The code of a splat's radius, of a dataset whose median radius is `median`. */
uint32_t reference_fill_code(float radius, double median);

/* Filters the samples in place; `focal` in samples. */
void reference_fill(struct fill_sample *samples, uint32_t width, uint32_t height, double focal, double median,
                    const struct spl_view *view, const struct spl_fill_plan *plan);

#endif
