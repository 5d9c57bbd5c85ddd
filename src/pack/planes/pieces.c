/* Pieces of patches that bend, the largest patch first. Whether one goes on where the other ends is asked between the
 * two, where both quadratics say how high the surface is and how it is tilted: a step or a kink shows there. On the
 * calling thread, in an order that depends on the patches alone, as regions.c. */
#include <stdlib.h>
#include <string.h>

#include "base/array.h"
#include "base/memory.h"
#include "pack/planes/quadratic.h"
#include "pack/planes/regions.h"

enum { checked = 255 };
static const double tilted = 0.76;  /* cosine of a patch's normal and the piece's */
static const double unbroken = 0.9; /* cosine of two patches' normals between them */
static const double beside = 1.25;  /* times both half widths, is how far apart two patches lie at most */
static const double half_width = 2; /* sigmas */
static const double alike = 2.5;    /* spacings of a piece's patches differ by no more, either way from the first */
static const uint32_t no_region = UINT32_MAX;

struct order {
    double points;
    uint32_t patch;
};

struct search {
    const struct spl_patches *patches;
    const struct spl_patch_graph *graph;
    const struct spl_points *points;
    const struct spl_plane_limits_list *limits;
    uint32_t *piece; /* of each patch */
    uint32_t *queue;
};

static double dot(const double a[3], const double b[3])
{
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
}

static double half_width_of(const struct spl_patch *p)
{
    return p->curve.scale / 1.7320508 * half_width;
}

/* The place of the patch's surface over or under `at`, and its normal there. */
static void extend(const struct spl_patch *p, const double at[3], double place[3], double normal[3])
{
    const struct spl_curve *k = &p->curve;
    double off[3], slope[2];
    for (int c = 0; c < 3; c++)
        off[c] = (at[c] - k->origin[c]) / k->scale;
    double x = dot(off, k->u), y = dot(off, k->v), height = spl_quadratic_height(k->q, x, y);
    spl_quadratic_slope(k->q, x, y, slope);
    double length = sqrt(1 + slope[0] * slope[0] + slope[1] * slope[1]);
    for (int c = 0; c < 3; c++) {
        place[c] = k->origin[c] + k->scale * (x * k->u[c] + y * k->v[c] + height * k->normal[c]);
        normal[c] = (k->normal[c] - slope[0] * k->u[c] - slope[1] * k->v[c]) / length;
    }
}

static bool goes_on(const struct search *s, const struct spl_patch *a, const struct spl_patch *b)
{
    double wide[2] = {half_width_of(a), half_width_of(b)}, apart = 0, middle[3], place[2][3], normal[2][3], step = 0;
    for (int c = 0; c < 3; c++) {
        double d = b->moments.mean[c] - a->moments.mean[c];
        apart += d * d;
        middle[c] = a->moments.mean[c] + d * wide[0] / (wide[0] + wide[1]);
    }
    if (sqrt(apart) > beside * (wide[0] + wide[1]))
        return false;
    extend(a, middle, place[0], normal[0]);
    extend(b, middle, place[1], normal[1]);
    for (int c = 0; c < 3; c++)
        step += (place[1][c] - place[0][c]) * (normal[0][c] + normal[1][c]) / 2;
    double limit = 2 * spl_plane_limits_at(s->limits, b->first)->step +
                   2 * (a->rms / sqrt(a->moments.count) + b->rms / sqrt(b->moments.count));
    return dot(normal[0], normal[1]) >= unbroken && fabs(step) <= limit;
}

static double spacing_of(const struct search *s, const struct spl_patch *p)
{
    return (double)s->points->radius[p->first];
}

static void grow(const struct search *s, uint32_t seed, uint32_t number, struct spl_region *r)
{
    const struct spl_patch *patches = s->patches->list;
    const double spacing = spacing_of(s, &patches[seed]);
    double sum[3];
    uint32_t count = 0;
    *r = (struct spl_region){.moments = patches[seed].moments};
    memcpy(r->normal, patches[seed].normal, sizeof r->normal);
    for (int c = 0; c < 3; c++)
        sum[c] = r->normal[c] * r->moments.count;
    s->queue[count++] = seed;
    s->piece[seed] = number;
    for (uint32_t k = 0; k < count; k++)
        for (size_t n = s->graph->first[s->queue[k]]; n < s->graph->first[s->queue[k] + 1]; n++) {
            uint32_t next = s->graph->neighbour[n];
            const struct spl_patch *q = &patches[next];
            double ratio = spacing_of(s, q) / spacing;
            if (s->piece[next] != no_region || dot(q->normal, r->normal) < tilted || ratio > alike ||
                ratio < 1 / alike || !goes_on(s, &patches[s->queue[k]], q))
                continue;
            s->piece[next] = number;
            s->queue[count++] = next;
            spl_plane_moments_add(&r->moments, &q->moments);
            for (int c = 0; c < 3; c++)
                sum[c] += q->normal[c] * q->moments.count;
            double length = sqrt(dot(sum, sum));
            for (int c = 0; c < 3; c++)
                r->normal[c] = sum[c] / length;
        }
}

static int compare(const void *a, const void *b)
{
    const struct order *x = a, *y = b;
    if (x->points != y->points)
        return x->points > y->points ? -1 : 1;
    return x->patch < y->patch ? -1 : x->patch > y->patch;
}

int spl_pieces_find(struct spl_regions *pieces, uint32_t *piece, const struct spl_patches *patches,
                    const struct spl_patch_graph *graph, const struct spl_points *points,
                    const struct spl_plane_limits_list *limits, const struct spl_stage *stage, struct spl_error *err)
{
    size_t capacity = 0, count = patches->count;
    *pieces = (struct spl_regions){0};
    struct order *order = spl_alloc_raw(count, sizeof *order, err);
    struct search s = {patches, graph, points, limits, piece, spl_alloc_raw(count, sizeof *s.queue, err)};
    int rc = order && s.queue ? 0 : SPL_E_NOMEM;
    for (size_t i = 0; !rc && i < count; i++) {
        order[i] = (struct order){patches->list[i].moments.count, (uint32_t)i};
        piece[i] = no_region;
    }
    if (!rc)
        qsort(order, count, sizeof *order, compare);
    for (size_t i = 0; !rc && i < count; i++) {
        if (piece[order[i].patch] != no_region)
            continue;
        rc = spl_array_reserve(pieces->list, capacity, (size_t)pieces->count + 1, err);
        if (!rc && (i & checked) == 0)
            rc = spl_stage_check(stage, err);
        if (rc)
            break;
        grow(&s, order[i].patch, pieces->count, &pieces->list[pieces->count]);
        pieces->count++;
    }
    free(order);
    free(s.queue);
    return rc;
}
