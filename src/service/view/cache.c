/* The cache: a hash table of chains for lookups, a list by age for eviction.
 *
 * Invariant: `bytes` is the sum over what is in the list, at most `limit`. A rendering that is dropped while replies
 * still send it lives on until they are done; rendering.c accounts for it from then on. */
#include "service/view/cache.h"

#include <stdlib.h>

#include "base/memory.h"

enum { bucket_bytes = 16 << 10, buckets_max = 1 << 16 }; /* about one small image a bucket */

LIST_HEAD(chain, spl_rendering);
struct spl_cache {
    TAILQ_HEAD(spl_rendering_list, spl_rendering) by_age; /* last used first */
    uint64_t entries, bytes, limit, evictions;
    size_t mask;
    struct chain buckets[];
};

int spl_cache_create(uint64_t limit_bytes, struct spl_cache **out, struct spl_error *err)
{
    size_t buckets = 1;
    while (buckets < buckets_max && buckets * bucket_bytes < limit_bytes)
        buckets *= 2;
    struct spl_cache *cache = spl_alloc(1, sizeof *cache + buckets * sizeof *cache->buckets, err);
    if (!cache)
        return SPL_E_NOMEM;
    TAILQ_INIT(&cache->by_age);
    cache->limit = limit_bytes;
    cache->mask = buckets - 1;
    *out = cache;
    return 0;
}

static void drop(struct spl_cache *cache, struct spl_rendering *rendering)
{
    LIST_REMOVE(rendering, bucket);
    TAILQ_REMOVE(&cache->by_age, rendering, age);
    cache->entries--;
    cache->bytes -= rendering->bytes;
    rendering->cached = false;
    *rendering->account += rendering->bytes;
    spl_rendering_unref(rendering);
}

void spl_cache_destroy(struct spl_cache *cache)
{
    if (!cache)
        return;
    while (!TAILQ_EMPTY(&cache->by_age))
        drop(cache, TAILQ_FIRST(&cache->by_age));
    free(cache);
}

static struct spl_rendering *find(struct spl_cache *cache, const struct spl_key *key)
{
    struct spl_rendering *rendering;
    LIST_FOREACH(rendering, &cache->buckets[key->words[0] & cache->mask], bucket)
    if (spl_key_equal(&rendering->key, key))
        return rendering;
    return NULL;
}

struct spl_rendering *spl_cache_find(struct spl_cache *cache, const struct spl_key *key)
{
    struct spl_rendering *rendering = find(cache, key);
    if (rendering) {
        TAILQ_REMOVE(&cache->by_age, rendering, age);
        TAILQ_INSERT_HEAD(&cache->by_age, rendering, age);
    }
    return rendering;
}

void spl_cache_put(struct spl_cache *cache, struct spl_rendering *rendering)
{
    if (rendering->bytes > cache->limit || find(cache, &rendering->key))
        return;
    while (cache->bytes + rendering->bytes > cache->limit) {
        drop(cache, TAILQ_LAST(&cache->by_age, spl_rendering_list));
        cache->evictions++;
    }
    LIST_INSERT_HEAD(&cache->buckets[rendering->key.words[0] & cache->mask], rendering, bucket);
    TAILQ_INSERT_HEAD(&cache->by_age, rendering, age);
    cache->entries++;
    cache->bytes += rendering->bytes;
    rendering->cached = true;
    *rendering->account -= rendering->bytes;
    spl_rendering_ref(rendering);
}

void spl_cache_get_status(const struct spl_cache *cache, struct spl_cache_status *status)
{
    *status = (struct spl_cache_status){cache->entries, cache->bytes, cache->limit, cache->evictions};
}
