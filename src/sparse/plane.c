/* Every index width, weight width and some steps are tried on the candidates' matches: some hundred thousand
 * multiplications a plane, little beside the product that gave the matches. Steps are tried from the one that reaches
 * the largest match down to one that clips it heavily, coarsely first, then around the best. */
#include "sparse/plane.h"

#include <math.h>

enum {
    steps_below = 40, /* codes: 2.5 octaves */
    steps_coarse = 4,
};

int16_t spl_plane_quantise(const struct spl_code_plane *plane, float weight)
{
    float low = -(float)(1 << (plane->weight_bits - 1)), code = floorf(weight / plane->step);
    return (int16_t)(code < low ? low : code > -low - 1 ? -low - 1 : code);
}

/* Of magnitudes, since the grid is symmetric: what splats that take it save, less `price` each. */
static float saved(const float *match, uint32_t count, float step, uint32_t weight_bits, float price)
{
    float sum = 0, inverse = 1 / step, top = (float)((1 << (weight_bits - 1)) - 1);
    for (uint32_t i = 0; i < count; i++) {
        float m = fabsf(match[i]), code = (float)(int)(m * inverse);
        float weight = step * ((code > top ? top : code) + 0.5f), gain = spl_plane_gain(m, weight) - price;
        sum += gain > 0 ? gain : 0;
    }
    return sum;
}

struct choice {
    float value; /* saved, less what the plane itself costs */
    uint32_t index_bits, weight_bits;
    int step_code;
};

static void try_step(const struct spl_candidates *c, float lambda, struct choice *best, uint32_t index_bits,
                     uint32_t weight_bits, int step_code)
{
    if (step_code < 0 || step_code > 255)
        return;
    float price = lambda * (float)(index_bits + weight_bits);
    float value = saved(c->match[index_bits], c->count, spl_code_step((uint8_t)step_code), weight_bits, price) -
                  lambda * SPL_PLANE_BITS;
    if (value > best->value)
        *best = (struct choice){value, index_bits, weight_bits, step_code};
}

/* The smallest step code whose grid of so many bits reaches `largest`. */
static int reaching_step(float largest, uint32_t weight_bits)
{
    float code = 224 + 16 * log2f(largest / (float)(1u << (weight_bits - 1)));
    return code < 0 ? 0 : code > 255 ? 255 : (int)ceilf(code);
}

bool spl_plane_choose(const struct spl_candidates *c, const struct spl_code_settings *settings,
                      struct spl_code_plane *out)
{
    struct choice best = {.value = 0};
    uint32_t first_index = settings->lambda > 0 ? 0 : c->index_bits;
    uint32_t first_weight = settings->lambda > 0 ? 1 : settings->weight_bits;
    for (uint32_t b = first_index; b <= c->index_bits; b++) {
        float largest = 0;
        for (uint32_t i = 0; i < c->count; i++)
            largest = fmaxf(largest, fabsf(c->match[b][i]));
        if (!(largest > 0))
            continue;
        for (uint32_t w = first_weight; w <= settings->weight_bits; w++) {
            int top = reaching_step(largest, w);
            for (int code = top; code >= top - steps_below; code -= steps_coarse)
                try_step(c, settings->lambda, &best, b, w, code);
        }
    }
    if (!(best.value > 0))
        return false;
    struct choice coarse = best;
    for (int code = coarse.step_code - steps_coarse + 1; code < coarse.step_code + steps_coarse; code++)
        try_step(c, settings->lambda, &best, coarse.index_bits, coarse.weight_bits, code);
    *out = (struct spl_code_plane){.step = spl_code_step((uint8_t)best.step_code),
                                   .step_code = (uint8_t)best.step_code,
                                   .index_bits = (uint8_t)best.index_bits,
                                   .weight_bits = (uint8_t)best.weight_bits};
    return true;
}
