/* Tile words to image pixels: rows are copied as they are, but for normals, which come as one octahedral word, and
 * depths of parallel rays, which are from where their eye was brought to. */
#include "render/readback.h"

#include <math.h>
#include <string.h>

#include "image/rows.h"

enum spl_pixel_type spl_readback_type(enum spl_layer layer)
{
    switch (layer) {
    case SPL_LAYER_COLOR:
        return SPL_PIXEL_RGBA8;
    case SPL_LAYER_NORMAL:
        return SPL_PIXEL_F32X3;
    case SPL_LAYER_ID:
    case SPL_LAYER_PRIMITIVE:
        return SPL_PIXEL_U32;
    default:
        return SPL_PIXEL_F32;
    }
}

/* The inverse of pack_normal() in shaders/common/octahedral.glsl. */
static void unpack_normal(uint32_t word, float out[3])
{
    if (word == SPL_NOTHING) {
        memset(out, 0, 3 * sizeof *out);
        return;
    }
    float x = (float)(word & 0xffff) / 32767.0f - 1, y = (float)(word >> 16) / 32767.0f - 1;
    float z = 1 - fabsf(x) - fabsf(y);
    if (z < 0) {
        float folded = (1 - fabsf(y)) * (x >= 0 ? 1.0f : -1.0f);
        y = (1 - fabsf(x)) * (y >= 0 ? 1.0f : -1.0f);
        x = folded;
    }
    float scale = 1 / sqrtf(x * x + y * y + z * z);
    out[0] = x * scale;
    out[1] = y * scale;
    out[2] = z * scale;
}

/* NaN, where there is nothing, stays. A disc whose centre lies behind the near plane is drawn whole: what of it lies
 * before the eye counts as at the eye. */
static void add_advance(const struct spl_tile *tile, uint32_t layer, float *depths)
{
    if (tile->advance == 0 || (layer != SPL_LAYER_DEPTH && layer != SPL_LAYER_RANGE))
        return;
    for (uint32_t x = 0; x < tile->width; x++) {
        double depth = (double)depths[x] + tile->advance;
        depths[x] = depth < 0 ? 0 : (float)depth;
    }
}

void spl_readback_tile(const struct spl_tile *tile, const uint32_t *words, struct spl_image images[SPL_LAYER_COUNT])
{
    uint32_t layers = tile->view->layers;
    for (uint32_t layer = 0; layer < SPL_LAYER_COUNT; layer++) {
        if (!(layers >> layer & 1))
            continue;
        struct spl_image *image = &images[layer];
        size_t pixel_bytes = spl_pixel_bytes(image->type);
        const uint32_t *from = words + (size_t)tile->width * tile->height * spl_readback_rank(layers, layer);
        for (uint32_t y = 0; y < tile->height; y++, from += tile->width) {
            void *to = (char *)spl_image_row(image, tile->y + y) + tile->x * pixel_bytes;
            if (layer != SPL_LAYER_NORMAL) {
                memcpy(to, from, tile->width * pixel_bytes);
                add_advance(tile, layer, to);
                continue;
            }
            for (uint32_t x = 0; x < tile->width; x++)
                unpack_normal(from[x], (float *)to + 3 * (size_t)x);
        }
    }
}
