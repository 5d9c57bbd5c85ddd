/* Progress of one packing stage, counted by any worker, reported by the calling thread. */
#ifndef SPL_PACK_STAGE_H
#define SPL_PACK_STAGE_H

#include <stdatomic.h>
#include <stdint.h>

#include <splatd/pack.h>

struct spl_stage {
    void (*callback)(void *context, const struct spl_progress *progress); /* may be NULL */
    void *context;
    unsigned threads; /* of all parallel loops of this run, >= 1 */
    const char *name;
    uint64_t total, begin_ns, reported_ns;
    atomic_uint_fast64_t done;
};

void spl_stage_begin(struct spl_stage *stage, const char *name, uint64_t total);

/* Adds `items` done; reports at most every 100 ms, and only from worker 0, which is the caller's thread. */
void spl_stage_add(struct spl_stage *stage, uint64_t items, unsigned worker);

/* Reports the stage's end with what was counted. */
void spl_stage_end(struct spl_stage *stage);

/* The same with everything done, for stages whose steps only estimate their share. */
void spl_stage_finish(struct spl_stage *stage);

#endif
