/* From an atom's texels to the coefficients that a file holds, and back. Atoms have norm 1, so coefficients need no
 * unit. In doubles, and in one order, so that what packing saw is what every reader gets. Pure functions; any thread.
 */
#include "sparse/atom.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "base/memory.h"

static const double root2 = 1.4142135623730951, root3 = 1.7320508075688772, root6 = 2.449489742783178;

void spl_waves_init(struct spl_waves *waves, uint32_t size)
{
    const double pi = 3.14159265358979323846;
    uint32_t at = 0, texels = size * size;
    waves->size = size;
    waves->n = spl_texture_values(size);
    for (uint32_t u = 0; u < size; u++)
        for (uint32_t x = 0; x < size; x++)
            waves->cosine[u * size + x] = waves->transposed[x * size + u] =
                sqrt((u ? 2.0 : 1.0) / size) * cos(pi * u * (2 * x + 1) / (2.0 * size));
    for (uint32_t sum = 0; sum <= 2 * (size - 1); sum++)
        for (uint32_t c = 0; c < 3; c++)
            for (uint32_t v = 0; v <= sum && v < size; v++)
                if (sum - v < size)
                    waves->order[at++] = (uint16_t)(c * texels + v * size + sum - v);
}

/* out = a b, all of size × size. Zeros of a and rows of zeros of b are passed over: a forged file may hold as many
 * atoms of a wave or two as a device can bind. */
static void multiply(uint32_t size, const double *a, const double *b, double *out)
{
    memset(out, 0, (size_t)size * size * sizeof *out);
    for (uint32_t k = 0; k < size; k++, b += size) {
        uint32_t zeros = 0;
        while (zeros < size && !(fabs(b[zeros]) > 0))
            zeros++;
        for (uint32_t i = 0; i < size && zeros < size; i++) {
            double factor = a[i * size + k], *row = out + i * size;
            if (!(fabs(factor) > 0))
                continue;
            for (uint32_t x = 0; x < size; x++)
                row[x] += factor * b[x];
        }
    }
}

/* to = the transform of one channel, or its inverse. */
static void transform(const struct spl_waves *w, const double *from, double *to, bool inverse)
{
    double half[SPL_TEXTURE_SIZE_MAX * SPL_TEXTURE_SIZE_MAX];
    multiply(w->size, from, inverse ? w->cosine : w->transposed, half);
    multiply(w->size, inverse ? w->transposed : w->cosine, half, to);
}

void spl_waves_analyse(const struct spl_waves *w, const float *atom, float step, int16_t *out)
{
    double mixed[SPL_TEXTURE_VALUES_MAX], waves[SPL_TEXTURE_VALUES_MAX];
    uint32_t texels = w->size * w->size;
    for (uint32_t i = 0; i < texels; i++) {
        double r = (double)atom[i], g = (double)atom[texels + i], b = (double)atom[2 * texels + i];
        mixed[i] = (r + g + b) / root3;
        mixed[texels + i] = (r - b) / root2;
        mixed[2 * texels + i] = (r - 2 * g + b) / root6;
    }
    for (uint32_t c = 0; c < 3; c++)
        transform(w, mixed + c * texels, waves + c * texels, false);
    for (uint32_t k = 0; k < w->n; k++) {
        double value = w->order[k] % texels ? rint(waves[w->order[k]] / (double)step) : 0;
        out[k] = (int16_t)fmax(fmin(value, INT16_MAX), -INT16_MAX);
    }
}

bool spl_waves_synthesise(const struct spl_waves *w, const int16_t *coefficient, int8_t *texels, float *scale)
{
    double waves[SPL_TEXTURE_VALUES_MAX], mixed[SPL_TEXTURE_VALUES_MAX], value[SPL_TEXTURE_VALUES_MAX], largest = 0;
    uint32_t count = w->size * w->size;
    int64_t squares = 0;
    for (uint32_t k = 0; k < w->n; k++)
        waves[w->order[k]] = coefficient[k];
    for (uint32_t c = 0; c < 3; c++)
        transform(w, waves + c * count, mixed + c * count, true);
    for (uint32_t i = 0; i < count; i++) {
        double grey = mixed[i] / root3, a = mixed[count + i] / root2, b = mixed[2 * count + i] / root6;
        value[i] = grey + a + b;
        value[count + i] = grey - 2 * b;
        value[2 * count + i] = grey - a + b;
    }
    for (uint32_t i = 0; i < w->n; i++)
        largest = fmax(largest, fabs(value[i]));
    if (!(largest > 1e-6)) /* less than any coefficient makes */
        return false;
    for (uint32_t i = 0; i < w->n; i++) {
        texels[i] = (int8_t)lrint(value[i] * (127 / largest));
        squares += texels[i] * texels[i];
    }
    *scale = (float)(1 / sqrt((double)squares));
    return true;
}

int spl_dictionary_init(struct spl_dictionary *dictionary, uint32_t count, uint32_t size, struct spl_error *err)
{
    size_t values = (size_t)count * spl_texture_values(size);
    *dictionary = (struct spl_dictionary){.count = count, .size = size};
    dictionary->scale = spl_alloc_raw(count, sizeof *dictionary->scale, err);
    dictionary->texels = spl_alloc_raw(values, sizeof *dictionary->texels, err);
    dictionary->coefficients = spl_alloc_raw(values, sizeof *dictionary->coefficients, err);
    if (dictionary->scale && dictionary->texels && dictionary->coefficients)
        return 0;
    spl_dictionary_finish(dictionary);
    return SPL_E_NOMEM;
}
