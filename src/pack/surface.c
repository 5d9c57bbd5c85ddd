/* What each point's surroundings say: normal, radius (soft-transparency paper, eq. 20), uncertainty (eq. 21).
 *
 * Blocks of sorted points are done in parallel, each in one go: neighbours, normals, radii, signs within the block. The
 * neighbour lists live as long as their block; only points with a neighbour in another block keep theirs, a few
 * percent, until the signs between blocks are settled. Blocks do not depend on the number of threads, so neither does
 * the result.
 *
 * Points whose wide neighbours are asked for anyway get their clip line at once, of either sign of their normal.
 *
 * What a point's own neighbours give (radius.c) is held against the radii around it (settle.c), more strictly where
 * there is no surface. Which way normals point is surface_sides.c's. */
#include "pack/surface_parts.h"

#include <malloc.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "base/memory.h"
#include "base/parallel.h"
#include "pack/median.h"

static const float lone_radius = 0.01f;             /* of a point without any other, metres */
static const float smallest_radius = 1e-9f;         /* keeps squares and quotients of floats in range */
static const float flat_limit = 4, round_limit = 2; /* times what is usual in the run of points around */
enum { wide_factor = 3 };

/* Fills normal, radius and its factor to the run's median; true when the normal's side is known. */
static bool estimate(struct spl_points *p, const struct spl_vicinity *vicinity, size_t i, const struct spl_spread *own,
                     const struct spl_spread *around, struct spl_nearest near[2], float *limit, enum spl_edge *edge)
{
    double least[3], round, side = 1;
    double radius = spl_radius_estimate(vicinity, i, own, around, *limit, near, least, &round, edge);
    /* as its line asks for; of others nothing is read: pages that are written first are large ones */
    float most = p->linear && p->linear[i] && p->radius[i] > 0 ? p->radius[i] : INFINITY;
    p->radius[i] = fmaxf(fminf((float)radius, most), smallest_radius);
    *limit = flat_limit + (float)round * (round_limit - flat_limit);

    float *normal = p->normal[i];
    if (normal[0] != 0 || normal[1] != 0 || normal[2] != 0)
        return true;
    bool known = p->station && p->station[i] != SPL_NO_STATION;
    if (known) {
        const double *pose = p->stations[p->station[i]];
        side = 0;
        for (int c = 0; c < 3; c++)
            side += least[c] * (pose[4 * c + 3] - spl_points_at(p, c, i));
    }
    for (int c = 0; c < 3; c++)
        normal[c] = (float)(side < 0 ? -least[c] : least[c]);
    return known;
}

static bool keep_lines(const struct spl_surfaces *s, struct spl_surface_block *block,
                       const struct spl_surface_scratch *w, size_t count)
{
    block->lines = spl_spill_take(s->points->spill, count, sizeof *block->lines, NULL);
    if (!block->lines)
        return false;
    if (count)
        memcpy(block->lines, w->lines, count * sizeof *block->lines);
    block->line_count = count;
    return true;
}

