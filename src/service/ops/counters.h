/* Counters of /v1/status; any thread adds. */
#ifndef SPL_SERVICE_COUNTERS_H
#define SPL_SERVICE_COUNTERS_H

#include <stdatomic.h>
#include <stdint.h>

struct spl_counters {
#define COUNTER(name, help) _Atomic uint64_t name;
#include "service/ops/counters.def"
#undef COUNTER
};

#define spl_count(counters, name) atomic_fetch_add_explicit(&(counters)->name, 1, memory_order_relaxed)

#endif
