/* Progress of packing: a counter of the stage at work, reported by the calling thread, and what all stages that are yet
 * to come will take. */
#ifndef SPL_PACK_STAGE_H
#define SPL_PACK_STAGE_H

#include <stdatomic.h>
#include <stdbool.h>
#include <stdint.h>

#include <splatd/pack.h>

#include "base/work.h"
#include "pack/spill.h"

enum { SPL_STAGE_PARTS_MAX = 24 };

/* Work that is planned: `work` in seconds of the machine that it was measured on. Only ratios matter once some of it is
 * done. A part is every stage whose name begins with its own; `total` items of all of them, 0 = one stage. */
struct spl_stage_part {
    const char *name;
    double work;
    uint64_t total, done;
};

struct spl_stage {
    void (*callback)(void *context, const struct spl_progress *progress); /* may be NULL */
    void *context;
    unsigned threads; /* of all parallel loops of this run, >= 1 */
    const atomic_bool *cancelled; // may be NULL
    struct spl_spill *spill;      // where large arrays of this run lie; NULL: in memory
    const char *name, *unit;
    uint64_t total, begin_ns, reported_ns;
    atomic_uint_fast64_t done;

    struct spl_stage_part parts[SPL_STAGE_PARTS_MAX];
    uint32_t part_count, part; /* the one at work; part_count = none */
    uint64_t part_begin_ns;
    double work_done, seconds_done; /* of parts that are over */
};

/* Appends a part to what is planned, or changes one that has not been begun. Parts are worked off in their order. */
void spl_stage_plan(struct spl_stage *stage, const char *name, double work, uint64_t total);

/* Seconds until everything that is planned is done, were it to go on as it did: planned work at the speed of what is
 * done, and the stage at work more and more by its own speed. 0 = nothing is planned. `now_ns` as of spl_now_ns(). */
double spl_stage_left_s(const struct spl_stage *stage, uint64_t now_ns);

/* `name`, `unit` and `total` as in struct spl_progress. */
void spl_stage_begin(struct spl_stage *stage, const char *name, const char *unit, uint64_t total);

/* Adds `items` done; reports at most every 100 ms, and only from worker 0, which is the caller's thread. */
void spl_stage_add(struct spl_stage *stage, uint64_t items, unsigned worker);

/* Whether the run was cancelled: then a loop's pieces do nothing, which the loop's caller finds out by
 * spl_stage_check() before it uses what they should have made. Any thread. */
static inline bool spl_stage_is_cancelled(const struct spl_stage *stage)
{
    return spl_is_cancelled(stage->cancelled);
}
int spl_stage_check(const struct spl_stage *stage, struct spl_error *err); /* SPL_E_CANCELLED */

/* Reports the stage's end with what was counted. */
void spl_stage_end(struct spl_stage *stage);

/* The same with everything done, for stages whose steps only estimate their share. */
void spl_stage_finish(struct spl_stage *stage);

#endif
