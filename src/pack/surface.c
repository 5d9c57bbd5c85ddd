/* What each point's surroundings say: normal, radius (soft-transparency paper, eq. 20), uncertainty (eq. 21).
 *
 * Blocks of sorted points are done in parallel, each in one go: neighbours, normals, radii, signs within the block. The
 * neighbour lists live as long as their block; only points with a neighbour in another block keep theirs, a few percent,
 * until the signs between blocks are settled. Blocks do not depend on the number of threads, so neither does the result.
 *
 * The radius is eq. 20 with the square that its unit asks for, r = 2 sqrt(max |pi - pj|^2 / K): right amid a surface.
 * Elsewhere it would make blobs, so the neighbours' spread (sigma_0 <= sigma_1 <= sigma_2, from the normal's PCA) and the
 * surroundings limit it:
 * - along a line (a wire) the share of a point is a length: the disc reaches over the next point;
 * - in a volume (foliage) a disc does not stand for the surface between its neighbours: half of it, as spread grows round.
 *   A noisy surface looks like one too: the neighbours' neighbours tell, and give the normal where they show a surface;
 * - no radius exceeds a small multiple of the median of its neighbours' radii (a stray point beside a surface), nor of the
 *   median of the few thousand points around it (a flock of strays): a smaller multiple where there is no surface.
 * Scan lines are often denser than they are apart, or come in bundles: then the neighbours lie along a line, or all on one
 * side. Where they leave a wide angle of a surface empty, more are asked. The radius then reaches to the nearest point in each
 * direction that has one, and counts the rest as a border: neighbours that fill half a disc are that much closer.
 */
#include "pack/points.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "base/memory.h"
#include "base/parallel.h"
#include "geom/eigen.h"
#include "pack/neighbours.h"
#include "pack/orient.h"

enum { block_points = 1 << 16 };
static const float lone_radius = 0.01f;       /* of a point without any other, metres */
static const float smallest_radius = 1e-9f;   /* keeps squares and quotients of floats in range */
static const float stray_limit = 2.5f;        /* times the median radius of the neighbours */
static const float flat_limit = 4, round_limit = 2; /* times the median radius of the run of points around */
enum { run_points = 4096, run_sample = 256, wide_factor = 3 };
static const double linear_below = 0.15;      /* sigma_1 / sigma_2 */
static const double coplanar = 0.25;          /* slope within which a far point continues a surface */
static const double round_from = 0.25, round_to = 0.75; /* sigma_0 / sigma_1 where a surface ends and a volume begins */

struct deferred {            /* a point with a neighbour in another block */
    uint32_t point;
    float limit;             /* of its radius */
    float radius, uncertainty;
};

struct block {
    struct deferred *deferred;
    uint32_t *neighbours;    /* k a deferred point */
    size_t deferred_count;
    struct spl_component *components;
    uint32_t component_count, first_component;
};

/* What a point's neighbours sum up to, relative to the point. */
struct moments {
    float count, sum[3], square[6]; /* xx xy xz yy yz zz; the point itself counts and adds nothing */
};

struct scratch {             /* of one worker */
    struct moments *moments; /* of each point of the block */
    uint32_t *neighbours;    /* k a point, unused ones UINT32_MAX */
    float *limit;            /* of each point, in turn: its farthest neighbour's distance, the factor of its run's median
                                radius, that times the median, its settled radius */
    struct spl_orient orient;
};

struct surface {
    struct spl_points *points;
    struct spl_neighbours *neighbours;
    struct spl_stage *stage;
    struct scratch *scratch;
    struct block *blocks;
    size_t block_count;
    uint32_t *label;         /* component of each point within its block; NULL when every side is known */
    struct spl_component *components;
    unsigned k, wide;
    atomic_bool failed;
};

static const int row[6] = {0, 0, 0, 1, 1, 2}, column[6] = {0, 1, 2, 1, 2, 2};

