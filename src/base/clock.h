/* Monotonic time in nanoseconds; deadlines are absolute values of this clock, SPL_NEVER waits for ever. */
#ifndef SPL_BASE_CLOCK_H
#define SPL_BASE_CLOCK_H

#include <stdint.h>
#include <time.h>

#define SPL_NEVER UINT64_MAX
#define SPL_NS_PER_MS 1000000ull
#define SPL_NS_PER_S 1000000000ull

static inline uint64_t spl_now_ns(void)
{
    struct timespec t;
    clock_gettime(CLOCK_MONOTONIC, &t);
    return (uint64_t)t.tv_sec * SPL_NS_PER_S + (uint64_t)t.tv_nsec;
}

/* What all threads of this process have worked. */
static inline uint64_t spl_processor_ns(void)
{
    struct timespec t;
    clock_gettime(CLOCK_PROCESS_CPUTIME_ID, &t);
    return (uint64_t)t.tv_sec * SPL_NS_PER_S + (uint64_t)t.tv_nsec;
}

/* What is left until `deadline_ns`; 0 once it has passed. */
static inline uint64_t spl_remaining_ns(uint64_t deadline_ns)
{
    uint64_t now = spl_now_ns();
    return deadline_ns == SPL_NEVER ? SPL_NEVER : deadline_ns > now ? deadline_ns - now : 0;
}

#endif
