/* A counter and a clock. Worker 0 of every parallel loop is the thread that called spl_pack(), so reporting from it
 * alone keeps the callback on the caller's thread without a lock. */
#include "pack/stage.h"

#include "base/clock.h"

static void report(struct spl_stage *stage, uint64_t now)
{
    uint64_t done = atomic_load_explicit(&stage->done, memory_order_relaxed);
    double seconds = (double)(now - stage->begin_ns) / 1e9;
    struct spl_progress progress = {stage->name, done, stage->total, seconds > 0 ? (double)done / seconds : 0};
    stage->reported_ns = now;
    if (stage->callback)
        stage->callback(stage->context, &progress);
}

void spl_stage_begin(struct spl_stage *stage, const char *name, uint64_t total)
{
    stage->name = name;
    stage->total = total;
    stage->begin_ns = spl_now_ns();
    atomic_store(&stage->done, 0);
    report(stage, stage->begin_ns);
}

void spl_stage_add(struct spl_stage *stage, uint64_t items, unsigned worker)
{
    atomic_fetch_add_explicit(&stage->done, items, memory_order_relaxed);
    if (worker != 0)
        return;
    uint64_t now = spl_now_ns();
    if (now - stage->reported_ns >= 100 * SPL_NS_PER_MS)
        report(stage, now);
}

void spl_stage_end(struct spl_stage *stage)
{
    report(stage, spl_now_ns());
}

void spl_stage_finish(struct spl_stage *stage)
{
    atomic_store(&stage->done, stage->total);
    spl_stage_end(stage);
}