static void surface_block(void *context, size_t begin_block, size_t end_block, unsigned worker)
{
    struct spl_surfaces *s = context;
    struct spl_surface_scratch *w = &s->scratch[worker];
    for (size_t b = begin_block; b < end_block; b++) {
        size_t begin = b * SPL_SURFACE_BLOCK;
        size_t end = begin + SPL_SURFACE_BLOCK < s->points->count ? begin + SPL_SURFACE_BLOCK : s->points->count;
        struct spl_nearest near[2];
        if (spl_stage_is_cancelled(s->stage))
            return;
        spl_nearest_init(near);
        for (size_t i = begin; i < end; i++) {
            spl_neighbours_find(s->neighbours, i, s->k, near);
            spl_facing_keep(&s->facing, i, s->k, near);
            uint32_t *list = w->neighbours + (i - begin) * s->k;
            for (unsigned a = 0; a < s->k; a++)
                list[a] = a < near->count ? near->index[a] : UINT32_MAX;
            w->moments[i - begin] = spl_moments_of(s->points, i, near);
            w->limit[i - begin] = (float)near->farthest;
            w->orient.reach[i - begin] = (float)(near->farthest * near->farthest);
            if ((i & 255) == 255)
                spl_spill_keep_bound(s->points->spill);
            if ((i & 4095) == 4095)
                spl_stage_add(s->stage, 4096, worker);
        }
        const struct spl_vicinity vicinity = {s->points,  s->neighbours, begin, end,
                                              w->moments, w->neighbours, &s->facing, s->k,  s->wide};
        spl_nearest_init(&near[0]);
        spl_nearest_init(&near[1]);
        struct spl_spreads spreads;
        size_t line_count = 0;
        for (size_t i = begin; i < end; i++) {
            enum spl_edge edge = SPL_EDGE_NONE;
            size_t at = (i - begin) % SPL_SPREADS;
            if (!at)
                spl_radius_spread(&vicinity, i, i + SPL_SPREADS < end ? i + SPL_SPREADS : end, &spreads);
            w->orient.held[i - begin] = estimate(s->points, &vicinity, i, &spreads.own[at], &spreads.wide[at], near,
                                                 &w->limit[i - begin], &edge)
                                            ? SPL_TREE_ANCHORED
                                            : 0;
            const bool kept = !s->points->halo || !s->points->halo[i]; /* of others nobody asks for lines */
            if (edge == SPL_EDGE_ASKED && kept && s->edge)
                line_count += spl_clip_foresee(s->points, i, near, &s->turns, &w->lines[line_count]);
            else if (edge && kept && s->edge)
                s->edge[i / 8] |= (uint8_t)(1 << i % 8); /* blocks share no byte */
        }
        const struct spl_settle_block settle = {
            s->points, begin, end, w->neighbours, s->label ? w->orient.label : NULL, s->k, &vicinity, w->limit};
        if (!keep_lines(s, &s->blocks[b], w, line_count) ||
            (s->label && !spl_surface_orient_block(s, &s->blocks[b], w, begin, end)) ||
            spl_unsettled_init(&s->blocks[b].unsettled, &settle)) {
            atomic_store(&s->failed, true);
            return;
        }
        spl_settle_block(&settle, &s->blocks[b].unsettled);
    }
}

static void set_lines(void *context, size_t begin, size_t end, unsigned worker)
{
    struct spl_surfaces *s = context;
    (void)worker;
    for (size_t b = begin; b < end; b++)
        spl_clip_set_foreseen(s->points, &s->turns, s->blocks[b].lines, s->blocks[b].line_count);
}

static void settle_rest(void *context, size_t begin, size_t end, unsigned worker)
{
    struct spl_surfaces *s = context;
    (void)worker;
    for (size_t b = begin; b < end; b++)
        spl_settle_find(s->points, &s->blocks[b].unsettled);
}

/* How far the farthest neighbours of most points are, squared, from a sample of them. */
static float find_usual_reach(const struct spl_points *p, const struct spl_neighbours *neighbours, unsigned k)
{
    enum { sample_most = 1024 };
    float reach[sample_most];
    size_t n = p->count < sample_most ? p->count : sample_most;
    struct spl_nearest near;
    spl_nearest_init(&near);
    for (size_t i = 0; i < n; i++) {
        spl_neighbours_find(neighbours, i * p->count / n, k, &near);
        reach[i] = (float)(near.farthest * near.farthest);
    }
    return fmaxf(spl_median(reach, n), smallest_radius * smallest_radius);
}

static int allocate(struct spl_surfaces *s, struct spl_error *err)
{
    struct spl_points *p = s->points;
    if (!p->radius)
        p->radius = spl_spill_alloc(p->spill, p->count, sizeof *p->radius, err);
    p->uncertainty = spl_spill_alloc_raw(p->spill, p->count, sizeof *p->uncertainty, err);
    if (!p->normal)
        p->normal = spl_spill_alloc(p->spill, p->count + SPL_POINTS_PAD, sizeof *p->normal, err);
    if (!p->radius || !p->uncertainty || !p->normal)
        return SPL_E_NOMEM;
    s->block_count = (p->count + SPL_SURFACE_BLOCK - 1) / SPL_SURFACE_BLOCK;
    s->blocks = spl_alloc(s->block_count, sizeof *s->blocks, err);
    s->scratch = spl_alloc(s->stage->threads, sizeof *s->scratch, err);
    if (!s->blocks || !s->scratch)
        return SPL_E_NOMEM;
    size_t capacity = p->count < SPL_SURFACE_BLOCK ? p->count : SPL_SURFACE_BLOCK;
    for (unsigned t = 0; t < s->stage->threads; t++) {
        s->scratch[t].neighbours = spl_alloc_raw(capacity, s->k * sizeof(uint32_t), err);
        s->scratch[t].limit = spl_alloc_raw(capacity, sizeof(float), err);
        s->scratch[t].moments = spl_alloc_raw(capacity, sizeof *s->scratch[t].moments, err);
        s->scratch[t].lines = spl_alloc_raw(capacity, sizeof *s->scratch[t].lines, err);
        if (!s->scratch[t].neighbours || !s->scratch[t].limit || !s->scratch[t].moments || !s->scratch[t].lines ||
            spl_orient_init(&s->scratch[t].orient, capacity, s->k, err))
            return SPL_E_NOMEM;
    }
    if (!spl_surface_knows_sides(p)) {
        s->label = spl_spill_alloc_raw(p->spill, p->count, sizeof *s->label, err);
        s->goes_on = spl_spill_alloc(p->spill, p->count / 8 + 1, 1, err);
        if (!s->label || !s->goes_on)
            return SPL_E_NOMEM;
    }
    s->neighbours = spl_neighbours_create(p, s->stage->threads, err);
    if (!s->neighbours)
        return SPL_E_NOMEM;
    s->facing = spl_facing_of(p, s->neighbours);
    if (s->label && p->count > 1) {
        float usual = find_usual_reach(p, s->neighbours, s->k);
        for (unsigned t = 0; t < s->stage->threads; t++)
            s->scratch[t].orient.usual = usual;
    }
    return SPL_OK;
}

