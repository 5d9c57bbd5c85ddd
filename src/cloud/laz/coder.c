/* What the arithmetic decoder does seldom: making models, adapting them, the last bytes of a stream. The rules of
 * adaption are part of the format: first after (symbols + 6) / 2, then ever more seldom, counts halved above 2^15
 * (2^13 for bits).
 *
 * Invariant: each symbol has a share of at least 1 / 32768, so `length` never becomes 0. One thread. */
#include "cloud/laz/coder.h"

enum { bit_count_max = 1 << SPL_LAZ_BIT_BITS, bit_cycle_max = 64, count_max = 1 << SPL_LAZ_MODEL_BITS };

enum { likely_share = 4 }; /* of all counts: from a quarter on trying it first has been worth it */
enum { few_symbols = 64, few_shift = 9, many_shift = 8, no_shift = 31 };

static unsigned lanes_for(unsigned symbols)
{
    return symbols + SPL_LAZ_LANES; /* so that 16 can be looked at from any one */
}

static unsigned shift_for(unsigned symbols)
{
    return symbols <= SPL_LAZ_LANES ? no_shift : symbols <= few_symbols ? few_shift : many_shift;
}

/* Entries of `first`: one for each place, and one for those a little above 2^15. */
static unsigned firsts_for(unsigned symbols)
{
    unsigned shift = shift_for(symbols);
    return (shift == no_shift ? 0 : 1u << (SPL_LAZ_MODEL_BITS - shift)) + 1;
}

size_t spl_laz_model_bytes(unsigned symbols)
{
    size_t bytes =
        sizeof(struct spl_laz_model) + (firsts_for(symbols) + lanes_for(symbols) + symbols) * sizeof(uint16_t);
    return (bytes + 15) / 16 * 16;
}

struct spl_laz_model *spl_laz_model_create(struct spl_laz_arena *arena, struct spl_laz_model **slot, unsigned symbols)
{
    struct spl_laz_model *m = (struct spl_laz_model *)(void *)(arena->bytes + arena->used);
    spl_assert(arena->capacity - arena->used >= spl_laz_model_bytes(symbols));
    arena->used += spl_laz_model_bytes(symbols);
    *m = (struct spl_laz_model){.symbols = (uint16_t)symbols, .shift = (uint8_t)shift_for(symbols), .cycle = symbols};
    m->start = (int16_t *)m->first + firsts_for(symbols);
    m->count = (uint16_t *)m->start + lanes_for(symbols);
    m->first[0] = 0;
    for (unsigned i = 0; i < SPL_LAZ_LANES; i++)
        m->start[symbols + i] = SPL_LAZ_ABOVE;
    for (unsigned i = 0; i < symbols; i++)
        m->count[i] = 1;
    spl_laz_model_update(m);
    m->left = m->cycle = (symbols + 6) >> 1;
    return *slot = m;
}

/* The symbol of each entry's least place: each symbol marks the first entry from its start on, and holds up to the
 * next mark. */
static void fill_firsts(struct spl_laz_model *m)
{
    unsigned entries = firsts_for(m->symbols);
    uint16_t now = 0;
    memset(m->first, 0, entries * sizeof *m->first);
    for (unsigned i = 0; i < m->symbols; i++)
        m->first[(unsigned)(m->start[i] + 32768 + (1 << m->shift) - 1) >> m->shift] = (uint16_t)i;
    for (unsigned e = 0; e < entries; e++)
        m->first[e] = now = m->first[e] > now ? m->first[e] : now;
}

/* The last symbol is none, since what rounding leaves over is its own too. */
static void find_likely(struct spl_laz_model *m)
{
    unsigned most = 0;
    for (unsigned i = 1; i + 1u < m->symbols; i++)
        most = m->count[i] > m->count[most] ? i : most;
    m->likely = (uint16_t)most;
    m->likely_start = (uint32_t)(m->start[most] + 32768);
    m->likely_width = likely_share * m->count[most] > m->total ? (uint32_t)(m->start[most + 1] - m->start[most]) : 0;
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
    find_likely(m);
    if (m->shift != no_shift)
        fill_firsts(m);
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
    size_t taken = length < 4 ? length : 4;
    coder->value = spl_laz_coder_tail(coder->p, coder->end);
    coder->p += taken;
    coder->over = (uint32_t)(4 - taken);
    coder->value -= coder->value == UINT32_MAX; /* which no writer begins with */
}

uint32_t spl_laz_coder_tail(const uint8_t *p, const uint8_t *end)
{
    uint32_t next = 0;
    for (unsigned i = 0; i < 4; i++)
        next = next << 8 | (p < end ? *p++ : 0u);
    return next;
}
