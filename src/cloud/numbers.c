/* Numbers of every width, sign and byte order: one loop each, so that none asks for the type of each number.
 * Stateless. */
#include "cloud/numbers.h"

#include <endian.h>
#include <string.h>

unsigned spl_number_bytes(enum spl_number type)
{
    static const uint8_t bytes[] = {0, 1, 1, 2, 2, 4, 4, 8, 8, 4, 8};
    return bytes[type];
}

#define LOOP(TYPE, BITS, TO_HOST)                                                                                      \
    for (size_t i = 0; i < count; i++, p += stride) {                                                                  \
        uint##BITS##_t bits;                                                                                           \
        TYPE v;                                                                                                        \
        memcpy(&bits, p, sizeof bits);                                                                                 \
        bits = TO_HOST(bits);                                                                                          \
        memcpy(&v, &bits, sizeof v);                                                                                   \
        out[i] = (double)v;                                                                                            \
    }

#define AS_IS(bits) (bits)
#define CASE(NAME, TYPE, BITS)                                                                                         \
    case NAME:                                                                                                         \
        if (big) {                                                                                                     \
            LOOP(TYPE, BITS, be##BITS##toh)                                                                            \
        } else {                                                                                                       \
            LOOP(TYPE, BITS, le##BITS##toh)                                                                            \
        }                                                                                                              \
        break;

void spl_numbers_decode(enum spl_number type, bool big, const uint8_t *p, size_t stride, size_t count, double *out)
{
    switch (type) {
    case SPL_NUMBER_NONE:
        break;
    case SPL_NUMBER_INT8:
        LOOP(int8_t, 8, AS_IS)
        break;
    case SPL_NUMBER_UINT8:
        LOOP(uint8_t, 8, AS_IS)
        break;
        CASE(SPL_NUMBER_INT16, int16_t, 16)
        CASE(SPL_NUMBER_UINT16, uint16_t, 16)
        CASE(SPL_NUMBER_INT32, int32_t, 32)
        CASE(SPL_NUMBER_UINT32, uint32_t, 32)
        CASE(SPL_NUMBER_INT64, int64_t, 64)
        CASE(SPL_NUMBER_UINT64, uint64_t, 64)
        CASE(SPL_NUMBER_FLOAT32, float, 32)
        CASE(SPL_NUMBER_FLOAT64, double, 64)
    }
}
