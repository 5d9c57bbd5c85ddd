/* Data-parallel loops over all cores: threads are made per call, so there is no pool to own or to stop.
 * Worth it from about a millisecond of work on. */
#ifndef SPL_BASE_PARALLEL_H
#define SPL_BASE_PARALLEL_H

#include <stddef.h>

/* The number of threads that `requested` means: itself, or all online cores for 0. */
unsigned spl_thread_count(unsigned requested);

/* Calls `body(context, begin, end, worker)` over [0, count) in pieces of at most `grain` items, claimed in order by
 * `threads` workers (0 = all cores); `worker` < spl_thread_count(threads) indexes per-worker scratch. Returns when all
 * pieces are done. A machine that refuses threads runs the loop on the caller's. */
void spl_parallel_for(unsigned threads, size_t count, size_t grain,
                      void (*body)(void *context, size_t begin, size_t end, unsigned worker), void *context);

#endif
