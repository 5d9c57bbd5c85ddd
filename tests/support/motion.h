/* Change from frame to frame along a path that the truth does not have (api/measures.md, Along a path). */
#ifndef SUPPORT_MOTION_H
#define SUPPORT_MOTION_H

#include <splatd/image.h>

struct motion { /* zeroed: nothing yet */
    size_t pixels;
    int16_t *previous; /* image - truth of the last frame, one plane a channel; NULL before the first */
    double sum, worst; /* mean square of a step: over all steps, of the worst */
    size_t steps;
};

/* Adds the next frame of the path: colour layers, all of one size. */
void motion_add(struct motion *motion, const struct spl_image *image, const struct spl_image *truth);

/* The path's figures in 8 bit levels, root mean square over all steps and of the worst step; NAN below two frames.
 * Either pointer may be NULL. Releases what `motion` holds and zeroes it. */
void motion_finish(struct motion *motion, double *flicker, double *popping);

#endif
