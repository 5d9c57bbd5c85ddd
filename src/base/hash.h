/* Bits that are mixed: for open hash tables, and for numbers that shall look as if by chance. Neither is safe from who
 * chooses keys to collide: for those there is xxHash, with a seed. Pure. */
#ifndef SPL_BASE_HASH_H
#define SPL_BASE_HASH_H

#include <stddef.h>
#include <stdint.h>

#define SPL_GOLDEN_64 0x9e3779b97f4a7c15u /* 2^64 by the golden ratio */

/* splitmix64's finaliser: a bijection that leaves no pattern. */
static inline uint64_t spl_hash_mix(uint64_t x)
{
    x = (x ^ x >> 30) * 0xbf58476d1ce4e5b9u;
    x = (x ^ x >> 27) * 0x94d049bb133111ebu;
    return x ^ x >> 31;
}

/* Where `key` is looked for first in a table of mask + 1 slots, a power of two of at most 2^32. */
static inline size_t spl_hash_slot(uint64_t key, size_t mask)
{
    return (size_t)(key * SPL_GOLDEN_64 >> 32) & mask;
}

/* A key of two coordinates. */
static inline uint64_t spl_hash_pair(int32_t column, int32_t row)
{
    return (uint64_t)(uint32_t)column << 32 | (uint32_t)row;
}

#endif
