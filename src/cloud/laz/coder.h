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
    uint32_t total, cycle, left;         /* of counts; between updates; until the next one */
    uint16_t symbols, likely;            /* the latter: the symbol that is tried first */
    uint32_t likely_start, likely_width; /* of 2^15; 0: there is none */
    uint8_t shift;
    int16_t *start; /* in the same allocation, as all of them */
    uint16_t *count;
    uint16_t first[];
};

#define SPL_LAZ_ABOVE INT16_MAX

/* Everything that a symbol goes through is inlined into functions that are `HOT`. Those work on a copy of the coder, so
 * that it stays in registers. */
#define SPL_LAZ_INLINE static inline __attribute__((always_inline))
#define SPL_LAZ_HOT __attribute__((flatten))

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

/* Four bytes from p on, zeros behind the end. */
uint32_t spl_laz_coder_tail(const uint8_t *p, const uint8_t *end);

/* Makes length at least 2^24 again. */
SPL_LAZ_INLINE void spl_laz_renew(struct spl_laz_coder *coder)
{
    unsigned shift = (unsigned)__builtin_clz(coder->length) & 24u;
    uint32_t next;
    if (__builtin_expect(coder->end - coder->p >= 4, 1)) {
        memcpy(&next, coder->p, sizeof next);
        next = be32toh(next);
        coder->p += shift >> 3;
    } else {
        unsigned wanted = shift >> 3, left = (unsigned)(coder->end - coder->p), taken = wanted < left ? wanted : left;
        next = spl_laz_coder_tail(coder->p, coder->end);
        coder->p += taken;
        coder->over += wanted - taken;
    }
    coder->value = coder->value << shift | (uint32_t)((uint64_t)next << shift >> 32);
    coder->length <<= shift;
}

/* How many of 16 ascending lanes are not above `at`. */
SPL_LAZ_INLINE unsigned spl_laz_lanes_below(const int16_t *lanes, int at)
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

/* A symbol. The likely one is tried without the division, whose outcome all that follows waits for: a processor that
 * foresees it goes on at once. */
SPL_LAZ_INLINE unsigned spl_laz_symbol(struct spl_laz_coder *coder, struct spl_laz_model *model)
{
    uint32_t unit = coder->length >> SPL_LAZ_MODEL_BITS;
    uint32_t above = coder->value - model->likely_start * unit, width = model->likely_width * unit;
    unsigned symbol = model->likely;
    if (above < width) {
        coder->value = above;
        coder->length = width;
    } else {
        uint32_t place = coder->value / unit; /* a little above 2^15 at most */
        unsigned first = model->first[place >> model->shift];
        unsigned below = spl_laz_lanes_below(model->start + first, (int)place - 32768);
        while (__builtin_expect(below == SPL_LAZ_LANES, 0)) {
            first += SPL_LAZ_LANES;
            below = spl_laz_lanes_below(model->start + first, (int)place - 32768);
        }
        symbol = first + below - 1;
        uint32_t low = (uint32_t)(model->start[symbol] + 32768) * unit;
        /* behind the last symbol lies more than the length: no branch, since nobody can foresee it */
        uint64_t high = (uint64_t)(uint32_t)(model->start[symbol + 1] + 32768) * unit;
        coder->value -= low;
        coder->length = (uint32_t)(high < coder->length ? high : coder->length) - low;
    }
    spl_laz_renew(coder);
    model->count[symbol]++;
    if (__builtin_expect(--model->left == 0, 0))
        spl_laz_model_update(model);
    return symbol;
}

SPL_LAZ_INLINE unsigned spl_laz_bit(struct spl_laz_coder *coder, struct spl_laz_bit_model *model)
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
SPL_LAZ_INLINE uint32_t spl_laz_raw(struct spl_laz_coder *coder, unsigned bits)
{
    coder->length >>= bits;
    uint32_t value = coder->value / coder->length;
    coder->value -= value * coder->length;
    spl_laz_renew(coder);
    return value & ((1u << bits) - 1);
}

/* 1 to 32 bits: of more than 19 the low 16 come first. */
SPL_LAZ_INLINE uint32_t spl_laz_raw_long(struct spl_laz_coder *coder, unsigned bits)
{
    if (bits <= 19)
        return spl_laz_raw(coder, bits);
    uint32_t low = spl_laz_raw(coder, 16);
    return low | spl_laz_raw(coder, bits - 16) << 16;
}

SPL_LAZ_INLINE uint64_t spl_laz_raw64(struct spl_laz_coder *coder)
{
    uint64_t low = spl_laz_raw_long(coder, 32);
    return low | (uint64_t)spl_laz_raw_long(coder, 32) << 32;
}

#endif
