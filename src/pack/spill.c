/* Arrays of a pack: which of them are large, which of those lie on the heap and which in files (spill_disk.c), and
 * small ones out of pools. What keeps the process within its bound is spill_bound.c.
 *
 * Invariant: under the lock `pieces` are all arrays that are large, in files and on the heap, and none is mapped or
 * unmapped without it. */
#include "pack/spill.h"

#include <errno.h>
#include <fcntl.h>
#include <malloc.h>
#include <stdlib.h>
#include <string.h>
#include <sys/mman.h>
#include <unistd.h>

#include "base/array.h"
#include "base/memory.h"
#include "pack/spill_parts.h"

enum { large = 1 << 20, pool_least = SPL_SPILL_POOL, pools_a_spill = 64 };
static const double in_memory = 0.35; /* of the bound */

static atomic_size_t forced;

void spl_spill_force(size_t least)
{
    atomic_store(&forced, least);
}

uint64_t spl_spill_get_share(uint64_t memory)
{
    return (uint64_t)(in_memory * (double)memory);
}

int spl_spill_create(const char *beside, uint64_t memory, struct spl_spill **out, struct spl_error *err)
{
    struct spl_spill *s = *out = spl_alloc(1, sizeof *s, err);
    if (!s)
        return SPL_E_NOMEM;
    s->memory = memory;
    s->high_before = spl_spill_get_high();
    s->statm = -1;
    pthread_mutex_init(&s->lock, NULL);
    int rc = (s->folder = spl_spill_find_folder(beside)) ? SPL_OK : spl_fail(err, SPL_E_NOMEM, "out of memory");
    if (!rc && (s->statm = open("/proc/self/statm", O_RDONLY | O_CLOEXEC)) < 0)
        rc = spl_fail_errno(err, errno, "/proc/self/statm cannot be read, which a bound of memory needs");
    if (!rc && (errno = pthread_create(&s->watcher, NULL, spl_spill_watch, s)))
        rc = spl_fail_errno(err, errno, "no thread can be made that keeps to the bound of memory");
    s->watched = !rc;
    if (rc) {
        spl_spill_destroy(s);
        *out = NULL;
    }
    return rc;
}

static void drop(struct spl_spill *s, size_t index)
{
    struct spl_spill_piece *p = &s->pieces[index];
    if (p->fd < 0) {
        free(p->at);
        s->on_heap -= p->bytes;
    } else {
        munmap(p->at, p->bytes);
        close(p->fd);
        s->on_disk -= p->bytes - p->holes;
        s->mapped -= p->bytes;
    }
    *p = s->pieces[--s->count];
}

void spl_spill_destroy(struct spl_spill *s)
{
    if (!s)
        return;
    atomic_store(&s->ends, true);
    if (s->watched)
        pthread_join(s->watcher, NULL);
    while (s->count)
        drop(s, s->count - 1);
    if (s->statm >= 0)
        close(s->statm);
    pthread_mutex_destroy(&s->lock);
    free(s->pieces);
    free(s->folder);
    free(s);
}

int spl_spill_explain(const struct spl_spill *s, int rc, struct spl_error *err)
{
    if (!s || !s->why.code || rc == SPL_OK || rc == SPL_E_CANCELLED)
        return rc;
    if (err)
        *err = s->why;
    return s->why.code;
}

/* Under the lock. */
static void *add_piece(struct spl_spill *s, size_t bytes, bool zeroed, struct spl_error *err)
{
    if (spl_array_reserve(s->pieces, s->capacity, s->count + 1, err))
        return NULL;
    if (s->on_heap + bytes > spl_spill_get_share(s->memory) || atomic_load(&forced))
        return spl_spill_map_file(s, bytes, err);
    void *at = zeroed ? spl_alloc(1, bytes, err) : spl_alloc_raw(1, bytes, err);
    if (at) {
        s->pieces[s->count++] = (struct spl_spill_piece){.at = at, .bytes = bytes, .fd = -1};
        s->on_heap += bytes;
    }
    return at;
}

/* Bytes from which on an array is a piece. */
static size_t get_least(void)
{
    return atomic_load(&forced) ? atomic_load(&forced) : large;
}

static void *allocate(struct spl_spill *s, size_t count, size_t size, bool zeroed, struct spl_error *err)
{
    size_t bytes;
    if (!s || __builtin_mul_overflow(count, size, &bytes) || bytes < get_least())
        return zeroed ? spl_alloc(count, size, err) : spl_alloc_raw(count, size, err);
    pthread_mutex_lock(&s->lock);
    void *at = add_piece(s, bytes, zeroed, err);
    pthread_mutex_unlock(&s->lock);
    return at;
}

