/* Blocks of datasets that lie elsewhere, kept in files of a local folder: bounded, least recently used first to go,
 * there again after a restart, and shared by as many processes as use the folder. Nothing here fails: what cannot be
 * kept is not, and what was spoilt is not found. */
#ifndef SPL_DATASET_PAGE_CACHE_H
#define SPL_DATASET_PAGE_CACHE_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#include "base/error.h"

struct spl_page_cache;

/* One state of one remote file. */
struct spl_page_key {
    uint64_t low, high;
};

/* Of where it lies, for people, what its server calls this state of it, and its length. */
struct spl_page_key spl_page_key_of(const char *shown, const char *state, uint64_t size);

/* `folder` is made where it is missing, for this user alone. Errors name it and field "page-cache". The caller has one
 * reference to *out. */
int spl_page_cache_open(const char *folder, uint64_t bytes_max, struct spl_page_cache **out, struct spl_error *err);

/* NULL-safe, any thread; the last to let go frees it, and leaves the files. */
struct spl_page_cache *spl_page_cache_hold(struct spl_page_cache *cache);
void spl_page_cache_let_go(struct spl_page_cache *cache);

/* Block `block`, of exactly `bytes` bytes, to `out`: false (*out undefined) where it is not there or not what was
 * written, after which it is gone. Any thread, as all below; blocks on disk. `cache` may be NULL. */
bool spl_page_cache_read(struct spl_page_cache *cache, struct spl_page_key key, uint64_t block, void *out,
                         size_t bytes);
void spl_page_cache_write(struct spl_page_cache *cache, struct spl_page_key key, uint64_t block, const void *data,
                          size_t bytes);
void spl_page_cache_drop(struct spl_page_cache *cache, struct spl_page_key key, uint64_t block);

/* What its files take, as of the last look through the folder and what this process has written since. */
uint64_t spl_page_cache_get_bytes(struct spl_page_cache *cache);

#endif
