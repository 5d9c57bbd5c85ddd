/* Textures made of a known dictionary. */
#ifndef SPL_TESTS_SPARSE_PLANT_H
#define SPL_TESTS_SPARSE_PLANT_H

#include <math.h>
#include <stdint.h>
#include <stdlib.h>
#include <string.h>

#include "sparse/random.h"
#include "sparse/train.h"

struct plant {
    struct spl_texture_source source;
    uint8_t *textures;
    float *atoms; /* [count × n], norm 1, mean 0 in each plane */
    uint32_t count, n;
};

static inline float plant_uniform(uint64_t seed, uint64_t index)
{
    return (float)(spl_random_at(seed, index) >> 40) / (float)(1 << 24) * 2 - 1;
}

static inline int plant_read(void *context, uint64_t first, uint32_t count, uint8_t *out, struct spl_error *err)
{
    const struct plant *p = context;
    (void)err;
    memcpy(out, p->textures + first * p->n, (size_t)count * p->n);
    return 0;
}

/* `atoms` atoms of random values; `textures` textures around a grey of 0.5, each the sum of `mixed` of them with
 * weights of magnitude 0.5 to 1 times `strength`. */
static inline struct plant plant_make(uint32_t size, uint32_t atoms, uint32_t textures, uint32_t mixed, float strength)
{
    struct plant p = {.count = atoms, .n = spl_texture_values(size)};
    uint32_t texels = size * size;
    p.atoms = calloc((size_t)atoms * p.n + 1, sizeof *p.atoms);
    p.textures = calloc((size_t)textures * p.n + 1, 1);
    for (uint32_t a = 0; a < atoms; a++) {
        float *d = p.atoms + (size_t)a * p.n, norm = 0;
        for (int c = 0; c < 3; c++) {
            float mean = 0;
            for (uint32_t i = 0; i < texels; i++)
                mean += (d[c * texels + i] = plant_uniform(a, c * texels + i)) / (float)texels;
            for (uint32_t i = 0; i < texels; i++)
                d[c * texels + i] -= mean;
        }
        for (uint32_t i = 0; i < p.n; i++)
            norm += d[i] * d[i];
        for (uint32_t i = 0; i < p.n; i++)
            d[i] /= sqrtf(norm);
    }
    for (uint32_t t = 0; t < textures; t++)
        for (uint32_t i = 0; i < p.n; i++) {
            float value = 0.5f;
            for (uint32_t k = 0; k < mixed; k++) {
                float w = plant_uniform(1000 + k, 2 * t), a = w < 0 ? w / 2 - 0.5f : w / 2 + 0.5f;
                uint32_t atom = (uint32_t)(spl_random_at(2000 + k, t) % atoms);
                value += strength * a * p.atoms[(size_t)atom * p.n + i];
            }
            p.textures[(size_t)t * p.n + i] = (uint8_t)fminf(fmaxf(value * 255 + 0.5f, 0), 255);
        }
    p.source = (struct spl_texture_source){.count = textures, .size = size, .read = plant_read};
    return p;
}

/* To be called where the plant stays. */
static inline const struct spl_texture_source *plant_source(struct plant *p)
{
    p->source.context = p;
    return &p->source;
}

static inline void plant_finish(struct plant *p)
{
    free(p->atoms);
    free(p->textures);
}

/* The planted atoms as a dictionary, rounded to bytes. */
static inline struct spl_dictionary plant_dictionary(const struct plant *p)
{
    struct spl_dictionary d = {.count = p->count, .size = p->source.size};
    d.scale = calloc(p->count + 1, sizeof *d.scale);
    d.texels = calloc((size_t)p->count * p->n + 1, 1);
    for (uint32_t a = 0; a < p->count; a++) {
        float largest = 0, squares = 0;
        for (uint32_t i = 0; i < p->n; i++)
            largest = fmaxf(largest, fabsf(p->atoms[(size_t)a * p->n + i]));
        for (uint32_t i = 0; i < p->n; i++) {
            int8_t v = (int8_t)lrintf(p->atoms[(size_t)a * p->n + i] * 127 / largest);
            d.texels[(size_t)a * p->n + i] = v;
            squares += (float)(v * v);
        }
        d.scale[a] = 1 / sqrtf(squares);
    }
    return d;
}

#endif
