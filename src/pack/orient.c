/* Signs of normals by the votes of neighbours.
 *
 * Two neighbouring normals agree in sign when one, mirrored in the plane between the points, resembles the other: that
 * is right on a plane and around a corner alike, where the plain scalar product is a coin toss. It says little of
 * points that lie one behind the other, in the noise of a surface or on both sides of a thin wall: such edges count
 * little.
 *
 * Where most edges of a point are certain it lies on a surface, and such points hold together. That leaves pieces, and
 * each joins the one that it has most votes with, all edges between the two together; then votes are counted again,
 * until no two pieces touch. So two halves of a road are not joined by way of the bush that stands on both. Votes are
 * integers: what comes of them depends on nothing but the points. Blocks are done in parallel, then their pieces are
 * joined in the same way. */
#include "pack/orient.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "base/memory.h"

static const float certain = 0.8f; /* agreement of an edge */
#define ORIENT_VOTE (1 << 20)      /* of an edge whose normals agree */

/* Trees of points, or of pieces: all that know their signs relative to each other. */
struct forest {
    uint32_t *parent;
    uint8_t *flip;     /* sign relative to the parent */
    uint8_t *anchored; /* of roots: the tree is never turned */
    uint32_t *best;    /* scratch: the edge of each root that has most votes; counts of a sort */
    uint32_t count;    /* of all of these */
};

int spl_orient_init(struct spl_orient *orient, size_t capacity, unsigned k, struct spl_error *err)
{
    orient->parent = spl_alloc_raw(capacity, sizeof *orient->parent, err);
    orient->flip = spl_alloc_raw(capacity, sizeof *orient->flip, err);
    orient->label = spl_alloc_raw(capacity, sizeof *orient->label, err);
    orient->anchored = spl_alloc_raw(capacity, sizeof *orient->anchored, err);
    orient->edges = spl_alloc_raw(2 * capacity * k, sizeof *orient->edges, err);
    return orient->parent && orient->flip && orient->label && orient->anchored && orient->edges ? 0 : SPL_E_NOMEM;
}

void spl_orient_finish(struct spl_orient *orient)
{
    free(orient->parent);
    free(orient->flip);
    free(orient->label);
    free(orient->anchored);
    free(orient->edges);
}

float spl_orient_agreement(const struct spl_points *points, size_t i, size_t j)
{
    const float *a = points->normal[i], *b = points->normal[j];
    float e[3], ee = 0, ea = 0, eb = 0, ab = 0;
    for (int c = 0; c < 3; c++) {
        e[c] = (float)(points->axis[c][j] - points->axis[c][i]);
        ee += e[c] * e[c];
        ea += e[c] * a[c];
        eb += e[c] * b[c];
        ab += a[c] * b[c];
    }
    float behind = ee > 0 ? ea * eb / ee : 0;
    return (ab - 2 * behind) * (1 - fabsf(behind));
}

size_t spl_orient_add_edge(struct spl_orient_edge *edges, size_t count, uint32_t a, uint32_t b, float agreement)
{
    struct spl_orient_edge edge = {a < b ? a : b, a < b ? b : a, lrintf(agreement * ORIENT_VOTE)};
    if (count > 0 && edges[count - 1].a == edge.a && edges[count - 1].b == edge.b)
        edges[count - 1].votes += edge.votes;
    else
        edges[count++] = edge;
    return count;
}

/* The root of `i`, with the sign of i relative to it; halves the path. */
static uint32_t find_root(struct forest *f, uint32_t i, uint8_t *sign)
{
    uint8_t s = 0;
    while (f->parent[i] != i) {
        uint32_t up = f->parent[i];
        if (f->parent[up] != up) {
            f->flip[i] ^= f->flip[up];
            f->parent[i] = f->parent[up];
        }
        s ^= f->flip[i];
        i = f->parent[i];
    }
    *sign = s;
    return i;
}

/* Joins the trees of a and b; the smaller root stays, so that roots precede their trees. Anchored trees keep their
 * sign, so two of them never join. */
static void join(struct forest *f, uint32_t a, uint32_t b, bool opposed)
{
    uint8_t sa, sb;
    uint32_t ra = find_root(f, a, &sa), rb = find_root(f, b, &sb);
    if (ra == rb || (f->anchored[ra] && f->anchored[rb]))
        return;
    if (ra < rb ? f->anchored[rb] : !f->anchored[ra]) {
        uint32_t r = ra;
        ra = rb;
        rb = r;
    }
    f->parent[rb] = ra;
    f->flip[rb] = sa ^ sb ^ opposed;
}