static struct moments moments_of(const struct spl_points *p, size_t i, const struct spl_nearest *near)
{
    double sum[3] = {0}, m[6] = {0};
    for (unsigned a = 0; a < near->count; a++) {
        uint32_t j = near->index[a];
        double d[3] = {p->axis[0][j] - p->axis[0][i], p->axis[1][j] - p->axis[1][i], p->axis[2][j] - p->axis[2][i]};
        for (int c = 0; c < 3; c++)
            sum[c] += d[c];
        m[0] += d[0] * d[0];
        m[1] += d[0] * d[1];
        m[2] += d[0] * d[2];
        m[3] += d[1] * d[1];
        m[4] += d[1] * d[2];
        m[5] += d[2] * d[2];
    }
    struct moments moments = {.count = (float)near->count + 1};
    for (int c = 0; c < 3; c++)
        moments.sum[c] = (float)sum[c];
    for (int e = 0; e < 6; e++)
        moments.square[e] = (float)m[e];
    return moments;
}

/* The moments of point i and of its neighbours within the block together, about point i: a wider view at little cost. */
static struct moments widen(const struct surface *s, const struct scratch *w, size_t begin, size_t end, size_t i)
{
    const struct spl_points *p = s->points;
    const uint32_t *list = w->neighbours + (i - begin) * s->k;
    struct moments wide = w->moments[i - begin];
    for (unsigned a = 0; a < s->k && list[a] != UINT32_MAX; a++) {
        size_t j = list[a];
        if (j < begin || j >= end)
            continue;
        const struct moments *m = &w->moments[j - begin];
        float d[3];
        for (int c = 0; c < 3; c++) {
            d[c] = (float)(p->axis[c][j] - p->axis[c][i]);
            wide.sum[c] += m->sum[c] + m->count * d[c];
        }
        for (int e = 0; e < 6; e++)
            wide.square[e] += m->square[e] + d[row[e]] * m->sum[column[e]] + m->sum[row[e]] * d[column[e]] +
                              m->count * d[row[e]] * d[column[e]];
        wide.count += m->count;
    }
    return wide;
}

/* How the points around one are spread. */
struct spread {
    double sigma[3];         /* ascending */
    double normal[3], along[3]; /* of the least and of the largest sigma */
};

static struct spread spread_of(const struct moments *moments)
{
    double m[6], n = moments->count;
    struct spread spread;
    for (int e = 0; e < 6; e++)
        m[e] = moments->square[e] / n - (double)moments->sum[row[e]] * moments->sum[column[e]] / (n * n);
    spl_eigen_symmetric(m, spread.sigma, spread.normal, spread.along);
    for (int c = 0; c < 3; c++)
        spread.sigma[c] = sqrt(fmax(0, spread.sigma[c]));
    return spread;
}

/* Squared distance to the nearest of `count` points in each eighth of the plane across `normal`; infinity where none is.
 * Points that stand out of the plane by more than `slope` of their distance do not count. */
static void eighths(const struct spl_points *p, size_t i, const uint32_t *neighbours, unsigned count,
                    const double normal[3], double slope, double nearest[8])
{
    /* any two axes across the normal, of equal length */
    int least = fabs(normal[0]) < fabs(normal[1]) ? 0 : 1;
    least = fabs(normal[2]) < fabs(normal[least]) ? 2 : least;
    int b = (least + 1) % 3, c = (least + 2) % 3;
    double x[3], y[3];
    x[least] = 0, x[b] = normal[c], x[c] = -normal[b];
    y[least] = normal[b] * x[c] - normal[c] * x[b], y[b] = normal[c] * x[least] - normal[least] * x[c];
    y[c] = normal[least] * x[b] - normal[b] * x[least];
    for (int e = 0; e < 8; e++)
        nearest[e] = INFINITY;
    for (unsigned a = 0; a < count && neighbours[a] != UINT32_MAX; a++) {
        uint32_t j = neighbours[a];
        double d[3] = {p->axis[0][j] - p->axis[0][i], p->axis[1][j] - p->axis[1][i], p->axis[2][j] - p->axis[2][i]};
        double u = d[0] * x[0] + d[1] * x[1] + d[2] * x[2], v = d[0] * y[0] + d[1] * y[1] + d[2] * y[2];
        double h = d[0] * normal[0] + d[1] * normal[1] + d[2] * normal[2];
        double squared = d[0] * d[0] + d[1] * d[1] + d[2] * d[2];
        if (h * h > slope * slope * squared)
            continue;
        static const uint8_t turn[8] = {4, 5, 3, 2, 7, 6, 0, 1}; /* counted around */
        uint8_t e = turn[(u > 0) * 4 + (v > 0) * 2 + (fabs(v) > fabs(u))];
        nearest[e] = squared < nearest[e] ? squared : nearest[e];
    }
}

