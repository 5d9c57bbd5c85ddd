/* Fields of up to 32 bits that lie one after the other in streams of 32-bit words, low bits first, as the kernels read
 * them: at most two words a field. */
#ifndef SPL_DATASET_BITS_H
#define SPL_DATASET_BITS_H

#include <stdint.h>

/* `bits` (0..32) bits of `word` from bit `shift` on. */
static inline uint32_t spl_bits_part(uint32_t word, unsigned shift, unsigned bits)
{
    return word >> shift & (uint32_t)((1ull << bits) - 1);
}

/* The `width` bits of a stream from bit `at` on; 0 bits look at no word. */
static inline uint32_t spl_bits_get(const uint32_t *words, uint32_t at, uint32_t width)
{
    uint32_t word = at >> 5, shift = at & 31;
    if (width == 0)
        return 0;
    uint32_t value = words[word] >> shift;
    if (shift + width > 32)
        value |= words[word + 1] << (32 - shift);
    return spl_bits_part(value, 0, width);
}

/* Zeroed but for `words`, whose room is the caller's to know. */
struct spl_bit_writer {
    uint32_t *words;
    uint32_t used; /* whole words */
    unsigned pending_bits;
    uint64_t pending;
};

/* Appends `width` bits; `value` has none above them. */
static inline void spl_bits_put(struct spl_bit_writer *w, uint32_t value, unsigned width)
{
    w->pending |= (uint64_t)value << w->pending_bits;
    w->pending_bits += width;
    if (w->pending_bits >= 32) {
        w->words[w->used++] = (uint32_t)w->pending;
        w->pending >>= 32;
        w->pending_bits -= 32;
    }
}

/* Fills the last word with 0: the next field begins a word. */
static inline void spl_bits_pad(struct spl_bit_writer *w)
{
    if (w->pending_bits)
        spl_bits_put(w, 0, 32 - w->pending_bits);
}

#endif
