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
 * there is no surface. */
#include "pack/points.h"

#include <malloc.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "base/memory.h"
#include "base/parallel.h"
#include "pack/clip.h"
#include "pack/median.h"
#include "pack/orient_join.h"
#include "pack/radius.h"
#include "pack/settle.h"
#include "pack/shell.h"

enum { block_points = 1 << 16 };
_Static_assert((int)block_points <= UINT16_MAX + 1, "components of a block are told apart by 16 bits");
static const float lone_radius = 0.01f;             /* of a point without any other, metres */
static const float smallest_radius = 1e-9f;         /* keeps squares and quotients of floats in range */
static const float flat_limit = 4, round_limit = 2; /* times what is usual in the run of points around */
enum { wide_factor = 3 };

struct block {
    struct spl_unsettled unsettled;
    struct spl_clip_foreseen *lines;
    size_t line_count;
    struct spl_component *components;
    uint32_t component_count, first_component;
};

struct scratch {                 /* of one worker */
    struct spl_moments *moments; /* of each point of the block */
    uint32_t *neighbours;        /* k a point, unused ones UINT32_MAX */
    float *limit; /* of each point, in turn: its farthest neighbour's distance, the factor of its run's median
                     radius, that times the median, its settled radius */
    struct spl_clip_foreseen *lines; /* of the block */
    struct spl_orient orient;
};

struct surface {
    struct spl_points *points;
    struct spl_neighbours *neighbours;
    struct spl_stage *stage;
    struct scratch *scratch;
    struct block *blocks;
    size_t block_count;
    uint8_t *edge; /* a bit of each point: its surface may end there, and nobody has looked; NULL: no clip lines */
    struct spl_clip_turns turns;
    uint16_t *label;  /* component of each point within its block; NULL when every side is known */
    uint8_t *goes_on; /* a bit of each point, where there are labels: it is one of a level piece that goes on */
    struct spl_component *components;
    unsigned k, wide;
    atomic_bool failed;
};

/* Fills normal, radius and its factor to the run's median; true when the normal's side is known. */
static bool estimate(struct spl_points *p, const struct spl_vicinity *vicinity, size_t i, const struct spl_spread *own,
                     const struct spl_spread *around, struct spl_nearest *near, float *limit, enum spl_edge *edge)
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

static bool orient_inner(struct surface *s, struct block *block, struct scratch *w, size_t begin, size_t end)
{
    struct spl_orient *o = &w->orient;
    block->component_count = spl_orient_block(o, s->points, begin, end, w->neighbours, s->k);
    block->components = spl_alloc_raw(block->component_count, sizeof *block->components, NULL);
    if (!block->components)
        return false;
    memcpy(block->components, o->components, block->component_count * sizeof *block->components);
    for (size_t i = begin; i < end; i++) {
        s->label[i] = (uint16_t)o->label[i - begin];
        s->goes_on[i / 8] |= (uint8_t)((o->kind[i - begin] != 0) << i % 8); /* blocks share no byte */
    }
    return true;
}

static bool keep_lines(const struct surface *s, struct block *block, const struct scratch *w, size_t count)
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
    struct surface *s = context;
    struct scratch *w = &s->scratch[worker];
    for (size_t b = begin_block; b < end_block; b++) {
        size_t begin = b * block_points;
        size_t end = begin + block_points < s->points->count ? begin + block_points : s->points->count;
        struct spl_nearest near;
        if (spl_stage_is_cancelled(s->stage))
            return;
        spl_nearest_init(&near);
        for (size_t i = begin; i < end; i++) {
            spl_neighbours_find(s->neighbours, i, s->k, &near);
            uint32_t *list = w->neighbours + (i - begin) * s->k;
            for (unsigned a = 0; a < s->k; a++)
                list[a] = a < near.count ? near.index[a] : UINT32_MAX;
            w->moments[i - begin] = spl_moments_of(s->points, i, &near);
            w->limit[i - begin] = (float)near.farthest;
            w->orient.reach[i - begin] = (float)(near.farthest * near.farthest);
            if ((i & 255) == 255)
                spl_spill_keep_bound(s->points->spill);
            if ((i & 4095) == 4095)
                spl_stage_add(s->stage, 4096, worker);
        }
        const struct spl_vicinity vicinity = {s->points,  s->neighbours, begin, end,
                                              w->moments, w->neighbours, s->k,  s->wide};
        spl_nearest_init(&near);
        struct spl_spreads spreads;
        size_t line_count = 0;
        for (size_t i = begin; i < end; i++) {
            enum spl_edge edge = SPL_EDGE_NONE;
            size_t at = (i - begin) % SPL_SPREADS;
            if (!at)
                spl_radius_spread(&vicinity, i, i + SPL_SPREADS < end ? i + SPL_SPREADS : end, &spreads);
            w->orient.held[i - begin] = estimate(s->points, &vicinity, i, &spreads.own[at], &spreads.wide[at], &near,
                                                 &w->limit[i - begin], &edge)
                                            ? SPL_TREE_ANCHORED
                                            : 0;
            const bool kept = !s->points->halo || !s->points->halo[i]; /* of others nobody asks for lines */
            if (edge == SPL_EDGE_ASKED && kept && s->edge)
                line_count += spl_clip_foresee(s->points, i, &near, &s->turns, &w->lines[line_count]);
            else if (edge && kept && s->edge)
                s->edge[i / 8] |= (uint8_t)(1 << i % 8); /* blocks share no byte */
        }
        const struct spl_settle_block settle = {
            s->points, begin, end, w->neighbours, s->label ? w->orient.label : NULL, s->k, &vicinity, w->limit};
        if (!keep_lines(s, &s->blocks[b], w, line_count) ||
            (s->label && !orient_inner(s, &s->blocks[b], w, begin, end)) ||
            spl_unsettled_init(&s->blocks[b].unsettled, &settle)) {
            atomic_store(&s->failed, true);
            return;
        }
        spl_settle_block(&settle, &s->blocks[b].unsettled);
    }
}

