/* Where an image differs from the truth: a picture for reports. */
#ifndef SPL_MEASURE_ERROR_MAP_H
#define SPL_MEASURE_ERROR_MAP_H

#include <splatd/image.h>

#include "base/error.h"

enum { SPL_ERROR_MAP_GAIN = 8 };

/* min(255, SPL_ERROR_MAP_GAIN |image - truth|) of every channel after both were laid over the grey of PSNR
 * (api/measures.md), opaque: black is right, 255 stands for 32 levels or more. Both are colour layers of one size,
 * borrowed; SPL_E_INPUT, field "color", otherwise. Fills `out` on success, which spl_image_finish() releases, and
 * leaves it zeroed on failure (SPL_E_NOMEM). Any thread. */
int spl_error_map(const struct spl_image *image, const struct spl_image *truth, struct spl_image *out,
                  struct spl_error *err);

#endif