/* What clip lines are not made of. */
static void finish_scratch(struct spl_surfaces *s)
{
    for (size_t b = 0; s->blocks && b < s->block_count; b++) {
        spl_unsettled_finish(&s->blocks[b].unsettled);
        free(s->blocks[b].components);
        s->blocks[b].components = NULL;
    }
    for (unsigned t = 0; s->scratch && t < s->stage->threads; t++) {
        free(s->scratch[t].neighbours);
        free(s->scratch[t].limit);
        free(s->scratch[t].moments);
        free(s->scratch[t].lines);
        spl_orient_finish(&s->scratch[t].orient);
    }
    free(s->scratch);
    free(s->components);
    spl_spill_free(s->points->spill, s->label);
    spl_spill_free(s->points->spill, s->goes_on);
    s->scratch = NULL;
    s->components = NULL;
    s->label = NULL;
    s->goes_on = NULL;
    malloc_trim(0); /* a tenth of what there is, in pieces, which would stay until the end */
}

static void finish(struct spl_surfaces *s)
{
    finish_scratch(s);
    for (size_t b = 0; s->blocks && b < s->block_count; b++)
        spl_spill_give(s->points->spill, s->blocks[b].lines);
    free(s->blocks);
    spl_spill_free(s->points->spill, s->edge);
    spl_neighbours_destroy(s->neighbours);
}

static void lone_point(struct spl_points *p)
{
    p->radius[0] = lone_radius;
    p->uncertainty[0] = lone_radius;
    if (p->normal[0][0] == 0 && p->normal[0][1] == 0 && p->normal[0][2] == 0)
        for (int c = 0; c < 3; c++)
            p->normal[0][c] = (float)p->up[c];
}

int spl_surface(struct spl_points *points, unsigned neighbours, bool clip_lines, struct spl_stage *stage,
                struct spl_error *err)
{
    struct spl_surfaces s = {.points = points, .stage = stage, .k = neighbours};
    s.wide = wide_factor * neighbours < SPL_NEIGHBOURS_MAX ? wide_factor * neighbours : SPL_NEIGHBOURS_MAX;
    spl_clip_turns_init(&s.turns);
    spl_stage_begin(stage, "normals and radii", "points", points->count);
    int rc = allocate(&s, err);
    if (!rc && clip_lines && points->count > 1 &&
        !(s.edge = spl_spill_alloc(points->spill, points->count / 8 + 1, 1, err)))
        rc = SPL_E_NOMEM;
    if (rc)
        goto done;
    if (points->count == 1) {
        lone_point(points);
        goto done;
    }
    spl_parallel_for(stage->threads, s.block_count, 1, surface_block, &s);
    if (atomic_load(&s.failed)) {
        rc = spl_fail(err, SPL_E_NOMEM, "out of memory while estimating the normals of %zu points", points->count);
        goto done;
    }
    if ((rc = spl_stage_check(stage, err)))
        goto done;
    if (s.label && (rc = spl_surface_join_blocks(&s, err)))
        goto done;
    spl_parallel_for(stage->threads, s.block_count, 1, settle_rest, &s);
    for (size_t b = 0; b < s.block_count; b++)
        spl_settle_store(points, &s.blocks[b].unsettled);
    spl_stage_finish(stage);
    finish_scratch(&s);
    if (s.edge)
        rc = spl_clip_lines(points, s.neighbours, s.wide, s.edge, stage, err);
    if (s.edge && !rc)
        spl_parallel_for(stage->threads, s.block_count, 1, set_lines, &s);
done:
    finish(&s);
    return rc;
}