/* A stable counting sort by one of the ends. */
static void sort_by(struct forest *f, const struct spl_orient_edge *from, struct spl_orient_edge *to, size_t count,
                    bool second)
{
    uint32_t *place = f->best, sum = 0;
    memset(place, 0, f->count * sizeof *place);
    for (size_t e = 0; e < count; e++)
        place[second ? from[e].b : from[e].a]++;
    for (uint32_t i = 0; i < f->count; i++) {
        uint32_t here = place[i];
        place[i] = sum;
        sum += here;
    }
    for (size_t e = 0; e < count; e++)
        to[place[second ? from[e].b : from[e].a]++] = from[e];
}

/* Moves the edges to the roots of their ends, one for all of the same two, and leaves out those that can't join.
 * `spare` has room for as many. */
static size_t unite(struct forest *f, struct spl_orient_edge *edges, struct spl_orient_edge *spare, size_t count)
{
    size_t moved = 0, kept = 0;
    for (size_t i = 0; i < count; i++) {
        uint8_t sa, sb;
        uint32_t a = find_root(f, edges[i].a, &sa), b = find_root(f, edges[i].b, &sb);
        if (a == b || (f->anchored[a] && f->anchored[b]))
            continue;
        edges[moved++] =
            (struct spl_orient_edge){a < b ? a : b, a < b ? b : a, sa == sb ? edges[i].votes : -edges[i].votes};
    }
    sort_by(f, edges, spare, moved, true);
    sort_by(f, spare, edges, moved, false);
    for (size_t i = 0; i < moved; i++) {
        if (kept > 0 && edges[kept - 1].a == edges[i].a && edges[kept - 1].b == edges[i].b)
            edges[kept - 1].votes += edges[i].votes;
        else
            edges[kept++] = edges[i];
    }
    return kept;
}

static void take_best(struct forest *f, const struct spl_orient_edge *edges, uint32_t root, size_t edge)
{
    if (f->best[root] == UINT32_MAX || llabs(edges[edge].votes) > llabs(edges[f->best[root]].votes))
        f->best[root] = (uint32_t)edge;
}

/* Joins all that touches, as the head of this file says. Each round joins at least the two whose edge is the first of
 * those with most votes, and mostly halves the number of trees. */
static void vote(struct forest *f, struct spl_orient_edge *edges, struct spl_orient_edge *spare, size_t count)
{
    while ((count = unite(f, edges, spare, count)) > 0) {
        for (size_t e = 0; e < count; e++)
            f->best[edges[e].a] = f->best[edges[e].b] = UINT32_MAX;
        for (size_t e = 0; e < count; e++) {
            take_best(f, edges, edges[e].a, e);
            take_best(f, edges, edges[e].b, e);
        }
        for (size_t e = 0; e < count; e++)
            if (f->best[edges[e].a] == e || f->best[edges[e].b] == e)
                join(f, edges[e].a, edges[e].b, edges[e].votes < 0);
    }
}

/* A block's points and their neighbours in it. */
struct graph {
    const struct spl_points *points;
    size_t begin;
    uint32_t count;
    const uint32_t *neighbours;
    unsigned k;
};

/* The a-th neighbour of i, both counted from the block's first; false when it lies in another block. */
static bool get_neighbour(const struct graph *g, uint32_t i, unsigned a, uint32_t *j)
{
    size_t index = g->neighbours[(size_t)i * g->k + a];
    *j = (uint32_t)(index - g->begin);
    return index >= g->begin && index - g->begin < g->count;
}

static bool lies_on_surface(const struct graph *g, uint32_t i)
{
    unsigned edges = 0, agreed = 0;
    for (unsigned a = 0; a < g->k; a++) {
        uint32_t j;
        if (!get_neighbour(g, i, a, &j))
            continue;
        edges++;
        agreed += fabsf(spl_orient_agreement(g->points, g->begin + i, g->begin + j)) >= certain;
    }
    return 2 * agreed > edges;
}

