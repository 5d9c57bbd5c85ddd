/* Counters of /v1/status; any thread adds. */
#ifndef SPL_SERVICE_COUNTERS_H
#define SPL_SERVICE_COUNTERS_H

#include <stdatomic.h>
#include <stdint.h>

#include "dataset/remote_counts.h"

struct spl_counters {
#define COUNTER(name, help) _Atomic uint64_t name;
#include "service/ops/counters.def"
#undef COUNTER
};

/* Brings up to date what other rooms count themselves. */
static inline void spl_counters_collect(struct spl_counters *counters)
{
    const struct spl_remote_counts *remote = &spl_remote_counts;
    atomic_store(&counters->remote_requests, atomic_load(&remote->requests));
    atomic_store(&counters->remote_bytes, atomic_load(&remote->bytes));
    atomic_store(&counters->remote_retries, atomic_load(&remote->retries));
    atomic_store(&counters->remote_failures, atomic_load(&remote->failures));
    atomic_store(&counters->remote_joined, atomic_load(&remote->joined));
    atomic_store(&counters->page_cache_hits, atomic_load(&remote->cache_hits));
    atomic_store(&counters->page_cache_misses, atomic_load(&remote->cache_misses));
    atomic_store(&counters->page_cache_evicted, atomic_load(&remote->cache_evicted));
    atomic_store(&counters->page_cache_spoilt, atomic_load(&remote->cache_spoilt));
    atomic_store(&counters->page_cache_failures, atomic_load(&remote->cache_failures));
    atomic_store(&counters->tile_faults, atomic_load(&remote->tile_faults));
}

#define spl_count(counters, name) atomic_fetch_add_explicit(&(counters)->name, 1, memory_order_relaxed)

#endif
