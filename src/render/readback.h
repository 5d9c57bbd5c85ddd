/* From the words that the resolve pass wrote to the pixels of struct spl_image. Pure; any thread. */
#ifndef SPL_RENDER_READBACK_H
#define SPL_RENDER_READBACK_H

#include "render/renderer.h"

enum spl_pixel_type spl_readback_type(enum spl_layer layer);

/* Position of `layer` among the set `layers`: the output buffer holds them in ascending order. */
static inline uint32_t spl_readback_rank(uint32_t layers, enum spl_layer layer)
{
    return (uint32_t)__builtin_popcount(layers & ((1u << layer) - 1));
}

/* Copies every requested layer of `tile` out of `words` into its place. */
void spl_readback_tile(const struct spl_tile *tile, const uint32_t *words, struct spl_image images[SPL_LAYER_COUNT]);

#endif
