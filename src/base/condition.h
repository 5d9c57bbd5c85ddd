/* Conditions whose waits end at a deadline of base/clock.h, which a change of the wall clock does not move. */
#ifndef SPL_BASE_CONDITION_H
#define SPL_BASE_CONDITION_H

#include <pthread.h>
#include <stdbool.h>

#include "base/clock.h"

static inline void spl_condition_init(pthread_cond_t *condition)
{
    pthread_condattr_t monotonic;
    pthread_condattr_init(&monotonic);
    pthread_condattr_setclock(&monotonic, CLOCK_MONOTONIC);
    pthread_cond_init(condition, &monotonic);
    pthread_condattr_destroy(&monotonic);
}

/* False once the deadline has passed; the caller, who holds the mutex, looks again at what it waits for either way. */
static inline bool spl_condition_wait(pthread_cond_t *condition, pthread_mutex_t *mutex, uint64_t deadline_ns)
{
    struct timespec t = {.tv_sec = (time_t)(deadline_ns / SPL_NS_PER_S), .tv_nsec = (long)(deadline_ns % SPL_NS_PER_S)};
    if (!spl_remaining_ns(deadline_ns))
        return false;
    if (deadline_ns == SPL_NEVER)
        pthread_cond_wait(condition, mutex);
    else
        pthread_cond_timedwait(condition, mutex, &t);
    return true;
}

#endif
