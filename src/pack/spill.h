/* Large arrays of a pack that need not lie in memory: beyond a third of what the pack may take they lie in files
 * without a name, mapped, and what of them was not used for a while is let go of whenever the process comes near its
 * bound. What is made with them is the same wherever they lie. */
#ifndef SPL_PACK_SPILL_H
#define SPL_PACK_SPILL_H

#include <stddef.h>
#include <stdint.h>

#include "base/error.h"

struct spl_spill;

/* `memory` bytes that the process may take; files lie in the folder of `beside`. The caller destroys it after all that
 * lies in it. SPL_E_IO where no file can be made there. */
int spl_spill_create(const char *beside, uint64_t memory, struct spl_spill **out, struct spl_error *err);
void spl_spill_destroy(struct spl_spill *spill);

/* As spl_alloc(), spl_alloc_raw(), spl_realloc() and free(), which they are where `spill` is NULL. SPL_E_IO where the
 * disk has no room. Not while others read or write what is grown or freed; any thread. */
void *spl_spill_alloc(struct spl_spill *spill, size_t count, size_t size, struct spl_error *err);
void *spl_spill_alloc_raw(struct spl_spill *spill, size_t count, size_t size, struct spl_error *err);
void *spl_spill_realloc(struct spl_spill *spill, void *old, size_t count, size_t size, struct spl_error *err);
void spl_spill_free(struct spl_spill *spill, void *array);

/* Nobody reads these bytes again, which are of such an array: what they take on disk is given back. Any thread. */
void spl_spill_discard(struct spl_spill *spill, void *from, size_t bytes);

enum { SPL_SPILL_POOL = 8 << 20 }; /* bytes that such small ones are had of at a time, at least */

/* Many small ones, which come back only when the spill is destroyed. Where `spill` is NULL as spl_alloc_raw(),
 * free(). */
void *spl_spill_take(struct spl_spill *spill, size_t count, size_t size, struct spl_error *err);
void spl_spill_give(struct spl_spill *spill, void *array);

/* For whoever works on arrays, after each few thousand elements: takes pages away where the process is near its bound.
 * Any thread; `spill` may be NULL. */
void spl_spill_keep_bound(struct spl_spill *spill);

/* The most so far. */
uint64_t spl_spill_disk_most(const struct spl_spill *spill);   /* bytes of files */
uint64_t spl_spill_memory_most(struct spl_spill *spill); /* resident bytes of the process, as the kernel counts them */

/* What a pack ends with: `rc`, but where an array found no room on disk that, *err included: who wanted the array may
 * have taken it for memory. `spill` may be NULL. */
int spl_spill_explain(const struct spl_spill *spill, int rc, struct spl_error *err);

/* Bytes that arrays may take before the first of them goes to a file. */
uint64_t spl_spill_get_share(uint64_t memory);

/* SPL_E_IO, field "memory", where the folder of `beside` has not so many bytes free: of files meanwhile, and of what is
 * written there while they last. */
int spl_spill_check_disk(const char *beside, uint64_t meanwhile, uint64_t written, struct spl_error *err);

/* The folder of `beside` where it lies in memory itself, so that what is there is beyond no bound; else NULL. The
 * caller frees. */
char *spl_spill_find_memory_folder(const char *beside);

/* From now on each array of `least` bytes and more lies in a file, whatever memory there is; 0: as else. Tests only. */
void spl_spill_force(size_t least);

/* The n-th array from now on that is to lie in a file, or to grow there, finds no room; 0: none. Tests only. */
void spl_spill_fail_after(long n);

#endif
