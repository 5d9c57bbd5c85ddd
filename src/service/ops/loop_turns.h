/* How long the loop's turns take: from where it comes back from waiting to where it waits again. While a turn lasts,
 * nobody else is served. Owned by the loop's thread. */
#ifndef SPL_SERVICE_LOOP_TURNS_H
#define SPL_SERVICE_LOOP_TURNS_H

#include <stdint.h>
#include <stdio.h>
#include <uv.h>

enum { SPL_LOOP_TURN_BUCKETS = 9 };

struct spl_loop_turns {
    uv_prepare_t prepare;
    uint64_t told_ns, idle_ns, busy_ns; /* at the end of the last turn: time, idle and processor time so far */
    uint64_t longest_ns, busiest_ns;    /* of all turns: by the clock, by processor time; not always the same */
    uint64_t buckets[SPL_LOOP_TURN_BUCKETS + 1]; /* not cumulative; the last is beyond all bounds */
    uint64_t sum_ns;
};

/* From now on turns of `loop` are measured; before it runs for the first time. */
void spl_loop_turns_watch(struct spl_loop_turns *turns, uv_loop_t *loop);

/* In Prometheus' text format 0.0.4. */
void spl_loop_turns_print(const struct spl_loop_turns *turns, FILE *out);

#endif
