/* One way to end what takes long, from another thread: whoever opens, packs or renders with a pointer to a struct
 * spl_cancel fails with SPL_E_CANCELLED soon after it was set. */
#ifndef SPLATD_CANCEL_H
#define SPLATD_CANCEL_H

#include <stdbool.h>

#include <splatd/api.h>

SPL_BEGIN_DECLARATIONS

/* In the caller's storage, zeroed; only the functions below touch it. May serve many calls at once, and is borrowed by
 * each as its header says. */
struct spl_cancel {
    bool cancelled;
};

/* Any thread, signal handlers too; never blocks. */
SPL_API void spl_cancel_set(struct spl_cancel *cancel);
SPL_API void spl_cancel_clear(struct spl_cancel *cancel); /* once nobody uses it, to use it again */
SPL_API bool spl_cancel_is_set(const struct spl_cancel *cancel);

SPL_END_DECLARATIONS

#endif
