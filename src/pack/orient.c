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
 * joined in the same way.
 *
 * Where nobody says what is seen, what is level mostly is ground or a roof, and shows upwards. A wall with ground on
 * both of its sides tells one of them to show downwards, and so does a bush half of the time. So level points and
 * others make pieces of their own, and where two trees join that hold large level pieces, "both up" has votes of its
 * own: a fraction of what the whole border of these would have. A ceiling hangs on its walls by all of its border, and
 * they still tell it to show down. */
#include "pack/orient.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "base/memory.h"
#include "pack/eyes.h"

#define SPL_INLINE static inline __attribute__((always_inline))

static const float certain = 0.8f; /* agreement of an edge */
static const double level = 0.8;   /* how far a normal shows up or down; a roof's, too */
enum { large = 1024 };             /* points of a level piece that counts */

int spl_orient_init(struct spl_orient *orient, size_t capacity, unsigned k, struct spl_error *err)
{
    orient->parent = spl_alloc_raw(capacity, sizeof *orient->parent, err);
    orient->flip = spl_alloc_raw(capacity, sizeof *orient->flip, err);
    orient->label = spl_alloc_raw(capacity, sizeof *orient->label, err);
    orient->anchored = spl_alloc_raw(capacity, sizeof *orient->anchored, err);
    orient->place = spl_alloc_raw(capacity, sizeof *orient->place, err);
    orient->level = spl_alloc_raw(capacity, sizeof *orient->level, err);
    orient->edges = spl_alloc_raw(2 * capacity * k, sizeof *orient->edges, err);
    bool enough = orient->parent && orient->flip && orient->label && orient->anchored && orient->place &&
                  orient->level && orient->edges;
    return enough ? 0 : SPL_E_NOMEM;
}

void spl_orient_finish(struct spl_orient *orient)
{
    free(orient->parent);
    free(orient->flip);
    free(orient->label);
    free(orient->anchored);
    free(orient->place);
    free(orient->level);
    free(orient->edges);
}

/* Points beside another: how far off, and their normals. Eight at once, however many there are. */
enum { eight = 8 };
typedef float spl_floats __attribute__((vector_size(eight * sizeof(float))));
typedef int32_t spl_marks __attribute__((vector_size(eight * sizeof(float))));
struct beside {
    spl_floats apart[3], normal[3];
    spl_marks counts; /* -1; 0: agrees by 0 */
};

SPL_INLINE void agree(const float a[3], const struct beside *b, spl_floats *agreement)
{
    const spl_floats *e = b->apart;
    spl_floats ee = e[0] * e[0] + e[1] * e[1] + e[2] * e[2], ea = e[0] * a[0] + e[1] * a[1] + e[2] * a[2];
    spl_floats eb = e[0] * b->normal[0] + e[1] * b->normal[1] + e[2] * b->normal[2];
    spl_floats ab = a[0] * b->normal[0] + a[1] * b->normal[1] + a[2] * b->normal[2];
    spl_floats behind = (spl_floats)((spl_marks)(ea * eb / ee) & (ee > 0));
    spl_floats size = (spl_floats)((spl_marks)behind & INT32_MAX);
    *agreement = (spl_floats)((spl_marks)((ab - 2 * behind) * (1 - size)) & b->counts);
}

float spl_orient_agreement(const struct spl_points *points, size_t i, size_t j)
{
    struct beside b = {.counts = {-1}};
    spl_floats agreement;
    double at[3], apart[3];
    spl_points_place(points, i, at);
    spl_points_apart(points, at, j, apart);
    for (int c = 0; c < 3; c++) {
        b.apart[c][0] = (float)apart[c];
        b.normal[c][0] = points->normal[j][c];
    }
    agree(points->normal[i], &b, &agreement);
    return agreement[0];
}

/* A block's points and their neighbours in it. */
struct graph {
    const struct spl_points *points;
    size_t begin;
    uint32_t count;
    const uint32_t *neighbours;
    float *agreement; /* with each of them; 0 of those in other blocks. Lies where edges are sorted to later */
    unsigned k;
};

/* The a-th neighbour of i, both counted from the block's first; false when it lies in another block. */
SPL_INLINE bool get_neighbour(const struct graph *g, uint32_t i, unsigned a, uint32_t *j)
{
    size_t index = g->neighbours[(size_t)i * g->k + a];
    *j = (uint32_t)(index - g->begin);
    return index >= g->begin && index - g->begin < g->count;
}

