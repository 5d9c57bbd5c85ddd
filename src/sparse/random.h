/* Random numbers by position: the same for a seed whoever asks, in whatever order (splitmix64). */
#ifndef SPL_SPARSE_RANDOM_H
#define SPL_SPARSE_RANDOM_H

#include <stdint.h>

static inline uint64_t spl_random_at(uint64_t seed, uint64_t index)
{
    uint64_t x = seed * 0x9e3779b97f4a7c15u + (index + 1) * 0xbf58476d1ce4e5b9u;
    x = (x ^ (x >> 30)) * 0xbf58476d1ce4e5b9u;
    x = (x ^ (x >> 27)) * 0x94d049bb133111ebu;
    return x ^ (x >> 31);
}

#endif
