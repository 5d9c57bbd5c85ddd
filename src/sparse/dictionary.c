/* Ownership of a dictionary's arrays, and the one way from a texture's bytes to the vector that atoms add up to. Means
 * are formed of integers, so they are the same in whatever order. */
#include "sparse/dictionary.h"

#include <stdlib.h>

#include "sparse/matrix.h"

void spl_dictionary_finish(struct spl_dictionary *dictionary)
{
    free(dictionary->scale);
    free(dictionary->texels);
    free(dictionary->coefficients);
    *dictionary = (struct spl_dictionary){0};
}

double spl_texture_centre(const uint8_t *texture, uint32_t size, float *out, float mean[3])
{
    uint32_t texels = size * size;
    double norm = 0;
    for (int c = 0; c < 3; c++, texture += texels, out += texels) {
        uint64_t sum = 0, squares = 0;
        for (uint32_t i = 0; i < texels; i++) {
            sum += texture[i];
            squares += (uint64_t)texture[i] * texture[i];
        }
        mean[c] = (float)sum / (255.0f * (float)texels);
        for (uint32_t i = 0; i < texels; i++)
            out[i] = (float)texture[i] / 255.0f - mean[c];
        norm += ((double)squares - (double)sum * (double)sum / texels) / (255.0 * 255.0);
    }
    return norm;
}