/* Fills in how normals agree, and in `surface` of each point whether it lies on one. */
SPL_INLINE void agree_all(const struct graph *g, uint32_t *surface)
{
    const unsigned rounded = (g->k + eight - 1) / eight * eight;
    for (uint32_t i = 0; i < g->count; i++) {
        float *agreement = g->agreement + (size_t)i * g->k;
        uint32_t index[SPL_NEIGHBOURS_MAX]; /* of those in other blocks, which may change meanwhile, the point's own */
        int32_t counts[SPL_NEIGHBOURS_MAX];
        unsigned edges = 0, agreed = 0;
        double at[3], apart[3][SPL_NEIGHBOURS_MAX];
        for (unsigned a = 0; a < rounded; a++) {
            uint32_t j = i;
            bool is_inside = a < g->k && get_neighbour(g, i, a, &j);
            index[a] = (uint32_t)g->begin + (is_inside ? j : i);
            counts[a] = is_inside ? -1 : 0;
            edges += is_inside;
        }
        spl_points_place(g->points, g->begin + i, at);
        spl_points_list_apart(g->points, at, index, rounded, apart);
        for (unsigned first = 0; first < rounded; first += eight) {
            struct beside beside;
            spl_floats agreements;
            float away[3][eight], normal[3][eight];
            for (unsigned a = 0; a < eight; a++)
                for (int c = 0; c < 3; c++) {
                    away[c][a] = (float)apart[c][first + a];
                    normal[c][a] = g->points->normal[index[first + a]][c];
                }
            memcpy(beside.apart, away, sizeof beside.apart);
            memcpy(beside.normal, normal, sizeof beside.normal);
            memcpy(&beside.counts, counts + first, sizeof beside.counts);
            agree(g->points->normal[g->begin + i], &beside, &agreements);
            spl_marks certainly = (agreements >= certain) | (agreements <= -certain);
            for (unsigned a = 0; a < eight && first + a < g->k; a++) {
                agreement[first + a] = agreements[a];
                agreed -= (unsigned)certainly[a];
            }
        }
        surface[i] = 2 * agreed > edges;
    }
}

#if defined(__x86_64__)
__attribute__((target("avx2"))) static void agree_all_avx2(const struct graph *g, uint32_t *surface)
{
    agree_all(g, surface);
}
#endif

/* Compiled twice; contraction is off, so both give the same bits. */
static void find_agreements(const struct graph *g, uint32_t *surface)
{
#if defined(__x86_64__)
    if (__builtin_cpu_supports("avx2")) {
        agree_all_avx2(g, surface);
        return;
    }
#endif
    agree_all(g, surface);
}

/* Fills in which way each point is level, if anybody cares, and has `surface` tell those that are from others. */
static void find_level(const struct graph *g, int64_t *levels, bool cares, uint32_t *surface)
{
    for (uint32_t i = 0; i < g->count; i++) {
        double outward = cares ? spl_eyes_get_outward(g->points, g->begin + i) : 0;
        levels[i] = (outward > level) - (outward < -level);
        if (surface[i] && levels[i])
            surface[i] = 2;
    }
}

/* Joins what lies on surfaces; `surface` says of each point on which kind it does, 0 = on none. */
static void join_surfaces(const struct graph *g, struct spl_forest *f, const uint32_t *surface)
{
    for (uint32_t i = 0; i < g->count; i++) {
        uint8_t sign;
        uint32_t root = surface[i] ? spl_forest_find_root(f, i, &sign) : i;
        for (unsigned a = 0; surface[i] && a < g->k; a++) {
            uint32_t j;
            float agreement = g->agreement[(size_t)i * g->k + a];
            if (fabsf(agreement) >= certain && get_neighbour(g, i, a, &j) && surface[j] == surface[i] &&
                f->parent[j] != root && spl_forest_find_root(f, j, &sign) != root) {
                spl_forest_join(f, i, j, agreement < 0);
                root = spl_forest_find_root(f, i, &sign);
            }
        }
    }
}

/* The edges between different trees, by their roots. */
static size_t find_edges(const struct graph *g, struct spl_forest *f, struct spl_forest_edge *edges)
{
    uint32_t *top = f->best; /* of each point: twice its root, and 1 where it has the other sign */
    size_t count = 0;
    for (uint32_t i = 0; i < g->count; i++) {
        uint8_t sign;
        top[i] = 2 * spl_forest_find_root(f, i, &sign);
        top[i] += sign;
    }
    for (uint32_t i = 0; i < g->count; i++)
        for (unsigned a = 0; a < g->k; a++) {
            uint32_t j;
            if (!get_neighbour(g, i, a, &j) || top[i] / 2 == top[j] / 2)
                continue;
            float agreement = g->agreement[(size_t)i * g->k + a];
            count = spl_forest_add_edge(edges, count, top[i] / 2, top[j] / 2,
                                        (top[i] ^ top[j]) & 1 ? -agreement : agreement);
        }
    return count;
}