static bool goes_on(const struct surface *s, size_t i)
{
    return s->goes_on[i / 8] >> i % 8 & 1;
}

/* What a point that waits says of its component and those of its neighbours. */
static int add_edges(struct surface *s, size_t b, size_t unsettled, struct spl_orient_join *join, struct spl_error *err)
{
    const struct block *block = &s->blocks[b];
    const uint32_t i = block->unsettled.points[unsettled].index, own = block->first_component + s->label[i];
    uint32_t room[SPL_NEIGHBOURS_MAX];
    const uint32_t *list = spl_unsettled_get_neighbours(&block->unsettled, unsettled, room);
    int rc = SPL_OK;
    for (unsigned a = 0; !rc && a < s->k && list[a] != UINT32_MAX; a++) {
        size_t in = list[a] / block_points;
        uint32_t other = s->blocks[in].first_component + s->label[list[a]];
        if (other != own)
            rc = spl_orient_join_add(join, own, other, spl_orient_agreement(s->points, i, list[a]),
                                     in != b && goes_on(s, i) && goes_on(s, list[a]), err);
    }
    return rc;
}

static struct spl_component *component_of(const struct surface *s, size_t i)
{
    return &s->components[s->blocks[i / block_points].first_component + s->label[i]];
}

/* What is closed all around has as much above as below, so up says little of it: a room shows in, a thing out. Of large
 * components some points stand for all. */
static int turn_shells(struct surface *s, size_t count, struct spl_error *err)
{
    enum { many = 4096, some = 8 };
    const struct spl_points *p = s->points;
    bool any = false;
    for (size_t c = 0; c < count; c++)
        any |= s->components[c].unsure;
    if (!any || p->eye_count)
        return SPL_OK;
    struct spl_shell *shells = spl_alloc(count, sizeof *shells, err); /* of each tree */
    if (!shells)
        return SPL_E_NOMEM;
    for (size_t i = 0; i < p->count; i++) {
        const struct spl_component *c = component_of(s, i);
        const bool sampled = c->count > many;
        double place[3], area = (double)p->radius[i] * p->radius[i] * (sampled ? some : 1);
        if (i % 4096 == 0)
            spl_spill_keep_bound(p->spill);
        if (!c->unsure || (sampled && i % some))
            continue;
        for (int x = 0; x < 3; x++)
            place[x] = spl_points_at(p, x, i) - spl_points_at(p, x, 0);
        spl_shell_add(&shells[c->tree], place, p->normal[i], p->up, area, c->flip);
    }
    for (size_t c = 0; c < count; c++)
        s->components[c].flip ^= spl_shell_is_inside_out(&shells[s->components[c].tree], s->components[c].doubtful);
    free(shells);
    return SPL_OK;
}

