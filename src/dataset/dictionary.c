/* Expanding a dictionary for the kernels; see dictionary.h. Averages are taken from the finest level, so that they
 * round once. Pure functions; any thread. */
#include "dataset/dictionary.h"

#include <string.h>

uint32_t spl_dictionary_atom_words(uint32_t size)
{
    uint32_t words = 1;
    for (uint32_t side = size; side >= SPL_TEXTURE_SIDE_MIN; side /= 2)
        words += side * side;
    return words;
}

uint64_t spl_dictionary_expanded_bytes(uint32_t count, uint32_t size)
{
    return (uint64_t)count * spl_dictionary_atom_words(size) * sizeof(uint32_t);
}

/* Mean over a block of `cell` × `cell` texels of one channel, + 128; halves go up. */
static uint32_t average(const int8_t *texels, uint32_t size, uint32_t cell)
{
    int sum = 0, area = (int)(cell * cell);
    for (uint32_t y = 0; y < cell; y++)
        for (uint32_t x = 0; x < cell; x++)
            sum += texels[y * size + x];
    return (uint32_t)((2 * (sum + 128 * area) + area) / (2 * area));
}

void spl_dictionary_expand(const struct spl_dictionary *dictionary, uint32_t *words)
{
    uint32_t size = dictionary->size, plane = size * size;
    for (uint32_t a = 0; a < dictionary->count; a++) {
        const int8_t *texels = dictionary->texels + (size_t)a * 3 * plane;
        memcpy(words++, &dictionary->scale[a], sizeof *words);
        for (uint32_t side = size; side >= SPL_TEXTURE_SIDE_MIN; side /= 2) {
            uint32_t cell = size / side;
            for (uint32_t at = 0; at < side * side; at++) {
                const int8_t *from = texels + at / side * cell * size + at % side * cell;
                *words++ = average(from, size, cell) << 16 | average(from + plane, size, cell) << 8 |
                           average(from + 2 * plane, size, cell);
            }
        }
    }
}