/* What the eighths say of a point's place. */
struct place {
    double gap;    /* largest distance to the nearest point in a quarter of the plane, of quarters that hold any */
    double filled; /* share of the eighths that hold any */
    bool on_line;  /* two opposite quarters are empty */
    bool one_sided; /* three eighths in a row are empty */
};

static struct place place_of(const double nearest[8])
{
    struct place place = {0};
    double quarter[8];
    unsigned empty = 0;
    for (int e = 0; e < 8; e++) {
        quarter[e] = fmin(nearest[e], nearest[(e + 1) % 8]);
        if (quarter[e] < INFINITY)
            place.gap = fmax(place.gap, quarter[e]);
        place.filled += nearest[e] < INFINITY ? 0.125 : 0;
        empty |= (unsigned)!(nearest[e] < INFINITY) << e;
    }
    empty |= empty << 8;
    place.one_sided = empty & empty >> 1 & empty >> 2;
    for (int e = 0; e < 4; e++)
        place.on_line |= !(quarter[e] < INFINITY) && !(quarter[e + 4] < INFINITY);
    place.gap = sqrt(place.gap);
    return place;
}

/* 0 on a surface or a line, 1 in a volume. */
static double roundness(const struct spread *spread)
{
    if (spread->sigma[1] < linear_below * spread->sigma[2])
        return 0;
    double t = (spread->sigma[0] / spread->sigma[1] - round_from) / (round_to - round_from);
    t = fmin(1, fmax(0, t));
    return t * t * (3 - 2 * t);
}

/* Normal and radius of point i, which has `reach` to its farthest neighbour, and the roundness of its surroundings. */
static double radius_of(const struct surface *s, const struct scratch *w, size_t begin, size_t end, size_t i,
                        double reach, struct spl_nearest *near, double normal[3], double *round)
{
    const struct spl_points *p = s->points;
    const struct moments *moments = &w->moments[i - begin];
    struct spread spread = spread_of(moments);
    double n = moments->count - 1, radius = 2 * reach / sqrt(n), nearest[8];
    bool linear = spread.sigma[1] < linear_below * spread.sigma[2];
    memcpy(normal, spread.normal, sizeof spread.normal);
    *round = roundness(&spread);
    if (*round > 0) {
        struct moments around = widen(s, w, begin, end, i);
        struct spread wide = spread_of(&around);
        double wide_round = roundness(&wide);
        if (wide_round < *round) {
            memcpy(normal, wide.normal, sizeof wide.normal);
            *round = wide_round;
        }
    }
    double volume = *round * *round; /* squared twice: a rough surface is not to open up */
    radius *= 1 - 0.5 * volume * volume;
    eighths(p, i, w->neighbours + (i - begin) * s->k, s->k, normal, 1, nearest);
    struct place place = place_of(nearest);
    if (*round > 0.1 || !(linear || place.on_line || place.one_sided))
        return radius;

    spl_neighbours_find(s->neighbours, i, s->wide, near);
    if (linear) {
        struct moments around = moments_of(p, i, near);
        struct spread wide = spread_of(&around);
        bool surface = wide.sigma[1] >= linear_below * wide.sigma[2] && roundness(&wide) == 0;
        eighths(p, i, near->index, near->count, wide.normal, coplanar, nearest);
        if (!surface || place_of(nearest).on_line) /* a wire: its points are 2 reach / n apart */
            return fmin(radius, fmax(1.5 * reach / n, 2 * spread.sigma[1]));
        memcpy(normal, wide.normal, sizeof wide.normal);
    }
    eighths(p, i, near->index, near->count, normal, coplanar, nearest);
    place = place_of(nearest);
    return fmax(radius * sqrt(fmax(place.filled, 0.25)), fmin(0.55 * place.gap, 2 * radius));
}

