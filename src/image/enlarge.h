/* Images rendered at a share of the wanted size, brought up to it. */
#ifndef SPL_IMAGE_ENLARGE_H
#define SPL_IMAGE_ENLARGE_H

#include <splatd/image.h>

/* Fills the rows [begin, end) of `large` (same layer and type; size set, pixels allocated by the caller) from `small`,
 * of which each pixel stands for 1/scale × 1/scale of `large`'s; scale in (0, 1). Bilinear between pixel centres; what
 * is empty has no weight and an edge gives no value in between:
 *     color     by alpha, so that the transparent side of an edge lends no colour
 *     depth, range   over those of the four neighbours that lie within 1 % / scale of the nearest pixel's: an edge,
 *               not a slant
 *     normal    over the neighbours that hold one, made unit again
 *     coverage  over all four
 *     id        the nearest pixel's
 * Pure; uses all cores. */
void spl_image_enlarge(const struct spl_image *small, double scale, struct spl_image *large, uint32_t begin,
                       uint32_t end);

/* One pixel of `large`'s kind from around (x, y) of `small`, whose first pixel's centre is at (0.5, 0.5), by the same
 * rules; `to` takes spl_pixel_bytes(). `tolerance` of the nearest pixel's depth is an edge. Inside of the image, or as
 * at its rim. */
void spl_image_sample(const struct spl_image *small, double x, double y, float tolerance, void *to);

#endif
