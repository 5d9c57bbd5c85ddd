/* The stored form of a chunk's textures: the grid of weight steps, what a chunk costs in bits, and decoding. What the
 * container, the kernels and the pursuit must agree on is here and in code.h, in one text. */
#include "sparse/code.h"

#include <math.h>

float spl_code_step(uint8_t step_code)
{
    return exp2f(((float)step_code - 56.0f) / 4.0f);
}

uint64_t spl_chunk_code_bits(const struct spl_chunk_code *code)
{
    uint64_t bits = 0, before = SPL_CHUNK_SPLATS;
    for (uint32_t t = 0; t < code->planes; t++) {
        uint64_t codes = 0, width = code->plane[t].index_bits + code->plane[t].weight_bits;
        for (uint32_t i = 0; i < code->splats; i++)
            codes += code->splat[i].count > t;
        bits += SPL_TEXTURE_HEADER_BITS + before + codes * width;
        before = codes;
    }
    return bits ? SPL_CODE_CHUNK_BITS + (bits + 31) / 32 * 32 : 0;
}

void spl_code_decode(const struct spl_dictionary *dictionary, const struct spl_code_plane *planes,
                     const struct spl_splat_code *splat, uint32_t atoms, const float colour[3], float *out)
{
    uint32_t plane_values = dictionary->size * dictionary->size, n = 3 * plane_values;
    for (uint32_t i = 0; i < n; i++)
        out[i] = colour[i / plane_values];
    for (uint32_t t = 0; t < splat->count && t < atoms; t++) {
        uint32_t atom = splat->atom[t];
        spl_assert(atom < dictionary->count);
        const int8_t *texels = dictionary->texels + (size_t)atom * n;
        float weight = spl_code_weight(&planes[t], splat->weight[t]) * dictionary->scale[atom];
        for (uint32_t i = 0; i < n; i++)
            out[i] += weight * (float)texels[i];
    }
}
