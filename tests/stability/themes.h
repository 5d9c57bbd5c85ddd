/* The suite's themes, one file each. */
#ifndef STABILITY_THEMES_H
#define STABILITY_THEMES_H

#include "world.h"

/* What must hold always. */
void check_layers(struct suite *suite); /* finite, in range, layers agree with each other; equal bytes on repeat */
void check_surfaces(
    struct suite *suite); /* dense walls have no holes, noisy ones no bias; far places are like near ones */
void check_drivers(struct suite *suite); /* suite->renderer against suite->other */

#endif