/* Joins what lies on surfaces; `surface` says of each point whether it does. */
static void join_surfaces(const struct graph *g, struct forest *f, const uint32_t *surface)
{
    for (uint32_t i = 0; i < g->count; i++)
        for (unsigned a = 0; surface[i] && a < g->k; a++) {
            uint32_t j;
            uint8_t sign;
            if (!get_neighbour(g, i, a, &j) || !surface[j] || find_root(f, i, &sign) == find_root(f, j, &sign))
                continue;
            float agreement = spl_orient_agreement(g->points, g->begin + i, g->begin + j);
            if (fabsf(agreement) >= certain)
                join(f, i, j, agreement < 0);
        }
}

/* The edges between different trees. */
static size_t find_edges(const struct graph *g, struct forest *f, struct spl_orient_edge *edges)
{
    size_t count = 0;
    for (uint32_t i = 0; i < g->count; i++)
        for (unsigned a = 0; a < g->k; a++) {
            uint32_t j;
            uint8_t sign;
            if (get_neighbour(g, i, a, &j) && find_root(f, i, &sign) != find_root(f, j, &sign))
                count = spl_orient_add_edge(edges, count, i, j,
                                            spl_orient_agreement(g->points, g->begin + i, g->begin + j));
        }
    return count;
}

uint32_t spl_orient_block(struct spl_orient *orient, struct spl_points *points, size_t begin, size_t end,
                          const uint32_t *neighbours, unsigned k)
{
    uint32_t n = (uint32_t)(end - begin), components = 0, first_anchored = UINT32_MAX;
    const struct graph graph = {points, begin, n, neighbours, k};
    struct forest forest = {orient->parent, orient->flip, orient->anchored, orient->label, n};
    for (uint32_t i = 0; i < n; i++) {
        if (orient->anchored[i] && first_anchored == UINT32_MAX)
            first_anchored = i;
        orient->parent[i] = orient->anchored[i] ? first_anchored : i;
        orient->flip[i] = 0;
        orient->label[i] = lies_on_surface(&graph, i);
    }
    join_surfaces(&graph, &forest, orient->label);
    vote(&forest, orient->edges, orient->edges + (size_t)n * k, find_edges(&graph, &forest, orient->edges));
    for (uint32_t i = 0; i < n; i++) {
        uint8_t sign;
        orient->label[i] = find_root(&forest, i, &sign);
        for (int c = 0; sign && c < 3; c++)
            points->normal[begin + i][c] = -points->normal[begin + i][c];
    }
    /* Roots are numbered where they stand; parent is free to hold the numbers now. */
    for (uint32_t i = 0; i < n; i++)
        if (orient->label[i] == i)
            orient->parent[i] = components++;
    for (uint32_t i = 0; i < n; i++)
        orient->label[i] = orient->parent[orient->label[i]];
    return components;
}

int spl_orient_components(struct spl_component *components, size_t count, struct spl_orient_edge *edges,
                          size_t edge_count, struct spl_spill *spill, struct spl_error *err)
{
    struct forest forest = {spl_alloc_raw(count, sizeof *forest.parent, err), spl_alloc(count, 1, err),
                            spl_alloc_raw(count, 1, err), spl_alloc_raw(count, sizeof *forest.best, err),
                            (uint32_t)count};
    struct spl_orient_edge *spare = spl_spill_alloc_raw(spill, edge_count, sizeof *spare, err);
    double *outward = spl_alloc(count, sizeof *outward, err);
    bool enough = forest.parent && forest.flip && forest.anchored && forest.best && spare && outward;
    for (size_t i = 0; enough && i < count; i++) {
        forest.parent[i] = (uint32_t)i;
        forest.anchored[i] = components[i].anchored;
    }
    if (enough)
        vote(&forest, edges, spare, edge_count);
    for (size_t i = 0; enough && i < count; i++) {
        uint8_t sign;
        uint32_t root = find_root(&forest, (uint32_t)i, &sign);
        outward[root] += sign ? -components[i].outward : components[i].outward;
    }
    for (size_t i = 0; enough && i < count; i++) {
        uint8_t sign;
        uint32_t root = find_root(&forest, (uint32_t)i, &sign);
        components[i].flip = sign ^ (!forest.anchored[root] && outward[root] < 0);
    }
    free(forest.parent);
    free(forest.flip);
    free(forest.anchored);
    free(forest.best);
    spl_spill_free(spill, spare);
    free(outward);
    return enough ? SPL_OK : SPL_E_NOMEM;
}