/* Fills normal, radius and its factor to the run's median; true when the normal's side is known. */
static bool estimate(const struct surface *s, struct scratch *w, size_t begin, size_t end, size_t i,
                     struct spl_nearest *near)
{
    struct spl_points *p = s->points;
    double least[3], round, side = 1;
    double reach = w->limit[i - begin];
    p->radius[i] = fmaxf((float)radius_of(s, w, begin, end, i, reach, near, least, &round), smallest_radius);
    w->limit[i - begin] = flat_limit + (float)round * (round_limit - flat_limit);

    float *normal = p->normal[i];
    if (normal[0] != 0 || normal[1] != 0 || normal[2] != 0)
        return true;
    bool known = p->station && p->station[i] != SPL_NO_STATION;
    if (known) {
        const double *pose = p->stations[p->station[i]];
        side = 0;
        for (int c = 0; c < 3; c++)
            side += least[c] * (pose[4 * c + 3] - p->axis[c][i]);
    }
    for (int c = 0; c < 3; c++)
        normal[c] = (float)(side < 0 ? -least[c] : least[c]);
    return known;
}

static int compare_floats(const void *a, const void *b)
{
    float x = *(const float *)a, y = *(const float *)b;
    return x < y ? -1 : x > y;
}

/* Multiplies limit[] by the median radius of the run that each point belongs to. */
static void limit_runs(const struct spl_points *p, size_t begin, size_t end, float *limit)
{
    for (size_t run = begin; run < end; run += run_points) {
        size_t n = end - run < run_points ? end - run : run_points, sample = n < run_sample ? n : run_sample;
        float radii[run_sample];
        for (size_t i = 0; i < sample; i++)
            radii[i] = p->radius[run + i * n / sample];
        qsort(radii, sample, sizeof *radii, compare_floats);
        for (size_t i = run; i < run + n; i++)
            limit[i - begin] *= radii[sample / 2];
    }
}

/* Radius and uncertainty of point i once the normals around it agree in sign. */
static void settle(const struct spl_points *p, size_t i, const uint32_t *neighbours, unsigned k, float limit,
                   float *radius, float *uncertainty)
{
    float around[SPL_NEIGHBOURS_MAX];
    unsigned n = 0;
    double sum = 0;
    const float *a = p->normal[i];
    for (; n < k && neighbours[n] != UINT32_MAX; n++) {
        const float *b = p->normal[neighbours[n]];
        float r = p->radius[neighbours[n]], bend = 2 - (a[0] * b[0] + a[1] * b[1] + a[2] * b[2]);
        sum += bend * bend;
        unsigned at = n;
        for (; at > 0 && around[at - 1] > r; at--)
            around[at] = around[at - 1];
        around[at] = r;
    }
    *radius = fminf(p->radius[i], fminf(limit, stray_limit * around[n / 2]));
    *uncertainty = (float)(*radius * sum / n);
}

static bool keep_deferred(struct surface *s, struct block *block, size_t begin, size_t end, const struct scratch *w)
{
    unsigned k = s->k;
    const uint32_t *neighbours = w->neighbours;
    size_t count = 0, at = 0;
    for (int store = 0; store < 2; store++) {
        for (size_t i = 0; i < end - begin; i++) {
            const uint32_t *list = neighbours + i * k;
            bool outside = false;
            for (unsigned a = 0; a < k && list[a] != UINT32_MAX; a++)
                outside |= list[a] < begin || list[a] >= end;
            if (!outside)
                continue;
            if (store) {
                block->deferred[at].point = (uint32_t)(begin + i);
                block->deferred[at].limit = w->limit[i];
                memcpy(block->neighbours + at++ * k, list, k * sizeof *list);
            }
            count += !store;
        }
        if (!store) {
            block->deferred = spl_alloc_raw(count, sizeof *block->deferred, NULL);
            block->neighbours = spl_alloc_raw(count, k * sizeof *block->neighbours, NULL);
            block->deferred_count = count;
            if (!block->deferred || !block->neighbours)
                return false;
        }
    }
    return true;
}

