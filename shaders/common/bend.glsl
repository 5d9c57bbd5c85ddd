/* How far method nearest bent a depth, in 8 bits beside a colour, as a share of it: a float with four bits of mantissa
 * and exponents -16 to -1; 0 is none. Within 3 % of what it stands for, of shares from 2^-16 on. */
#ifndef SPL_BEND_GLSL
#define SPL_BEND_GLSL

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

#endif
