/* The arithmetic decoder of LAZ and its adaptive models (A. Said, HPL-2004-76, with the constants that LAZ fixes): the
 * inner loop of everything else here, so it is inline and has no branch but the rare ones.
 *
 * A stream that ends early reads as zeros and counts them in `over`: a caller asks spl_laz_coder_is_over() when it has
 * decoded a lot, not at each symbol. No stream, however spoiled, gives a symbol outside its model. One thread. */
#ifndef SPL_CLOUD_LAZ_CODER_H
#define SPL_CLOUD_LAZ_CODER_H

#include <endian.h>
#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>
#include <string.h>
#ifdef __SSE2__
#include <emmintrin.h>
#endif

#include "base/error.h"

enum { SPL_LAZ_LANES = 16, SPL_LAZ_MODEL_BITS = 15, SPL_LAZ_BIT_BITS = 13 };

struct spl_laz_coder {
    const uint8_t *p, *end; // borrowed
    uint32_t value, length; /* value < length, whatever the bytes are */
    uint32_t over;          /* bytes that were wanted behind the end */
};

/* Probabilities of `symbols` symbols. Cumulative ones are kept less 32768, so that signed lanes compare; behind the
 * last lies SPL_LAZ_ABOVE for 16 lanes. A symbol is found among the 16 from first[place >> shift] on, or behind them.
 */
struct spl_laz_model {
    uint32_t total, cycle, left; /* of counts; between updates; until the next one */
    uint16_t symbols;
    uint8_t shift;
    int16_t *start; /* in the same allocation, as all of them */
    uint16_t *count;
    uint16_t first[];
};

#define SPL_LAZ_ABOVE INT16_MAX

/* Where models come from: nothing is released but all at once. Room for all that a format can want is there from the
 * beginning, and costs nothing until it is touched. */
struct spl_laz_arena {
    uint8_t *bytes; // borrowed
    size_t used, capacity;
};

struct spl_laz_bit_model {
    uint32_t zeros, total, probability, cycle, left;
};

/* Bytes that a model of `symbols` takes in an arena. */
size_t spl_laz_model_bytes(unsigned symbols);

/* A fresh model in *slot. */
struct spl_laz_model *spl_laz_model_create(struct spl_laz_arena *arena, struct spl_laz_model **slot, unsigned symbols);

/* The model in *slot, made where there is none yet. */
static inline struct spl_laz_model *spl_laz_model_get(struct spl_laz_arena *arena, struct spl_laz_model **slot,
                                                      unsigned symbols)
{
    return __builtin_expect(*slot != NULL, 1) ? *slot : spl_laz_model_create(arena, slot, symbols);
}

void spl_laz_model_update(struct spl_laz_model *model);
void spl_laz_bit_model_init(struct spl_laz_bit_model *model);
void spl_laz_bit_model_update(struct spl_laz_bit_model *model);

/* Takes the stream's first four bytes. */
void spl_laz_coder_begin(struct spl_laz_coder *coder, const uint8_t *bytes, size_t length);

static inline bool spl_laz_coder_is_over(const struct spl_laz_coder *coder)
{
    return coder->over > 0;
}

/* The bytes that a value wants and the stream lacks. Returns four bytes from p on, zeros behind the end. */
uint32_t spl_laz_coder_tail(struct spl_laz_coder *coder, unsigned bytes);

/* Makes length at least 2^24 again. */
static inline void spl_laz_renew(struct spl_laz_coder *coder)
{
    unsigned shift = (unsigned)__builtin_clz(coder->length) & 24u;
    uint32_t next;
    if (__builtin_expect(coder->end - coder->p >= 4, 1)) {
        memcpy(&next, coder->p, sizeof next);
        next = be32toh(next);
        coder->p += shift >> 3;
    } else {
        next = spl_laz_coder_tail(coder, shift >> 3);
    }
    coder->value = coder->value << shift | (uint32_t)((uint64_t)next << shift >> 32);
    coder->length <<= shift;
}

