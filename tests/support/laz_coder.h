/* The other half of LAZ's arithmetic coder, as plainly as it can be written: for chunks that tests make. Nothing is
 * shared with the decoder but the rules. Aborts where memory ends. */
#ifndef SPL_TEST_LAZ_CODER_H
#define SPL_TEST_LAZ_CODER_H

#include <stddef.h>
#include <stdint.h>

/* A stream that grows. Begin with zeros and length UINT32_MAX; bytes are released with free(). */
struct laz_out {
    uint8_t *bytes;
    size_t count, capacity;
    uint32_t base, length;
};

enum { LAZ_SYMBOLS_MAX = 516 };

struct laz_model {
    unsigned symbols; /* 0: it begins with its first use */
    uint32_t total, cycle, left, count[LAZ_SYMBOLS_MAX], start[LAZ_SYMBOLS_MAX];
};

struct laz_integer {
    unsigned k;
    struct laz_model sizes[22], correctors[33];
    uint32_t zeros, all, cycle, left, probability; /* of the correction of 0 bits */
};

void laz_byte(struct laz_out *out, uint8_t byte);
void laz_symbol(struct laz_out *out, struct laz_model *model, unsigned symbols, unsigned symbol);
void laz_raw(struct laz_out *out, unsigned bits, uint32_t value);

/* `value` of `bits` bits where `expected` was predicted. */
void laz_integer(struct laz_out *out, struct laz_integer *integer, unsigned bits, unsigned context, uint32_t expected,
                 uint32_t value);

/* Writes what the decoder has to read ahead. */
void laz_end(struct laz_out *out);

#endif
