/* A counter and a clock. Worker 0 of every parallel loop is the thread that called spl_pack(), so reporting from it
 * alone keeps the callback on the caller's thread without a lock. */
#include "pack/stage.h"

#include <math.h>
#include <string.h>

#include "base/clock.h"
#include "base/error.h"

/* Seconds for which planned work counts against measured speed: until they have passed the machine is taken to be the
 * one that the plan was made on. */
static const double trust_s = 1;

void spl_stage_plan(struct spl_stage *stage, const char *name, double work, uint64_t total)
{
    uint32_t i = 0;
    while (i < stage->part_count && strcmp(stage->parts[i].name, name))
        i++;
    if (i == SPL_STAGE_PARTS_MAX)
        return;
    if (i == stage->part_count && stage->part == stage->part_count++)
        stage->part = stage->part_count; /* none is at work */
    stage->parts[i] = (struct spl_stage_part){name, work, total, 0};
}

double spl_stage_left_s(const struct spl_stage *stage, uint64_t now_ns)
{
    double later = 0, work = 0, share = 0, seconds = 0;
    bool at_work = stage->part < stage->part_count;
    if (!stage->part_count)
        return 0;
    if (at_work) {
        const struct spl_stage_part *part = &stage->parts[stage->part];
        double done = (double)(part->done + atomic_load_explicit(&stage->done, memory_order_relaxed));
        double total = (double)(part->total ? part->total : stage->total);
        work = part->work;
        share = total > 0 ? fmin(done / total, 1) : 0;
        seconds = (double)(now_ns - stage->part_begin_ns) / 1e9;
    }
    for (uint32_t i = at_work ? stage->part + 1 : 0; i < stage->part_count; i++)
        later += stage->parts[i].work;
    double slow =
        (stage->seconds_done + (share > 0 ? seconds : 0) + trust_s) / (stage->work_done + share * work + trust_s);
    double planned = slow * work, now = fmax(planned - seconds, 0); /* of a stage that does not count */
    if (share > 0)
        now = (1 - share) * (seconds + (1 - share) * planned); /* share * (seconds / share): its own speed */
    return now + slow * later;
}

static void report(struct spl_stage *stage, uint64_t now)
{
    uint64_t done = atomic_load_explicit(&stage->done, memory_order_relaxed);
    double seconds = (double)(now - stage->begin_ns) / 1e9;
    struct spl_progress progress = {.stage = stage->name,
                                    .unit = stage->unit,
                                    .done = done,
                                    .total = stage->total,
                                    .rate = seconds > 0 ? (double)done / seconds : 0,
                                    .left_s = spl_stage_left_s(stage, now)};
    if (progress.left_s > 0 && progress.rate > 0 && stage->total > done) /* of two guesses one contains the other */
        progress.left_s = fmax(progress.left_s, (double)(stage->total - done) / progress.rate);
    stage->reported_ns = now;
    if (stage->callback)
        stage->callback(stage->context, &progress);
}

/* Closes the part at work where another begins; parts between the two were not needed. */
static void change_part(struct spl_stage *stage, const char *name, uint64_t now)
{
    uint32_t next = stage->part < stage->part_count ? stage->part : 0;
    while (next < stage->part_count && strncmp(name, stage->parts[next].name, strlen(stage->parts[next].name)))
        next++;
    if (next == stage->part_count) /* what is not planned belongs to the part before it */
        return;
    if (stage->part < stage->part_count && next != stage->part) {
        stage->work_done += stage->parts[stage->part].work;
        stage->seconds_done += (double)(now - stage->part_begin_ns) / 1e9;
    } else if (next == stage->part) {
        stage->parts[next].done += atomic_load(&stage->done);
    }
    if (next != stage->part)
        stage->part_begin_ns = now;
    stage->part = next;
}

void spl_stage_begin(struct spl_stage *stage, const char *name, const char *unit, uint64_t total)
{
    uint64_t now = spl_now_ns();
    change_part(stage, name, now);
    stage->name = name;
    stage->unit = unit;
    stage->total = total;
    stage->begin_ns = now;
    atomic_store(&stage->done, 0);
    report(stage, stage->begin_ns);
}

void spl_stage_add(struct spl_stage *stage, uint64_t items, unsigned worker)
{
    atomic_fetch_add_explicit(&stage->done, items, memory_order_relaxed);
    spl_spill_keep_bound(stage->spill);
    if (worker != 0)
        return;
    uint64_t now = spl_now_ns();
    if (now - stage->reported_ns >= 100 * SPL_NS_PER_MS)
        report(stage, now);
}

int spl_stage_check(const struct spl_stage *stage, struct spl_error *err)
{
    return spl_stage_is_cancelled(stage) ? spl_fail(err, SPL_E_CANCELLED, "packing was cancelled") : SPL_OK;
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
