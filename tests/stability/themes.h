/* The suite's themes: what must hold always. */
#ifndef STABILITY_THEMES_H
#define STABILITY_THEMES_H

#include "world.h"

void check_places(struct suite *suite);   /* images lie where the truth lies */
void check_walls(struct suite *suite);    /* dense ones have no holes, noisy ones no bias */
void check_far_away(struct suite *suite); /* 5000 km from the origin all is as at it */
void check_levels(struct suite *suite);   /* finer is not worse than coarser */
void check_sums(struct suite *suite);     /* however many splats fall on a pixel, its colour is theirs */
void check_motion(struct suite *suite);   /* no pop along a dolly, a turn, an approach */
void check_layers(struct suite *suite);   /* finite, in range, layers agree with each other; equal bytes on repeat */
void check_soft(struct suite *suite);     /* soft spheres are those of all rays in doubles, however many and wherever */
void check_maps(struct suite *suite);     /* with maps images lie where they did, silhouettes are finer, nothing pops */
void check_flips(struct suite *suite);    /* around soft spheres no order flips */
void check_drivers(struct suite *suite);  /* suite->renderer against suite->other */

/* Holds one frame to what each of its layers may hold; a frame of all layers. */
void check_kinds(struct suite *suite, const struct world *world, const struct spl_view *view,
                 const struct spl_frame *frame, struct place place);

/* The same, and equal bytes when it is rendered again. */
void check_frame(struct suite *suite, const struct world *world, const struct spl_view *view, struct place place);

#endif