/* Settles what lies wholly in the block; raw radii are read until all are settled, so results wait in w->limit. */
static void settle_inner(struct surface *s, const struct block *block, size_t begin, size_t end, struct scratch *w)
{
    struct spl_points *p = s->points;
    float *limit = w->limit;
    size_t next = 0;
    for (size_t i = begin; i < end; i++) {
        if (next < block->deferred_count && block->deferred[next].point == i) {
            next++;
            continue;
        }
        settle(p, i, w->neighbours + (i - begin) * s->k, s->k, limit[i - begin], &limit[i - begin], &p->uncertainty[i]);
    }
    next = 0;
    for (size_t i = begin; i < end; i++) {
        if (next < block->deferred_count && block->deferred[next].point == i)
            next++;
        else
            p->radius[i] = limit[i - begin];
    }
}

static bool orient_inner(struct surface *s, struct block *block, struct scratch *w, size_t begin, size_t end)
{
    struct spl_orient *o = &w->orient;
    block->component_count = spl_orient_block(o, s->points, begin, end, w->neighbours, s->k);
    block->components = spl_alloc(block->component_count, sizeof *block->components, NULL);
    if (!block->components)
        return false;
    for (size_t i = begin; i < end; i++) {
        struct spl_component *c = &block->components[o->label[i - begin]];
        c->up += s->points->normal[i][2];
        c->anchored |= o->anchored[i - begin];
        s->label[i] = o->label[i - begin];
    }
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
        spl_nearest_init(&near);
        for (size_t i = begin; i < end; i++) {
            spl_neighbours_find(s->neighbours, i, s->k, &near);
            uint32_t *list = w->neighbours + (i - begin) * s->k;
            for (unsigned a = 0; a < s->k; a++)
                list[a] = a < near.count ? near.index[a] : UINT32_MAX;
            w->moments[i - begin] = moments_of(s->points, i, &near);
            w->limit[i - begin] = (float)near.farthest;
            if ((i & 4095) == 4095)
                spl_stage_add(s->stage, 4096, worker);
        }
        spl_nearest_init(&near);
        for (size_t i = begin; i < end; i++)
            w->orient.anchored[i - begin] = estimate(s, w, begin, end, i, &near);
        limit_runs(s->points, begin, end, w->limit);
        if (!keep_deferred(s, &s->blocks[b], begin, end, w) ||
            (s->label && !orient_inner(s, &s->blocks[b], w, begin, end))) {
            atomic_store(&s->failed, true);
            return;
        }
        settle_inner(s, &s->blocks[b], begin, end, w);
    }
}

static int join_blocks(struct surface *s, struct spl_error *err)
{
    size_t components = 0, edges = 0, count = 0;
    for (size_t b = 0; b < s->block_count; b++) {
        s->blocks[b].first_component = (uint32_t)components;
        components += s->blocks[b].component_count;
        edges += s->blocks[b].deferred_count * s->k;
    }
    struct spl_orient_edge *edge = spl_alloc_raw(edges, sizeof *edge, err);
    s->components = spl_alloc_raw(components, sizeof *s->components, err);
    int rc = edge && s->components ? 0 : SPL_E_NOMEM;
    for (size_t b = 0; !rc && b < s->block_count; b++) {
        struct block *block = &s->blocks[b];
        memcpy(s->components + block->first_component, block->components,
               block->component_count * sizeof *block->components);
        for (size_t d = 0; d < block->deferred_count; d++) {
            uint32_t i = block->deferred[d].point;
            const uint32_t *list = block->neighbours + d * s->k;
            for (unsigned a = 0; a < s->k && list[a] != UINT32_MAX; a++)
                if (list[a] / block_points != b)
                    edge[count++] = (struct spl_orient_edge){
                        block->first_component + s->label[i],
                        s->blocks[list[a] / block_points].first_component + s->label[list[a]],
                        spl_orient_agreement(s->points, i, list[a])};
        }
    }
    if (!rc)
        rc = spl_orient_components(s->components, components, edge, count, err);
    free(edge);
    return rc;
}

