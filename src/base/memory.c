/* Checked allocation with an injectable failure; the counter is atomic, everything else is malloc. */
#include "base/memory.h"

#include <ctype.h>
#include <errno.h>
#include <pthread.h>
#include <stdatomic.h>
#include <stdint.h>
#include <stdlib.h>
#include <string.h>

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

static void *free_it(void *memory)
{
    free(memory);
    return NULL;
}

void spl_free_aside(void *memory, size_t bytes)
{
    enum { slow_bytes = 16 << 20 }; /* more than a millisecond */
    pthread_attr_t detached;
    pthread_t thread;
    if (bytes < slow_bytes || pthread_attr_init(&detached)) {
        free(memory);
        return;
    }
    pthread_attr_setdetachstate(&detached, PTHREAD_CREATE_DETACHED);
    if (pthread_create(&thread, &detached, free_it, memory))
        free(memory);
    pthread_attr_destroy(&detached);
}

bool spl_bytes_from_text(const char *text, uint64_t unit, uint64_t *out)
{
    static const char suffixes[] = "KMGT";
    char *end;
    errno = 0;
    uint64_t value = strtoull(text, &end, 10);
    if (!isdigit((unsigned char)*text) || errno)
        return false;
    const char *suffix = *end ? strchr(suffixes, *end++) : NULL;
    if (suffix)
        unit = UINT64_C(1) << 10 * (suffix - suffixes + 1);
    else if (end[-1] < '0' || end[-1] > '9')
        return false;
    return !*end && !__builtin_mul_overflow(value, unit, out);
}
