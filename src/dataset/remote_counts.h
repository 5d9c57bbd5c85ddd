/* What was fetched from elsewhere by this process, and what its page cache was good for. Any thread adds and reads. */
#ifndef SPL_DATASET_REMOTE_COUNTS_H
#define SPL_DATASET_REMOTE_COUNTS_H

#include <stdatomic.h>
#include <stdint.h>

struct spl_remote_counts {
    _Atomic uint64_t requests;  /* sent, retries among them */
    _Atomic uint64_t bytes;     /* of datasets that came */
    _Atomic uint64_t retries;   /* requests that repeat one that failed or broke off */
    _Atomic uint64_t failures;  /* reads that were given up */
    _Atomic uint64_t joined;    /* blocks that came for somebody else who asked for them at the same time */
    _Atomic uint64_t cache_hits, cache_misses;      /* blocks found in the page cache, and fetched */
    _Atomic uint64_t cache_evicted, cache_spoilt;   /* blocks that made room; whose checksum did not hold */
    _Atomic uint64_t cache_failures;                /* writes that the disk refused */
    _Atomic uint64_t tile_faults;                   /* tiles of collections, here or there, found not to be readable */
};

extern struct spl_remote_counts spl_remote_counts;

#define spl_remote_count(name, n) atomic_fetch_add_explicit(&spl_remote_counts.name, (n), memory_order_relaxed)

#endif
