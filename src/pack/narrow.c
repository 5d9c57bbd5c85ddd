/* Coordinates in 32 bits: the floats or the whole steps that a scan has them as. Readers make doubles of them, and
 * those are given back to the bit, or they stay doubles: of other kinds of files, of scans that count from elsewhere,
 * where stations were moved. Half of the room that coordinates take from here to the end of a pack, and of what is
 * read. */
#include "pack/points.h"

#include <math.h>
#include <string.h>

#include "base/parallel.h"

enum { grain = 1 << 16 };

struct narrow {
    const struct spl_points *from;
    struct spl_points to;
    atomic_bool differs;
};

static void narrow_piece(void *context, size_t begin, size_t end, unsigned worker)
{
    struct narrow *n = context;
    struct spl_points *to = &n->to;
    bool differs = atomic_load(&n->differs);
    (void)worker;
    spl_spill_keep_bound(to->spill);
    for (int c = 0; c < 3; c++)
        for (size_t i = begin; i < end && !differs; i++) {
            double at = n->from->axis[c][i],
                   steps = to->kind == SPL_POINTS_STEPS ? (at - to->first[c]) / to->step[c] : 0;
            if (to->kind == SPL_POINTS_FLOATS)
                to->floats[c][i] = (float)at;
            else
                to->steps[c][i] = fabs(steps) <= INT32_MAX ? (int32_t)lrint(steps) : 0;
            differs = spl_points_at(to, c, i) != at; /* no coordinate is -0 */
        }
    if (differs)
        atomic_store(&n->differs, true);
}

/* Whether all can be kept as n->to says: then *points is that. */
static int narrow(struct spl_points *points, struct narrow *n, struct spl_stage *stage, bool *done,
                  struct spl_error *err)
{
    int rc = SPL_OK;
    for (int c = 0; c < 3; c++) {
        n->to.floats[c] =
            rc ? NULL : spl_spill_alloc_raw(points->spill, points->count + SPL_POINTS_PAD, sizeof(float), err);
        if (n->to.floats[c])
            memset(n->to.floats[c] + points->count, 0, SPL_POINTS_PAD * sizeof(float));
        else
            rc = SPL_E_NOMEM;
    }
    if (!rc)
        spl_parallel_for(stage->threads, points->count, grain, narrow_piece, n);
    *done = !rc && !atomic_load(&n->differs);
    for (int c = 0; c < 3; c++)
        spl_spill_free(points->spill, *done ? points->axis[c] : n->to.axis[c]);
    if (*done)
        *points = n->to;
    return rc;
}

int spl_points_narrow(struct spl_points *points, const struct spl_cloud_coordinates *steps, struct spl_stage *stage,
                      struct spl_error *err)
{
    struct narrow floats = {.from = points, .to = *points}, whole = floats;
    bool done = false;
    floats.to.kind = SPL_POINTS_FLOATS;
    int rc = narrow(points, &floats, stage, &done, err);
    if (rc || done || !steps || !(steps->step[0] > 0 && steps->step[1] > 0 && steps->step[2] > 0))
        return rc;
    whole.to.kind = SPL_POINTS_STEPS;
    memcpy(whole.to.step, steps->step, sizeof whole.to.step);
    memcpy(whole.to.first, steps->first, sizeof whole.to.first);
    return narrow(points, &whole, stage, &done, err);
}
