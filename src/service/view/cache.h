/* Renderings by key, the least recently used dropped first, within a limit of bytes. Owned by the loop's thread. */
#ifndef SPL_SERVICE_CACHE_H
#define SPL_SERVICE_CACHE_H

#include "service/view/rendering.h"

struct spl_cache;

/* A limit of 0 bytes keeps nothing. */
int spl_cache_create(uint64_t limit_bytes, struct spl_cache **out, struct spl_error *err);
void spl_cache_destroy(struct spl_cache *cache); /* NULL-safe */

/* Borrowed, for the caller to reference before the next call; NULL when it is not there. Counts as use. */
struct spl_rendering *spl_cache_find(struct spl_cache *cache, const struct spl_key *key);

/* Keeps a reference of its own and drops the oldest until all fits; does nothing with one that is larger than the
 * limit, or whose key is there already. */
void spl_cache_put(struct spl_cache *cache, struct spl_rendering *rendering);

struct spl_cache_status {
    uint64_t entries, bytes, limit_bytes, evictions;
};
void spl_cache_get_status(const struct spl_cache *cache, struct spl_cache_status *status);

#endif
