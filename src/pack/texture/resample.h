/* A splat's texture from one photograph, and how much of the photograph it keeps. Pure; any thread. */
#ifndef SPL_PACK_TEXTURE_RESAMPLE_H
#define SPL_PACK_TEXTURE_RESAMPLE_H

#include "pack/texture/gains.h"
#include "sparse/dictionary.h"

/* What happens to the photograph's colours on their way: times factor, plus offset. */
struct spl_tone {
    float factor[3], offset[3];
};

/* The tone that makes the disc's colour in the photograph, after its gain, the splat's `color`. */
struct spl_tone spl_tone_find(const struct spl_gain *gain, const struct spl_candidate *seen, const uint8_t color[3]);

/* Fills out[3 * size * size] (planes as in sparse/dictionary.h; size a power of two, at most SPL_TEXTURE_SIZE_MAX) over
 * the square [-r, r] squared of the splat's tangent frame: bilinear, in the level of the photograph that a texel's
 * footprint asks for, through the lens. Texels that the photograph does not show (hidden, outside, transparent, beyond
 * a silhouette) are filled from those beside them. False where fewer than a quarter are shown: no texture. */
bool spl_texture_resample(const struct spl_photo *photo, const struct spl_tone *tone,
                          const struct spl_world_splat *splat, uint32_t size, uint8_t *out);

struct spl_resample_error {
    double squared; /* sum over channels, of 255 */
    uint64_t values;
    double sides; /* sum over splats: the longer side of the square's box in the photograph, pixels */
    uint64_t splats;
};

/* Adds, for every pixel of the photograph whose centre lies on the splat's disc, how far the bilinear texture is from
 * it: the measure of the resampling itself. */
void spl_texture_compare(const struct spl_photo *photo, const struct spl_tone *tone,
                         const struct spl_world_splat *splat, uint32_t size, const uint8_t *texture,
                         struct spl_resample_error *error);

#endif
