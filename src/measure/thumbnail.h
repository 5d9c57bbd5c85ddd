/* Small JPEGs for people. */
#ifndef SPL_MEASURE_THUMBNAIL_H
#define SPL_MEASURE_THUMBNAIL_H

#include <splatd/image.h>

#include "base/error.h"

/* `color` (RGBA8, over black) at most `side` (> 0) pixels wide, averaged down by a whole number. The caller owns *out;
 * it is zeroed on failure. Any thread. */
int spl_thumbnail(const struct spl_image *color, uint32_t side, struct spl_encoded *out, struct spl_error *err);

#endif