static void flip_block(void *context, size_t begin, size_t end, unsigned worker)
{
    struct surface *s = context;
    (void)worker;
    for (size_t i = begin; i < end; i++)
        if (s->components[s->blocks[i / block_points].first_component + s->label[i]].flip)
            for (int c = 0; c < 3; c++)
                s->points->normal[i][c] = -s->points->normal[i][c];
}

static void settle_deferred(void *context, size_t begin, size_t end, unsigned worker)
{
    struct surface *s = context;
    (void)worker;
    for (size_t b = begin; b < end; b++)
        for (size_t d = 0; d < s->blocks[b].deferred_count; d++) {
            struct deferred *deferred = &s->blocks[b].deferred[d];
            settle(s->points, deferred->point, s->blocks[b].neighbours + d * s->k, s->k, deferred->limit,
                   &deferred->radius, &deferred->uncertainty);
        }
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
    p->radius = spl_alloc_raw(p->count, sizeof *p->radius, err);
    p->uncertainty = spl_alloc_raw(p->count, sizeof *p->uncertainty, err);
    if (!p->normal)
        p->normal = spl_alloc(p->count + SPL_POINTS_PAD, sizeof *p->normal, err);
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
        if (!s->scratch[t].neighbours || !s->scratch[t].limit || !s->scratch[t].moments ||
            spl_orient_init(&s->scratch[t].orient, capacity, err))
            return SPL_E_NOMEM;
    }
    if (!all_sides_known(p)) {
        s->label = spl_alloc_raw(p->count, sizeof *s->label, err);
        if (!s->label)
            return SPL_E_NOMEM;
    }
    s->neighbours = spl_neighbours_create(p, s->stage->threads, err);
    return s->neighbours ? 0 : SPL_E_NOMEM;
}

static void finish(struct surface *s)
{
    for (size_t b = 0; s->blocks && b < s->block_count; b++) {
        free(s->blocks[b].deferred);
        free(s->blocks[b].neighbours);
        free(s->blocks[b].components);
    }
    for (unsigned t = 0; s->scratch && t < s->stage->threads; t++) {
        free(s->scratch[t].neighbours);
        free(s->scratch[t].limit);
        free(s->scratch[t].moments);
        spl_orient_finish(&s->scratch[t].orient);
    }
    free(s->blocks);
    free(s->scratch);
    free(s->label);
    free(s->components);
    spl_neighbours_destroy(s->neighbours);
}

static void lone_point(struct spl_points *p)
{
    p->radius[0] = lone_radius;
    p->uncertainty[0] = lone_radius;
    if (p->normal[0][0] == 0 && p->normal[0][1] == 0 && p->normal[0][2] == 0)
        p->normal[0][2] = 1;
}

int spl_surface(struct spl_points *points, unsigned neighbours, struct spl_stage *stage, struct spl_error *err)
{
    struct surface s = {.points = points, .stage = stage, .k = neighbours};
    s.wide = wide_factor * neighbours < SPL_NEIGHBOURS_MAX ? wide_factor * neighbours : SPL_NEIGHBOURS_MAX;
    spl_stage_begin(stage, "normals and radii", points->count);
    int rc = allocate(&s, err);
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
    if (s.label) {
        rc = join_blocks(&s, err);
        if (rc)
            goto done;
        spl_parallel_for(stage->threads, points->count, block_points, flip_block, &s);
    }
    spl_parallel_for(stage->threads, s.block_count, 1, settle_deferred, &s);
    for (size_t b = 0; b < s.block_count; b++)
        for (size_t d = 0; d < s.blocks[b].deferred_count; d++) {
            points->radius[s.blocks[b].deferred[d].point] = s.blocks[b].deferred[d].radius;
            points->uncertainty[s.blocks[b].deferred[d].point] = s.blocks[b].deferred[d].uncertainty;
        }
    spl_stage_finish(stage);
done:
    finish(&s);
    return rc;
}