static int join_blocks(struct surface *s, struct spl_error *err)
{
    size_t components = 0;
    struct spl_orient_join join;
    for (size_t b = 0; b < s->block_count; b++) {
        s->blocks[b].first_component = (uint32_t)components;
        components += s->blocks[b].component_count;
    }
    s->components = spl_alloc_raw(components, sizeof *s->components, err);
    if (!s->components)
        return SPL_E_NOMEM;
    for (size_t b = 0; b < s->block_count; b++)
        memcpy(s->components + s->blocks[b].first_component, s->blocks[b].components,
               s->blocks[b].component_count * sizeof *s->components);
    int rc = spl_orient_join_init(&join, s->components, components, s->points->spill, err);
    for (size_t b = 0; !rc && b < s->block_count; b++)
        for (size_t d = 0; !rc && d < s->blocks[b].unsettled.count; d++) {
            if (d % 256 == 0)
                spl_spill_keep_bound(s->points->spill);
            rc = add_edges(s, b, d, &join, err);
        }
    rc = rc ? rc : spl_orient_join_decide(&join, err);
    spl_orient_join_finish(&join);
    return rc ? rc : turn_shells(s, components, err);
}

static void flip_block(void *context, size_t begin, size_t end, unsigned worker)
{
    struct surface *s = context;
    (void)worker;
    for (size_t i = begin; i < end; i++)
        if (component_of(s, i)->flip)
            for (int c = 0; c < 3; c++)
                s->points->normal[i][c] = -s->points->normal[i][c];
}

static void set_lines(void *context, size_t begin, size_t end, unsigned worker)
{
    struct surface *s = context;
    (void)worker;
    for (size_t b = begin; b < end; b++)
        spl_clip_set_foreseen(s->points, &s->turns, s->blocks[b].lines, s->blocks[b].line_count);
}

static void settle_rest(void *context, size_t begin, size_t end, unsigned worker)
{
    struct surface *s = context;
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

static bool all_sides_known(const struct spl_points *p)
{
    for (size_t i = 0; i < p->count; i++) {
        bool given = p->normal[i][0] != 0 || p->normal[i][1] != 0 || p->normal[i][2] != 0;
        if (!given && !(p->station && p->station[i] != SPL_NO_STATION))
            return false;
    }
    return true;
}

static int allocate(struct surface *s, struct spl_error *err)
{
    struct spl_points *p = s->points;
    if (!p->radius)
        p->radius = spl_spill_alloc(p->spill, p->count, sizeof *p->radius, err);
    p->uncertainty = spl_spill_alloc_raw(p->spill, p->count, sizeof *p->uncertainty, err);
    if (!p->normal)
        p->normal = spl_spill_alloc(p->spill, p->count + SPL_POINTS_PAD, sizeof *p->normal, err);
    if (!p->radius || !p->uncertainty || !p->normal)
        return SPL_E_NOMEM;
    s->block_count = (p->count + block_points - 1) / block_points;
    s->blocks = spl_alloc(s->block_count, sizeof *s->blocks, err);
    s->scratch = spl_alloc(s->stage->threads, sizeof *s->scratch, err);
    if (!s->blocks || !s->scratch)
        return SPL_E_NOMEM;
    size_t capacity = p->count < block_points ? p->count : block_points;
    for (unsigned t = 0; t < s->stage->threads; t++) {
        s->scratch[t].neighbours = spl_alloc_raw(capacity, s->k * sizeof(uint32_t), err);
        s->scratch[t].limit = spl_alloc_raw(capacity, sizeof(float), err);
        s->scratch[t].moments = spl_alloc_raw(capacity, sizeof *s->scratch[t].moments, err);
        s->scratch[t].lines = spl_alloc_raw(capacity, sizeof *s->scratch[t].lines, err);
        if (!s->scratch[t].neighbours || !s->scratch[t].limit || !s->scratch[t].moments || !s->scratch[t].lines ||
            spl_orient_init(&s->scratch[t].orient, capacity, s->k, err))
            return SPL_E_NOMEM;
    }
    if (!all_sides_known(p)) {
        s->label = spl_spill_alloc_raw(p->spill, p->count, sizeof *s->label, err);
        s->goes_on = spl_spill_alloc(p->spill, p->count / 8 + 1, 1, err);
        if (!s->label || !s->goes_on)
            return SPL_E_NOMEM;
    }
    s->neighbours = spl_neighbours_create(p, s->stage->threads, err);
    if (!s->neighbours)
        return SPL_E_NOMEM;
    if (s->label && p->count > 1) {
        float usual = find_usual_reach(p, s->neighbours, s->k);
        for (unsigned t = 0; t < s->stage->threads; t++)
            s->scratch[t].orient.usual = usual;
    }
    return SPL_OK;
}

/* What clip lines are not made of. */
static void finish_scratch(struct surface *s)
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

static void finish(struct surface *s)
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
    struct surface s = {.points = points, .stage = stage, .k = neighbours};
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
    if (s.label) {
        rc = join_blocks(&s, err);
        if (rc)
            goto done;
        spl_parallel_for(stage->threads, points->count, block_points, flip_block, &s);
    }
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
