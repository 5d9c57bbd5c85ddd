/* Coordinates in 32 bits: the floats or the whole steps that a scan has them as. Readers make doubles of them, and
 * those are given back to the bit, or they stay doubles: of other kinds of files, of scans that count from elsewhere,
 * where stations were moved. Half of the room that coordinates take from reading to the end of a pack, and of what is
 * read. What is kept so from reading on is guessed by the first scan; where that was wrong, and yet all are floats or
 * steps, it is found once they are ordered. */
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

static bool has_steps(const struct spl_cloud_coordinates *steps)
{
    return steps && steps->step[0] > 0 && steps->step[1] > 0 && steps->step[2] > 0;
}

static void take_steps(struct spl_points *points, const struct spl_cloud_coordinates *steps)
{
    points->kind = SPL_POINTS_STEPS;
    memcpy(points->step, steps->step, sizeof points->step);
    memcpy(points->first, steps->first, sizeof points->first);
}

/* Keeps a coordinate as the points' kind says, floats or steps; whether that is all of it. */
static inline bool keep(struct spl_points *to, int c, size_t i, double at)
{
    double steps = to->kind == SPL_POINTS_STEPS ? (at - to->first[c]) / to->step[c] : 0;
    if (to->kind == SPL_POINTS_FLOATS)
        to->floats[c][i] = (float)at;
    else
        to->steps[c][i] = fabs(steps) <= INT32_MAX ? (int32_t)lrint(steps) : 0;
    return spl_points_at(to, c, i) == at; /* no coordinate is -0 */
}

void spl_points_begin_narrow(struct spl_points *points, const struct spl_cloud_coordinates *steps)
{
    points->kind = SPL_POINTS_FLOATS;
    if (has_steps(steps) && !steps->floats)
        take_steps(points, steps);
}

static int widen(struct spl_points *points, struct spl_error *err)
{
    double *wide[3] = {NULL};
    int rc = SPL_OK;
    for (int c = 0; c < 3 && !rc; c++)
        if (!(wide[c] =
                  spl_spill_alloc_raw(points->spill, points->capacity + SPL_POINTS_PAD, sizeof *wide[c], err)))
            rc = SPL_E_NOMEM;
    for (int c = 0; c < 3; c++) {
        for (size_t i = 0; !rc && i < points->count; i++) {
            if (i % grain == 0)
                spl_spill_keep_bound(points->spill);
            wide[c][i] = spl_points_at(points, c, i);
        }
        spl_spill_free(points->spill, rc ? (void *)wide[c] : points->floats[c]);
    }
    if (!rc) {
        memcpy(points->axis, wide, sizeof wide);
        points->kind = SPL_POINTS_DOUBLES;
    }
    return rc;
}

int spl_points_put(struct spl_points *points, const double (*position)[3], size_t more, struct spl_error *err)
{
    bool kept = true;
    if (points->kind != SPL_POINTS_DOUBLES) {
        for (size_t i = 0; i < more && kept; i++)
            for (int c = 0; c < 3; c++)
                kept &= keep(points, c, points->count + i, spl_points_coordinate(position[i][c]));
        if (kept)
            return SPL_OK;
        if (widen(points, err))
            return SPL_E_NOMEM;
    }
    for (size_t i = 0; i < more; i++)
        for (int c = 0; c < 3; c++)
            points->axis[c][points->count + i] = spl_points_coordinate(position[i][c]);
    return SPL_OK;
}

static void narrow_piece(void *context, size_t begin, size_t end, unsigned worker)
{
    struct narrow *n = context;
    struct spl_points *to = &n->to;
    bool differs = atomic_load(&n->differs);
    (void)worker;
    spl_spill_keep_bound(to->spill);
    for (int c = 0; c < 3; c++)
        for (size_t i = begin; i < end && !differs; i++)
            differs = !keep(to, c, i, n->from->axis[c][i]);
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
    if (points->kind != SPL_POINTS_DOUBLES)
        return SPL_OK;
    floats.to.kind = SPL_POINTS_FLOATS;
    int rc = narrow(points, &floats, stage, &done, err);
    if (rc || done || !has_steps(steps))
        return rc;
    take_steps(&whole.to, steps);
    return narrow(points, &whole, stage, &done, err);
}
