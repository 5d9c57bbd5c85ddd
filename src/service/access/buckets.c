/* Token buckets in a hash table that never grows.
 *
 * A key lies in one of `ways` slots; where all are others', the one that was used least recently makes room, and its
 * owner starts anew with a full bucket: an attacker with very many addresses gets no more than what the total limit
 * allows. */
#include "service/access/buckets.h"

#include <stdlib.h>
#include <string.h>

#include <xxhash.h>

#include "base/clock.h"
#include "base/memory.h"

enum { slots = 8192, ways = 8 };

struct bucket {
    uint8_t key[SPL_BUCKET_KEY];
    double left;
    uint64_t at_ns; /* when `left` was right; 0 = never used */
};

struct spl_buckets {
    double per_second, most;
    uint64_t seed;
    struct bucket buckets[slots];
};

int spl_buckets_create(uint64_t per_second, struct spl_buckets **out, struct spl_error *err)
{
    spl_assert(per_second);
    if (!(*out = spl_alloc(1, sizeof **out, err)))
        return SPL_E_NOMEM;
    (*out)->per_second = (double)per_second;
    (*out)->most = 2 * (double)per_second;
    (*out)->seed = spl_now_ns(); // so that nobody can choose addresses which meet in one slot
    return 0;
}

void spl_buckets_destroy(struct spl_buckets *buckets)
{
    free(buckets);
}

static struct bucket *find(struct spl_buckets *buckets, const uint8_t key[SPL_BUCKET_KEY])
{
    uint64_t hash = XXH3_64bits_withSeed(key, SPL_BUCKET_KEY, buckets->seed);
    struct bucket *oldest = NULL;
    for (int way = 0; way < ways; way++) {
        struct bucket *bucket = &buckets->buckets[(hash + (uint64_t)way) % slots];
        if (bucket->at_ns && !memcmp(bucket->key, key, SPL_BUCKET_KEY))
            return bucket;
        if (!oldest || bucket->at_ns < oldest->at_ns)
            oldest = bucket;
    }
    memcpy(oldest->key, key, SPL_BUCKET_KEY);
    oldest->at_ns = 0;
    return oldest;
}

static unsigned get_wait_s(const struct spl_buckets *buckets, const struct bucket *bucket)
{
    return 1 + (unsigned)((1 - bucket->left) / buckets->per_second);
}

unsigned spl_buckets_take(struct spl_buckets *buckets, const uint8_t key[SPL_BUCKET_KEY], uint64_t now_ns)
{
    struct bucket *bucket = find(buckets, key);
    if (!bucket->at_ns)
        bucket->left = buckets->most;
    else if (now_ns > bucket->at_ns)
        bucket->left += (double)(now_ns - bucket->at_ns) / SPL_NS_PER_S * buckets->per_second;
    if (bucket->left > buckets->most)
        bucket->left = buckets->most;
    bucket->at_ns = now_ns ? now_ns : 1;
    if (bucket->left >= 1) {
        bucket->left--;
        return 0;
    }
    return get_wait_s(buckets, bucket);
}

unsigned spl_buckets_charge(struct spl_buckets *buckets, const uint8_t key[SPL_BUCKET_KEY], unsigned count)
{
    struct bucket *bucket = find(buckets, key);
    if (bucket->at_ns && bucket->left < 0)
        return get_wait_s(buckets, bucket);
    if (bucket->at_ns) // else another address has its place
        bucket->left -= count;
    return 0;
}
