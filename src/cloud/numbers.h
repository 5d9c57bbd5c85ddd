/* Columns of binary numbers, as PLY and PCD have them, into doubles. Pure functions; any thread. */
#ifndef SPL_CLOUD_NUMBERS_H
#define SPL_CLOUD_NUMBERS_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

enum spl_number {
    SPL_NUMBER_NONE,
    SPL_NUMBER_INT8,
    SPL_NUMBER_UINT8,
    SPL_NUMBER_INT16,
    SPL_NUMBER_UINT16,
    SPL_NUMBER_INT32,
    SPL_NUMBER_UINT32,
    SPL_NUMBER_INT64,
    SPL_NUMBER_UINT64,
    SPL_NUMBER_FLOAT32, /* floats are the last */
    SPL_NUMBER_FLOAT64
};

unsigned spl_number_bytes(enum spl_number type);

/* `count` numbers that are `stride` bytes apart, from `p` on; `big`: the most significant byte first. */
void spl_numbers_decode(enum spl_number type, bool big, const uint8_t *p, size_t stride, size_t count, double *out);

#endif
