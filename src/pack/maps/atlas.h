/* Colours of a map while it is made: an atlas of SPL_MAP_APRON in linear light, where each texel has a weight. */
#ifndef SPL_PACK_MAPS_ATLAS_H
#define SPL_PACK_MAPS_ATLAS_H

#include "base/error.h"
#include "dataset/map.h"
#include "geom/polar.h"

struct spl_atlas {
    uint32_t side, width, height;
    float (*texels)[4]; /* red, green, blue, times weight; weight. owned */
};

/* Nothing anywhere. SPL_E_NOMEM. */
int spl_atlas_init(struct spl_atlas *atlas, uint32_t side, struct spl_error *err);
void spl_atlas_finish(struct spl_atlas *atlas);

/* Whether every texel has a weight. */
bool spl_atlas_is_full(const struct spl_atlas *atlas);

/* Where there is no weight, colours from around, smoother the farther they come (push and pull); weights become 1.
 * An atlas that is empty becomes grey. Parallel. */
int spl_atlas_fill(struct spl_atlas *atlas, unsigned threads, struct spl_error *err);

/* Multiplies the colours. */
void spl_atlas_scale(struct spl_atlas *atlas, const float factors[3]);

/* Half the side: `half` becomes means by area, its aprons what lies there on the sphere. The caller's to finish. */
int spl_atlas_halve(const struct spl_atlas *atlas, unsigned threads, struct spl_atlas *half, struct spl_error *err);

/* Blocks of an atlas without holes to spl_map_level_words() of `words`. Returns the squared error summed over
 * channels of all texels. Parallel. */
double spl_atlas_encode(const struct spl_atlas *atlas, unsigned threads, uint32_t *words);

/* Colour, sRGB 0..255, of a direction; of an atlas without holes. */
void spl_atlas_get(const struct spl_atlas *atlas, const double direction[3], float color[3]);

float spl_linear_of_srgb(float srgb);   /* 0..255 to 0..1 */
float spl_srgb_of_linear(float linear); /* and back, clamped */

#endif