uint32_t spl_orient_block(struct spl_orient *orient, struct spl_points *points, size_t begin, size_t end,
                          const uint32_t *neighbours, unsigned k)
{
    uint32_t n = (uint32_t)(end - begin), components = 0, first_anchored = UINT32_MAX;
    const struct graph graph = {points, begin, n, neighbours, (float *)(orient->edges + (size_t)n * k), k};
    struct spl_forest forest = {
        orient->parent, orient->flip, orient->anchored, orient->level, orient->label, orient->place, n};
    for (uint32_t i = 0; i < n; i++) {
        if (orient->anchored[i] && first_anchored == UINT32_MAX)
            first_anchored = i;
        orient->parent[i] = orient->anchored[i] ? first_anchored : i;
        orient->flip[i] = 0;
    }
    find_agreements(&graph, orient->label);
    find_level(&graph, orient->level, first_anchored == UINT32_MAX && !points->eye_count, orient->label);
    join_surfaces(&graph, &forest, orient->label);
    for (uint32_t i = 0; i < n; i++)
        if (orient->parent[i] != i || llabs(orient->level[i]) < large)
            orient->level[i] = 0;
    spl_forest_vote(&forest, orient->edges, orient->edges + (size_t)n * k, find_edges(&graph, &forest, orient->edges));
    for (uint32_t i = 0; i < n; i++) {
        uint8_t sign;
        orient->label[i] = spl_forest_find_root(&forest, i, &sign);
        for (int c = 0; sign && c < 3; c++)
            points->normal[begin + i][c] = -points->normal[begin + i][c];
    }
    /* Roots are numbered where they stand; parent is free to hold the numbers now. */
    for (uint32_t i = 0; i < n; i++)
        if (orient->label[i] == i) {
            orient->level[components] = orient->level[i];
            orient->parent[i] = components++;
        }
    for (uint32_t i = 0; i < n; i++)
        orient->label[i] = orient->parent[orient->label[i]];
    return components;
}

int spl_orient_components(struct spl_component *components, size_t count, struct spl_forest_edge *edges,
                          size_t edge_count, struct spl_spill *spill, struct spl_error *err)
{
    struct spl_forest forest = {spl_alloc_raw(count, sizeof *forest.parent, err),
                                spl_alloc(count, 1, err),
                                spl_alloc_raw(count, 1, err),
                                spl_alloc_raw(count, sizeof *forest.level, err),
                                spl_alloc(count, sizeof *forest.best, err),
                                spl_alloc_raw(count, sizeof *forest.place, err),
                                (uint32_t)count};
    struct spl_forest_edge *spare = spl_spill_alloc_raw(spill, edge_count, sizeof *spare, err);
    double *outward = spl_alloc(count, sizeof *outward, err);
    bool enough = forest.parent && forest.flip && forest.anchored && forest.level && forest.best && forest.place &&
                  spare && outward;
    for (size_t i = 0; enough && i < count; i++) {
        forest.parent[i] = (uint32_t)i;
        forest.anchored[i] = components[i].anchored;
        forest.level[i] = components[i].anchored ? 0 : components[i].level;
    }
    if (enough)
        spl_forest_vote(&forest, edges, spare, edge_count);
    for (size_t i = 0; enough && i < count; i++) {
        uint8_t sign;
        uint32_t root = spl_forest_find_root(&forest, (uint32_t)i, &sign);
        outward[root] += sign ? -components[i].outward : components[i].outward;
    }
    for (size_t i = 0; enough && i < count; i++) {
        uint8_t sign;
        uint32_t root = spl_forest_find_root(&forest, (uint32_t)i, &sign);
        components[i].flip = sign ^ (!forest.anchored[root] && outward[root] < 0);
    }
    free(forest.parent);
    free(forest.flip);
    free(forest.anchored);
    free(forest.level);
    free(forest.best);
    free(forest.place);
    spl_spill_free(spill, spare);
    free(outward);
    return enough ? SPL_OK : SPL_E_NOMEM;
}