void *spl_spill_alloc(struct spl_spill *spill, size_t count, size_t size, struct spl_error *err)
{
    return allocate(spill, count, size, true, err);
}

void *spl_spill_alloc_raw(struct spl_spill *spill, size_t count, size_t size, struct spl_error *err)
{
    return allocate(spill, count, size, false, err);
}

/* The number of pieces where it is none. */
static size_t find_piece(const struct spl_spill *s, const void *at)
{
    size_t i = 0;
    while (i < s->count && s->pieces[i].at != at)
        i++;
    return i;
}

void *spl_spill_realloc(struct spl_spill *s, void *old, size_t count, size_t size, struct spl_error *err)
{
    size_t bytes;
    if (!s || __builtin_mul_overflow(count, size, &bytes))
        return spl_realloc(old, count, size, err);
    if (!old)
        return allocate(s, count, size, false, err);
    pthread_mutex_lock(&s->lock);
    size_t i = find_piece(s, old), before = i < s->count ? s->pieces[i].bytes : 0, least = get_least();
    void *at = NULL;
    if (i == s->count && bytes < least) {
        at = spl_realloc(old, count, size, err);
    } else if (i == s->count) { /* small so far */
        const size_t had = malloc_usable_size(old);
        if ((at = add_piece(s, bytes, false, err))) {
            memcpy(at, old, had < bytes ? had : bytes);
            free(old);
        }
    } else if (bytes <= before) {
        at = old;
    } else if (s->pieces[i].fd >= 0) {
        at = spl_spill_grow_file(s, &s->pieces[i], bytes, err);
    } else if (s->on_heap - before + bytes <= spl_spill_get_share(s->memory)) {
        if ((at = spl_realloc(old, count, size, err))) {
            s->pieces[i] = (struct spl_spill_piece){.at = at, .bytes = bytes, .fd = -1};
            s->on_heap += bytes - before;
        }
    } else if ((at = add_piece(s, bytes, false, err))) {
        spl_spill_copy_to_file(at, old, before);
        drop(s, i);
    }
    pthread_mutex_unlock(&s->lock);
    return at;
}

void spl_spill_free(struct spl_spill *s, void *array)
{
    if (!s || !array) {
        free(array);
        return;
    }
    pthread_mutex_lock(&s->lock);
    size_t i = find_piece(s, array);
    bool is_piece = i < s->count;
    if (is_piece)
        drop(s, i);
    pthread_mutex_unlock(&s->lock);
    if (!is_piece)
        free(array);
}

void spl_spill_discard(struct spl_spill *s, void *from, size_t bytes)
{
    if (!s || !from)
        return;
    pthread_mutex_lock(&s->lock);
    for (size_t i = 0; i < s->count; i++) {
        struct spl_spill_piece *p = &s->pieces[i];
        if (p->fd >= 0 && (uintptr_t)from - (uintptr_t)p->at < p->bytes)
            spl_spill_punch(s, p, from, bytes);
    }
    pthread_mutex_unlock(&s->lock);
}

void *spl_spill_take(struct spl_spill *s, size_t count, size_t size, struct spl_error *err)
{
    size_t bytes;
    if (!s || __builtin_mul_overflow(count, size, &bytes) || bytes > pool_least - 64)
        return allocate(s, count, size, false, err);
    bytes = (bytes + 63) & ~(size_t)63;
    bytes += bytes ? 0 : 64; /* never none */
    pthread_mutex_lock(&s->lock);
    if (bytes > s->pool_left) { // of a file each: the larger the more there are
        size_t pool_bytes =
            s->on_disk / pools_a_spill > pool_least ? s->on_disk / pools_a_spill & ~(size_t)4095 : pool_least;
        char *pool = add_piece(s, pool_bytes, false, err);
        s->pool = pool ? pool : s->pool;
        s->pool_left = pool ? pool_bytes : s->pool_left;
    }
    void *at = NULL;
    if (bytes <= s->pool_left) {
        at = s->pool;
        s->pool += bytes;
        s->pool_left -= bytes;
    }
    pthread_mutex_unlock(&s->lock);
    return at;
}

void spl_spill_give(struct spl_spill *s, void *array)
{
    if (!s)
        free(array);
}

uint64_t spl_spill_disk_most(const struct spl_spill *spill)
{
    return spill->disk_most;
}
