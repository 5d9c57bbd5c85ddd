/* A clock of the test's own, in place of the C library's in all of its process: it can be stopped, so that what is told
 * by how long something takes does not depend on who is slow, and moved on. It never goes back. Included by one file of
 * a program.
 *
 * The kernel knows nothing of it: a wait with a deadline that has been moved on lasts longer than it says, and one
 * whose deadline comes of a clock that stands ends early. */
#ifndef TEST_SUPPORT_OWN_CLOCK_H
#define TEST_SUPPORT_OWN_CLOCK_H

#include <stdatomic.h>
#include <stdint.h>
#include <sys/syscall.h>
#include <time.h>
#include <unistd.h>

#include "base/clock.h"

static _Atomic uint64_t own_clock_ahead_ns, own_clock_stands_ns; // of the kernel's; 0 = it goes

static inline uint64_t own_clock_get_real_ns(clockid_t clock)
{
    struct timespec t;
    syscall(SYS_clock_gettime, clock, &t);
    return (uint64_t)t.tv_sec * SPL_NS_PER_S + (uint64_t)t.tv_nsec;
}

__attribute__((visibility("default"))) int clock_gettime(clockid_t clock, struct timespec *out)
{
    const uint64_t stands_ns = clock == CLOCK_MONOTONIC ? atomic_load(&own_clock_stands_ns) : 0;
    const uint64_t now_ns = stands_ns ? stands_ns : own_clock_get_real_ns(clock) + atomic_load(&own_clock_ahead_ns);
    *out = (struct timespec){.tv_sec = (time_t)(now_ns / SPL_NS_PER_S), .tv_nsec = (long)(now_ns % SPL_NS_PER_S)};
    return 0;
}

static inline void stop_clock(void)
{
    atomic_store(&own_clock_stands_ns, spl_now_ns());
}

static inline void let_clock_go(void)
{
    const uint64_t stood_ns = atomic_load(&own_clock_stands_ns), real_ns = own_clock_get_real_ns(CLOCK_MONOTONIC);
    if (stood_ns > real_ns + atomic_load(&own_clock_ahead_ns))
        atomic_store(&own_clock_ahead_ns, stood_ns - real_ns);
    atomic_store(&own_clock_stands_ns, 0);
}

static inline void move_clock_on(uint64_t by_ns)
{
    atomic_fetch_add(atomic_load(&own_clock_stands_ns) ? &own_clock_stands_ns : &own_clock_ahead_ns, by_ns);
}

#endif
