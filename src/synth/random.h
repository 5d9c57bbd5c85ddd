/* Counter-based random numbers: a value depends on what it is for, never on how many were drawn before, so a scan is
 * the same for any number of threads. The mixer is splitmix64's finaliser. */
#ifndef SPL_SYNTH_RANDOM_H
#define SPL_SYNTH_RANDOM_H

#include <stdint.h>

#include "base/hash.h"

static inline uint64_t hash64(uint64_t x)
{
    return spl_hash_mix(x + SPL_GOLDEN_64);
}

/* 53 bits of `hash` in [0, 1). */
static inline double unit_of(uint64_t hash)
{
    return (double)(hash >> 11) * 0x1p-53;
}

/* A sequence for building scenes: the next number in [low, high). */
static inline double random_between(uint64_t *state, double low, double high)
{
    *state = hash64(*state);
    return low + (high - low) * unit_of(*state);
}

#endif