/* How many of 16 ascending lanes are not above `at`. */
static inline unsigned spl_laz_lanes_below(const int16_t *lanes, int at)
{
#ifdef __SSE2__
    __m128i than = _mm_set1_epi16((short)at);
    __m128i low = _mm_cmpgt_epi16(_mm_loadu_si128((const __m128i *)lanes), than);
    __m128i high = _mm_cmpgt_epi16(_mm_loadu_si128((const __m128i *)(lanes + 8)), than);
    return (unsigned)__builtin_ctz((unsigned)_mm_movemask_epi8(_mm_packs_epi16(low, high)) | 1u << SPL_LAZ_LANES);
#else
    unsigned below = 0;
    for (unsigned i = 0; i < SPL_LAZ_LANES; i++)
        below += lanes[i] <= at;
    return below;
#endif
}

/* A symbol; `small`, which is constant where it is known: the model has at most 16. */
static inline __attribute__((always_inline)) unsigned spl_laz_find(struct spl_laz_coder *coder,
                                                                   struct spl_laz_model *model, bool small)
{
    uint32_t unit = coder->length >> SPL_LAZ_MODEL_BITS, place = coder->value / unit; /* a little above 2^15 at most */
    unsigned first = small ? 0 : model->first[place >> model->shift];
    unsigned below = spl_laz_lanes_below(model->start + first, (int)place - 32768);
    while (__builtin_expect(below == SPL_LAZ_LANES && !small, 0)) {
        first += SPL_LAZ_LANES;
        below = spl_laz_lanes_below(model->start + first, (int)place - 32768);
    }
    unsigned symbol = first + below - 1;
    uint32_t low = (uint32_t)(model->start[symbol] + 32768) * unit;
    uint32_t high = (uint32_t)(model->start[symbol + 1] + 32768) * unit;
    high = symbol + 1u < model->symbols ? high : coder->length;
    coder->value -= low;
    coder->length = high - low;
    spl_laz_renew(coder);
    model->count[symbol]++;
    if (__builtin_expect(--model->left == 0, 0))
        spl_laz_model_update(model);
    return symbol;
}

static inline unsigned spl_laz_symbol(struct spl_laz_coder *coder, struct spl_laz_model *model)
{
    return spl_laz_find(coder, model, false);
}

static inline unsigned spl_laz_bit(struct spl_laz_coder *coder, struct spl_laz_bit_model *model)
{
    uint32_t low = model->probability * (coder->length >> SPL_LAZ_BIT_BITS);
    unsigned bit = coder->value >= low;
    coder->value -= bit ? low : 0;
    coder->length = bit ? coder->length - low : low;
    model->zeros += !bit;
    spl_laz_renew(coder);
    if (__builtin_expect(--model->left == 0, 0))
        spl_laz_bit_model_update(model);
    return bit;
}

/* 1 to 19 bits without a model. */
static inline uint32_t spl_laz_raw(struct spl_laz_coder *coder, unsigned bits)
{
    coder->length >>= bits;
    uint32_t value = coder->value / coder->length;
    coder->value -= value * coder->length;
    spl_laz_renew(coder);
    return value & ((1u << bits) - 1);
}

/* 1 to 32 bits: of more than 19 the low 16 come first. */
static inline uint32_t spl_laz_raw_long(struct spl_laz_coder *coder, unsigned bits)
{
    if (bits <= 19)
        return spl_laz_raw(coder, bits);
    uint32_t low = spl_laz_raw(coder, 16);
    return low | spl_laz_raw(coder, bits - 16) << 16;
}

static inline uint64_t spl_laz_raw64(struct spl_laz_coder *coder)
{
    uint64_t low = spl_laz_raw_long(coder, 32);
    return low | (uint64_t)spl_laz_raw_long(coder, 32) << 32;
}

#endif
