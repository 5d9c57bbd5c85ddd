/* Small JPEGs for people: a picture, and where it differs from another. */
#ifndef SPL_MEASURE_THUMBNAIL_H
#define SPL_MEASURE_THUMBNAIL_H

#include <splatd/image.h>

#include "base/error.h"

/* `color` (RGBA8, over black) at most `side` pixels wide, averaged down by a whole number. The caller owns *out. */
int spl_thumbnail_color(const struct spl_image *color, uint32_t side, struct spl_encoded *out, struct spl_error *err);

/* The same size: the largest difference of a pixel's R, G and B between `image` and `truth` (both over black), averaged
 * over the pixels that become one, through a map from black (0) over violet and orange to white (64 levels and more).
 * SPL_E_USAGE where the sizes differ. */
int spl_thumbnail_error(const struct spl_image *image, const struct spl_image *truth, uint32_t side,
                        struct spl_encoded *out, struct spl_error *err);

#endif
