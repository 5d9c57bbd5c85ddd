/* Checked allocation. Sizes are multiplied with overflow checks; a refusal is an error, never an abort.
 * Tests inject failures with spl_memory_fail_after(). */
#ifndef SPL_BASE_MEMORY_H
#define SPL_BASE_MEMORY_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#include "base/error.h"

/* `count` zeroed elements of `size` bytes, owned by the caller, released with free(); NULL and SPL_E_NOMEM on failure.
 * count == 0 gives a valid pointer. Any thread. */
void *spl_alloc(size_t count, size_t size, struct spl_error *err);

/* The same without zeroing, for large arrays that are filled at once. */
void *spl_alloc_raw(size_t count, size_t size, struct spl_error *err);

/* Grows `old` (may be NULL) to `count` elements; on failure returns NULL and `old` stays valid. */
void *spl_realloc(void *old, size_t count, size_t size, struct spl_error *err);

/* free() for who cannot wait: handing a GB back to the system takes 80 ms. What has many bytes is freed by a thread of
 * its own. Any thread. */
void spl_free_aside(void *memory, size_t bytes);

/* "4096", "2G": a whole number, with a suffix K, M, G or T of 1024; without one it counts `unit` bytes. All of the
 * text; false where it is something else or beyond 64 bits. */
bool spl_bytes_from_text(const char *text, uint64_t unit, uint64_t *out);

/* Fault injection: the n-th allocation from now (1 = the next) fails, once; 0 switches it off. Tests only. */
void spl_memory_fail_after(long n);

#endif
