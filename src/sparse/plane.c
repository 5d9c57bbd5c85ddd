/* Every index width, weight width and some steps are tried on the candidates' matches: some hundred thousand
 * multiplications a plane, little beside the product that gave the matches. Steps are tried from the one that reaches
 * the largest match down to one that clips it heavily, coarsely first, then around the best. */
#include "sparse/plane.h"

#include <math.h>

enum {
    steps_below = 10, /* codes: 2.5 octaves */
    steps_coarse = 2,
};

int16_t spl_plane_quantise(const struct spl_code_plane *plane, float weight)
{
    float top = (float)((1 << (plane->weight_bits - 1)) - 1), code = floorf(fabsf(weight) / plane->step - plane->gap);
    code = code < 0 ? 0 : code > top ? top : code;
    return (int16_t)(weight < 0 ? -code - 1 : code);
}

/* Of magnitudes, since the grid is symmetric: what splats that take it save, less `price` each. */
static float saved(const float *match, uint32_t count, float step, float gap, uint32_t weight_bits, float price)
{
    float sum = 0, inverse = 1 / step, top = (float)((1 << (weight_bits - 1)) - 1), offset = gap + 0.5f;
    for (uint32_t i = 0; i < count; i++) {
        float m = fabsf(match[i]), code = m * inverse - gap;
        code = (float)(int)(code > 0 ? code : 0);
        float weight = step * ((code > top ? top : code) + offset), gain = spl_plane_gain(m, weight) - price;
        sum += gain > 0 ? gain : 0;
    }
    return sum;
}

/* Squared, by rounding all of them. */
static float missed(const float *weight, uint32_t count, float step, float gap, uint32_t weight_bits)
{
    float sum = 0, inverse = 1 / step, top = (float)((1 << (weight_bits - 1)) - 1), offset = gap + 0.5f;
    for (uint32_t i = 0; i < count; i++) {
        float m = fabsf(weight[i]), code = m * inverse - gap;
        code = (float)(int)(code > 0 ? code : 0);
        float off = m - step * ((code > top ? top : code) + offset);
        sum += off * off;
    }
    return sum;
}

struct choice {
    float value; /* saved, less what the plane itself costs */
    uint32_t index_bits, weight_bits;
    int step_code, gap_code;
};

static void try_step(const struct spl_candidates *c, float lambda, struct choice *best, uint32_t index_bits,
                     uint32_t weight_bits, int step_code, int gap_code)
{
    if (step_code < 0 || step_code >= SPL_CODE_STEPS)
        return;
    float price = lambda * spl_plane_atom_bits(c, index_bits, weight_bits);
    float step = spl_code_step((uint8_t)step_code), gap = spl_code_gap((uint8_t)gap_code);
    float value = saved(c->match[index_bits], c->count, step, gap, weight_bits, price) -
                  lambda * (float)(SPL_TEXTURE_HEADER_BITS + c->mask_bits);
    if (value > best->value)
        *best = (struct choice){value, index_bits, weight_bits, step_code, gap_code};
}

/* The smallest step code whose grid of so many bits reaches `largest`. */
static int reaching_step(float largest, uint32_t weight_bits, int gap_code)
{
    float code = 56 + 4 * log2f(largest / ((float)(1u << (weight_bits - 1)) + spl_code_gap((uint8_t)gap_code)));
    return code < 0 ? 0 : code > SPL_CODE_STEPS - 1 ? SPL_CODE_STEPS - 1 : (int)ceilf(code);
}

bool spl_plane_choose(const struct spl_candidates *c, const struct spl_code_settings *settings,
                      struct spl_code_plane *out)
{
    struct choice best = {.value = 0};
    uint32_t first_index = settings->lambda > 0 ? 0 : c->index_bits;
    uint32_t first_weight = settings->lambda > 0 ? 1 : settings->weight_bits;
    int gaps = settings->lambda > 0 ? SPL_CODE_GAPS : 1;
    for (uint32_t b = first_index; b <= c->index_bits; b++) {
        float largest = 0;
        for (uint32_t i = 0; i < c->count; i++)
            largest = fmaxf(largest, fabsf(c->match[b][i]));
        if (!(largest > 0))
            continue;
        for (uint32_t w = first_weight; w <= settings->weight_bits; w++)
            for (int gap = 0; gap < gaps; gap++) {
                int top = reaching_step(largest, w, gap);
                for (int code = top; code >= top - steps_below; code -= steps_coarse)
                    try_step(c, settings->lambda, &best, b, w, code, gap);
            }
    }
    if (!(best.value > 0))
        return false;
    struct choice coarse = best;
    for (int code = coarse.step_code - steps_coarse + 1; code < coarse.step_code + steps_coarse; code++)
        for (int gap = 0; gap < gaps; gap++)
            try_step(c, settings->lambda, &best, coarse.index_bits, coarse.weight_bits, code, gap);
    *out = (struct spl_code_plane){.step = spl_code_step((uint8_t)best.step_code),
                                   .gap = spl_code_gap((uint8_t)best.gap_code),
                                   .step_code = (uint8_t)best.step_code,
                                   .gap_code = (uint8_t)best.gap_code,
                                   .index_bits = (uint8_t)best.index_bits,
                                   .weight_bits = (uint8_t)best.weight_bits};
    return true;
}

void spl_plane_fit(const float *weight, uint32_t count, const struct spl_code_settings *settings,
                   struct spl_code_plane *out)
{
    struct choice best = {.value = -INFINITY, .weight_bits = 1};
    float largest = 0;
    for (uint32_t i = 0; i < count; i++)
        largest = fmaxf(largest, fabsf(weight[i]));
    for (uint32_t bits = 1; bits <= settings->weight_bits && largest > 0; bits++)
        for (int gap = 0; gap < SPL_CODE_GAPS; gap++) {
            int top = reaching_step(largest, bits, gap);
            for (int code = top; code >= 0 && code >= top - steps_below; code--) {
                float step = spl_code_step((uint8_t)code), price = settings->lambda * (float)(count * bits);
                float value = -missed(weight, count, step, spl_code_gap((uint8_t)gap), bits) - price;
                if (value > best.value)
                    best = (struct choice){value, 0, bits, code, gap};
            }
        }
    out->step_code = (uint8_t)best.step_code;
    out->gap_code = (uint8_t)best.gap_code;
    out->weight_bits = (uint8_t)best.weight_bits;
    out->step = spl_code_step(out->step_code);
    out->gap = spl_code_gap(out->gap_code);
}
