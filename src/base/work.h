/* Whether somebody has asked long work to stop. */
#ifndef SPL_BASE_WORK_H
#define SPL_BASE_WORK_H

#include <stdatomic.h>
#include <stdbool.h>

#include <splatd/cancel.h>

static inline bool spl_is_cancelled(const atomic_bool *cancelled)
{
    return cancelled && atomic_load_explicit(cancelled, memory_order_relaxed);
}

/* The flag inside a caller's `cancel`, which may be NULL. */
static inline const atomic_bool *spl_cancel_get_flag(const struct spl_cancel *cancel)
{
    return cancel ? (const atomic_bool *)&cancel->cancelled : NULL;
}

#endif
