/* How often an address may ask: a token bucket each, in a table of fixed size. Owned by one thread. */
#ifndef SPL_SERVICE_BUCKETS_H
#define SPL_SERVICE_BUCKETS_H

#include <stdint.h>

#include "base/error.h"

enum { SPL_BUCKET_KEY = 16 };

struct spl_buckets;

/* `per_second` >= 1 requests each; twice as many at once. */
int spl_buckets_create(uint64_t per_second, struct spl_buckets **out, struct spl_error *err);
void spl_buckets_destroy(struct spl_buckets *buckets); /* NULL-safe */

/* Takes one from the bucket of `key`: 0, or the seconds after which there will be one, at least 1. */
unsigned spl_buckets_take(struct spl_buckets *buckets, const uint8_t key[SPL_BUCKET_KEY], uint64_t now_ns);

/* Takes `count` more for what spl_buckets_take() has let in; the bucket may go into debt, which is waited for. Where it
 * is in debt already, nothing: the seconds after which there will be one. */
unsigned spl_buckets_charge(struct spl_buckets *buckets, const uint8_t key[SPL_BUCKET_KEY], unsigned count);

#endif
