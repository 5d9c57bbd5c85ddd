/* Images rendered at another size than the wanted one, brought to it. */
#ifndef SPL_IMAGE_RESAMPLE_H
#define SPL_IMAGE_RESAMPLE_H

#include <splatd/image.h>

/* Fills the rows [begin, end) of `to` (same layer and type; size set, pixels allocated by the caller) from `from`, of
 * which scale × scale pixels are one of `to`, but for its outermost `rim` on each side, which lie beyond the borders:
 * with one pixel of these the result is that of any larger image. scale in (0, 1): bilinear between pixel centres. 1.25
 * or 1.5: the mean over the pixel's square, which reaches into two pixels of `from` along each axis. What is empty has
 * no weight and an edge gives no value in between:
 *     color     by alpha, so that the transparent side of an edge lends no colour
 *     depth, range   over those of the four pixels that lie within 1 % / scale of the nearest pixel's: an edge, not a
 *               slant; of a square within 1 % of the least of them
 *     normal    over those that hold one, made unit again
 *     coverage  over all four
 *     id        the nearest pixel's; of a square that of which it has most, if it is any
 * Pure; uses all cores. */
void spl_image_resample(const struct spl_image *from, double scale, uint32_t rim, struct spl_image *to, uint32_t begin,
                        uint32_t end);

/* One pixel of its kind from around (x, y) of `small`, whose first pixel's centre is at (0.5, 0.5), by the same
 * rules; `to` takes spl_pixel_bytes(). `tolerance` of the nearest pixel's depth is an edge. Inside of the image, or as
 * at its rim. */
void spl_image_sample(const struct spl_image *small, double x, double y, float tolerance, void *to);

#endif
