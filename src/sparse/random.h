/* Random numbers by position: the same for a seed whoever asks, in whatever order (splitmix64). */
#ifndef SPL_SPARSE_RANDOM_H
#define SPL_SPARSE_RANDOM_H

#include <stdint.h>

#include "base/hash.h"

static inline uint64_t spl_random_at(uint64_t seed, uint64_t index)
{
    return spl_hash_mix(seed * SPL_GOLDEN_64 + (index + 1) * 0xbf58476d1ce4e5b9u);
}

#endif
