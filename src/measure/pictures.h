/* Pictures for people and reports: small ones, and where an image differs from the truth. */
#ifndef SPL_MEASURE_PICTURES_H
#define SPL_MEASURE_PICTURES_H

#include <splatd/image.h>

#include "base/error.h"

/* `color` (RGBA8, over black) at most `side` (> 0) pixels wide, averaged down by a whole number. The caller owns *out;
 * it is zeroed on failure. Any thread. */
int spl_thumbnail(const struct spl_image *color, uint32_t side, struct spl_encoded *out, struct spl_error *err);

enum { SPL_ERROR_MAP_GAIN = 8 };

/* min(255, SPL_ERROR_MAP_GAIN |image - truth|) of every channel after both were laid over the grey of PSNR
 * (api/measures.md), opaque: black is right, 255 stands for 32 levels or more. Both are colour layers of one size,
 * borrowed; SPL_E_INPUT, field "color", otherwise. Fills `out` on success, which spl_image_finish() releases, and
 * leaves it zeroed on failure (SPL_E_NOMEM). Any thread. */
int spl_error_map(const struct spl_image *image, const struct spl_image *truth, struct spl_image *out,
                  struct spl_error *err);

#endif
