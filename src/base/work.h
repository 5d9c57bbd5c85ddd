/* How far a loop over outside input may go: what steps are left of those that its size allows, and whether somebody has
 * asked it to stop. */
#ifndef SPL_BASE_WORK_H
#define SPL_BASE_WORK_H

#include <stdatomic.h>
#include <stdbool.h>
#include <stdint.h>

#include <splatd/cancel.h>

#include "base/error.h"

struct spl_work { // owned by: the thread that works
    uint64_t left; /* steps */
};

static inline bool spl_is_cancelled(const atomic_bool *cancelled)
{
    return cancelled && atomic_load_explicit(cancelled, memory_order_relaxed);
}

/* The flag inside a caller's `cancel`, which may be NULL. */
static inline const atomic_bool *spl_cancel_get_flag(const struct spl_cancel *cancel)
{
    return cancel ? (const atomic_bool *)&cancel->cancelled : NULL;
}

/* Takes a step; false when none is left. */
static inline bool spl_work_step(struct spl_work *work)
{
    return work->left && work->left--;
}

/* Takes as many of `steps` as are left. */
static inline void spl_work_take(struct spl_work *work, uint64_t steps)
{
    work->left -= steps < work->left ? steps : work->left;
}

/* SPL_E_LIMIT when no step is left, or 0. Without a message: what stops is for the caller to say. */
static inline int spl_work_check(const struct spl_work *work)
{
    return work->left ? SPL_OK : SPL_E_LIMIT;
}

#endif
