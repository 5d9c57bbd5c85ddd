/* What the arithmetic decoder does seldom: making models, adapting them, the last bytes of a stream. The rules of
 * adaption are part of the format: first after (symbols + 6) / 2, then ever more seldom, counts halved above 2^15
 * (2^13 for bits).
 *
 * Invariant: each symbol has a share of at least 1 / 32768, so `length` never becomes 0. One thread. */
#include "cloud/laz/coder.h"

enum { bit_count_max = 1 << SPL_LAZ_BIT_BITS, bit_cycle_max = 64, count_max = 1 << SPL_LAZ_MODEL_BITS };

static unsigned lanes_for(unsigned symbols)
{
    return (symbols + SPL_LAZ_LANES) / SPL_LAZ_LANES * SPL_LAZ_LANES; /* one more than symbols, at least */
}

static unsigned groups_for(unsigned symbols)
{
    return symbols < SPL_LAZ_LANES ? 0 : lanes_for((symbols - 1) / SPL_LAZ_LANES);
}

size_t spl_laz_model_bytes(unsigned symbols)
{
    size_t bytes =
        sizeof(struct spl_laz_model) + (groups_for(symbols) + 2 * (size_t)lanes_for(symbols)) * sizeof(int16_t);
    return (bytes + 15) / 16 * 16;
}

struct spl_laz_model *spl_laz_model_create(struct spl_laz_arena *arena, struct spl_laz_model **slot, unsigned symbols)
{
    struct spl_laz_model *m = (struct spl_laz_model *)(void *)(arena->bytes + arena->used);
    unsigned lanes = lanes_for(symbols), groups = groups_for(symbols);
    spl_assert(arena->capacity - arena->used >= spl_laz_model_bytes(symbols));
    arena->used += spl_laz_model_bytes(symbols);
    *m = (struct spl_laz_model){.symbols = (uint16_t)symbols, .groups = (uint16_t)groups, .cycle = symbols};
    m->start = m->group + groups;
    m->count = (uint16_t *)m->start + lanes;
    for (unsigned i = 0; i < groups + lanes; i++)
        m->group[i] = SPL_LAZ_ABOVE;
    for (unsigned i = 0; i < symbols; i++)
        m->count[i] = 1;
    spl_laz_model_update(m);
    m->left = m->cycle = (symbols + 6) >> 1;
    return *slot = m;
}

void spl_laz_model_update(struct spl_laz_model *m)
{
    if ((m->total += m->cycle) > count_max) {
        m->total = 0;
        for (unsigned i = 0; i < m->symbols; i++)
            m->total += m->count[i] = (uint16_t)((m->count[i] + 1) >> 1);
    }
    uint32_t scale = 0x80000000u / m->total, sum = 0;
    for (unsigned i = 0; i < m->symbols; i++) {
        m->start[i] = (int16_t)((int)((scale * sum) >> (31 - SPL_LAZ_MODEL_BITS)) - 32768);
        sum += m->count[i];
    }
    for (unsigned g = 0; m->groups && g * SPL_LAZ_LANES < m->symbols; g++)
        m->group[g] = m->start[g * SPL_LAZ_LANES];
    uint32_t longest = (m->symbols + 6u) << 3, cycle = 5 * m->cycle >> 2;
    m->left = m->cycle = cycle < longest ? cycle : longest;
}

void spl_laz_bit_model_init(struct spl_laz_bit_model *m)
{
    *m = (struct spl_laz_bit_model){
        .zeros = 1, .total = 2, .probability = 1u << (SPL_LAZ_BIT_BITS - 1), .cycle = 4, .left = 4};
}

void spl_laz_bit_model_update(struct spl_laz_bit_model *m)
{
    if ((m->total += m->cycle) > bit_count_max) {
        m->total = (m->total + 1) >> 1;
        m->zeros = (m->zeros + 1) >> 1;
        m->total += m->zeros == m->total;
    }
    m->probability = m->zeros * (0x80000000u / m->total) >> (31 - SPL_LAZ_BIT_BITS);
    uint32_t cycle = 5 * m->cycle >> 2;
    m->left = m->cycle = cycle < bit_cycle_max ? cycle : bit_cycle_max;
}

void spl_laz_coder_begin(struct spl_laz_coder *coder, const uint8_t *bytes, size_t length)
{
    *coder = (struct spl_laz_coder){.p = bytes, .end = bytes + length, .length = UINT32_MAX};
    coder->value = spl_laz_coder_tail(coder, 4);
}

uint32_t spl_laz_coder_tail(struct spl_laz_coder *coder, unsigned bytes)
{
    size_t left = (size_t)(coder->end - coder->p), taken = bytes < left ? bytes : left;
    uint32_t next = 0;
    for (size_t i = 0; i < 4; i++)
        next = next << 8 | (i < left ? coder->p[i] : 0u);
    coder->p += taken;
    coder->over += (uint32_t)(bytes - taken);
    return next;
}
