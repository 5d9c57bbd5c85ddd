/* The bits of floats, which order as they do where none is negative. */
#ifndef SPL_BASE_FLOAT_H
#define SPL_BASE_FLOAT_H

#include <stdint.h>
#include <string.h>

static inline uint32_t spl_float_to_bits(float value)
{
    uint32_t bits;
    memcpy(&bits, &value, sizeof bits);
    return bits;
}

static inline float spl_float_of_bits(uint32_t bits)
{
    float value;
    memcpy(&value, &bits, sizeof value);
    return value;
}

#endif
