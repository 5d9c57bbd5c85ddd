/* Integers coded as the correction of a prediction: how many bits the correction has (`k`, a symbol of a context's
 * model), then the correction itself, its high 8 bits by a model and the rest raw. One thread. */
#ifndef SPL_CLOUD_LAZ_INTEGER_H
#define SPL_CLOUD_LAZ_INTEGER_H

#include "cloud/laz/coder.h"

enum { SPL_LAZ_CONTEXTS_MAX = 22, SPL_LAZ_HIGH_BITS = 8 };

struct spl_laz_integer {
    unsigned bits, k; /* of the numbers; of the correction that came last */
    struct spl_laz_bit_model zero;
    struct spl_laz_model *sizes[SPL_LAZ_CONTEXTS_MAX], *correctors[33];
};

/* Bytes that the models of one take in an arena. */
size_t spl_laz_integer_bytes(unsigned bits, unsigned contexts);

static inline void spl_laz_integer_init(struct spl_laz_integer *integer, unsigned bits)
{
    memset(integer, 0, sizeof *integer);
    integer->bits = bits;
    spl_laz_bit_model_init(&integer->zero);
}

/* The correction that `sizes` begins: any 32 bits, to be taken modulo 2^bits. */
SPL_LAZ_INLINE uint32_t spl_laz_correction(struct spl_laz_integer *integer, struct spl_laz_coder *coder,
                                           struct spl_laz_arena *arena, struct spl_laz_model *sizes)
{
    unsigned k = integer->k = spl_laz_symbol(coder, sizes);
    if (k == 0)
        return spl_laz_bit(coder, &integer->zero);
    if (k == 32)
        return 0x80000000u;
    unsigned high = k < SPL_LAZ_HIGH_BITS ? k : SPL_LAZ_HIGH_BITS, low = k - high;
    uint32_t c = spl_laz_symbol(coder, spl_laz_model_get(arena, &integer->correctors[k], 1u << high));
    if (low)
        c = c << low | spl_laz_raw_long(coder, low);
    /* the upper half is 2^(k-1) + 1 … 2^k, the lower one −(2^k − 1) … −2^(k-1); no branch, since a sign is a coin */
    return c + 1 - (-(uint32_t) !(c >> (k - 1)) & 1u << k);
}

/* The number whose prediction is `expected`. */
SPL_LAZ_INLINE uint32_t spl_laz_integer_read(struct spl_laz_integer *integer, struct spl_laz_coder *coder,
                                             struct spl_laz_arena *arena, uint32_t expected, unsigned context)
{
    struct spl_laz_model *sizes = spl_laz_model_get(arena, &integer->sizes[context], integer->bits + 1);
    uint32_t value = expected + spl_laz_correction(integer, coder, arena, sizes);
    return integer->bits < 32 ? value & ((1u << integer->bits) - 1) : value;
}

#endif
