/* A photograph and its halvings, looked up at a place with a footprint. */
#ifndef SPL_IMAGE_PYRAMID_H
#define SPL_IMAGE_PYRAMID_H

#include <stdbool.h>

#include <splatd/image.h>

enum { SPL_PYRAMID_LEVELS_MAX = 16 };

struct spl_pyramid {
    uint32_t levels, width[SPL_PYRAMID_LEVELS_MAX], height[SPL_PYRAMID_LEVELS_MAX];
    uint8_t *texels[SPL_PYRAMID_LEVELS_MAX]; /* RGBA; level 0 is the image, each next one half of it, rounded up */
};

/* Takes over `pixels` (RGBA8), also on failure, and makes all levels down to one texel, of the first
 * SPL_PYRAMID_LEVELS_MAX: averages in sRGB as stored, weighted by alpha. SPL_E_NOMEM; nothing is held then. Any thread.
 */
int spl_pyramid_init(struct spl_pyramid *pyramid, struct spl_image *pixels, struct spl_error *err);
void spl_pyramid_finish(struct spl_pyramid *pyramid);

/* The colour (0..255) at `pixel` (of level 0, the first one's centre at (0.5, 0.5)), averaged over about `footprint`
 * pixels: bilinear in the two levels that it lies between; 2 and more never looks at level 0. False outside and where
 * most of it is transparent. Any thread. */
bool spl_pyramid_sample(const struct spl_pyramid *pyramid, const double pixel[2], double footprint, float rgb[3]);

#endif
