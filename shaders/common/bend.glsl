/* How far method nearest bent a depth, in 8 bits beside a colour, as a share of it: a float with four bits of mantissa
 * and exponents -16 to -1; 0 is none. Within 3 % of what it stands for, of shares from 2^-16 on. */
#ifndef SPL_BEND_GLSL
#define SPL_BEND_GLSL

#include "common/frame.glsl"

#define BEND_ZERO ((127 - 16) << 4) /* the upper bits of the float that code 0 would be */
#define BEND_SHIFT 19               /* 23 - 4 */

uint bend_code(float z, float bent)
{
    precise float share = (bent - z) / bent;
    return uint(clamp(((int(floatBitsToUint(share)) + (1 << (BEND_SHIFT - 1))) >> BEND_SHIFT) - BEND_ZERO, 0, 255));
}

float unbent(float bent, uint code)
{
    float share = code == 0u ? 0.0 : uintBitsToFloat((code + uint(BEND_ZERO)) << BEND_SHIFT);
    precise float z = bent - bent * share;
    return z;
}

/* Beside a colour that no map is added to: how far off its disc's centre a sample lies, squared, in 6 bits, and in 2
 * how large its disc is on the image, the short way: 0 below SPL_SMOOTH_RADIUS samples, 1 from it and 2 from twice as
 * much on. */
uint disc_word(float radius)
{
    float size = radius * (1.0 / SPL_SMOOTH_RADIUS);
    return size < 1.0 ? 0u : size < 2.0 ? 1u << 30 : 2u << 30;
}

uint disc_size(uint word)
{
    return word >> 30;
}

uint disc_off_bits(float distance)
{
    return uint(distance * 63.0) << 24;
}

float disc_off(uint word)
{
    return float(word >> 24 & 63u) * (1.0 / 63.0);
}

#endif
