/* Checked allocation with an injectable failure; the counter is atomic, everything else is malloc. */
#include "base/memory.h"

#include <stdatomic.h>
#include <stdint.h>
#include <stdlib.h>

static atomic_long fail_countdown;

void spl_memory_fail_after(long n)
{
    atomic_store(&fail_countdown, n);
}

static bool injected(void)
{
    if (atomic_load_explicit(&fail_countdown, memory_order_relaxed) <= 0)
        return false;
    return atomic_fetch_sub(&fail_countdown, 1) == 1;
}

static void *refuse(size_t count, size_t size, struct spl_error *err)
{
    spl_fail(err, SPL_E_NOMEM, "out of memory: %zu elements of %zu bytes were refused", count, size);
    return NULL;
}

void *spl_alloc(size_t count, size_t size, struct spl_error *err)
{
    void *p = injected() ? NULL : calloc(count ? count : 1, size);
    return p ? p : refuse(count, size, err);
}

void *spl_alloc_raw(size_t count, size_t size, struct spl_error *err)
{
    return spl_realloc(NULL, count, size, err);
}

void *spl_realloc(void *old, size_t count, size_t size, struct spl_error *err)
{
    if (size && count > SIZE_MAX / size)
        return refuse(count, size, err);
    size_t bytes = count * size;
    void *p = injected() ? NULL : realloc(old, bytes ? bytes : 1);
    return p ? p : refuse(count, size, err);
}
