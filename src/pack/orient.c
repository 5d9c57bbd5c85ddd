/* Signs of normals by the votes of neighbours, within a block.
 *
 * Two neighbouring normals agree in sign when one, mirrored in the plane between the points, resembles the other: that
 * is right on a plane and around a corner alike, where the plain scalar product is a coin toss. It says little of
 * points that lie one behind the other, in the noise of a surface or on both sides of a thin wall: such edges count
 * little.
 *
 * Where most edges of a point are certain it lies on a surface, and such points hold together. That leaves pieces,
 * which join by votes (forest.c). A piece that goes on in other blocks has edges there that its block does not see:
 * others join it, but it joins none itself before all blocks are done (orient_join.c). So what a block decides by
 * itself would be decided in the same way among all of them, and where blocks end decides nothing.
 *
 * Level points and others make pieces of their own, since what is level has a say for up. A point that is far from
 * others stands for as many as would lie there usually: a far roof of a few hundred points is as large as it looks. */
#include "pack/orient.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "base/memory.h"
#include "pack/eyes.h"

#define SPL_INLINE static inline __attribute__((always_inline))

static const double area_most = 64; /* of a point, over that of usual ones, however far it is from others */
static const double level = 0.8;    /* how far a normal shows up or down; a roof's, too */

int spl_orient_init(struct spl_orient *orient, size_t capacity, unsigned k, struct spl_error *err)
{
    orient->parent = spl_alloc_raw(capacity, sizeof *orient->parent, err);
    orient->flip = spl_alloc_raw(capacity, sizeof *orient->flip, err);
    orient->label = spl_alloc_raw(capacity, sizeof *orient->label, err);
    orient->held = spl_alloc_raw(capacity, sizeof *orient->held, err);
    orient->kind = spl_alloc_raw(capacity, sizeof *orient->kind, err);
    orient->own = spl_alloc_raw(capacity, sizeof *orient->own, err);
    orient->reach = spl_alloc_raw(capacity, sizeof *orient->reach, err);
    orient->place = spl_alloc_raw(capacity, sizeof *orient->place, err);
    orient->level = spl_alloc_raw(capacity, sizeof *orient->level, err);
    orient->edges = spl_alloc_raw(2 * capacity * k, sizeof *orient->edges, err);
    bool enough = orient->parent && orient->flip && orient->label && orient->held && orient->kind && orient->own &&
                  orient->reach && orient->place && orient->level && orient->edges;
    return enough ? 0 : SPL_E_NOMEM;
}

void spl_orient_finish(struct spl_orient *orient)
{
    free(orient->parent);
    free(orient->flip);
    free(orient->label);
    free(orient->held);
    free(orient->kind);
    free(orient->own);
    free(orient->reach);
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
    const float *reach; /* how far the farthest of them is, squared */
    float *agreement;   /* with each of them; 0 of those in other blocks. Lies where edges are sorted to later */
    unsigned k;
};

/* The a-th neighbour of i, both counted from the block's first; false when it lies in another block. */
SPL_INLINE bool get_neighbour(const struct graph *g, uint32_t i, unsigned a, uint32_t *j)
{
    size_t index = g->neighbours[(size_t)i * g->k + a];
    *j = (uint32_t)(index - g->begin);
    return index >= g->begin && index - g->begin < g->count;
}

/* Fills in how normals agree, and the kind of each point: whether it lies on a surface. */
SPL_INLINE void agree_all(const struct graph *g, uint8_t *kind)
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
            spl_marks certainly = (agreements >= SPL_ORIENT_CERTAIN) | (agreements <= -SPL_ORIENT_CERTAIN);
            for (unsigned a = 0; a < eight && first + a < g->k; a++) {
                agreement[first + a] = agreements[a];
                agreed -= (unsigned)certainly[a];
            }
        }
        kind[i] = 2 * agreed > edges ? SPL_PIECE_SURFACE : SPL_PIECE_OTHER;
    }
}

#if defined(__x86_64__)
__attribute__((target("avx2"))) static void agree_all_avx2(const struct graph *g, uint8_t *kind)
{
    agree_all(g, kind);
}
#endif

/* Compiled twice; contraction is off, so both give the same bits. */
static void find_agreements(const struct graph *g, uint8_t *kind)
{
#if defined(__x86_64__)
    if (__builtin_cpu_supports("avx2")) {
        agree_all_avx2(g, kind);
        return;
    }
#endif
    agree_all(g, kind);
}

/* The area that a point stands for, over that of a usual one: what its neighbours lie in. */
static double get_area(const struct graph *g, float usual, uint32_t i)
{
    return fmin(g->reach[i] / (double)usual, area_most);
}

/* Fills in which way each point is level, if anybody cares, and how many usual points it stands for; has `kind` tell
 * those that are from others. */
static void find_level(const struct graph *g, float usual, int64_t *levels, bool cares, uint8_t *kind)
{
    for (uint32_t i = 0; i < g->count; i++) {
        double outward = cares ? spl_eyes_get_outward(g->points, g->begin + i) : 0;
        levels[i] = ((outward > level) - (outward < -level)) * llrint(fmax(get_area(g, usual, i), 1));
        if (kind[i] && levels[i])
            kind[i] = SPL_PIECE_LEVEL;
    }
}

/* Joins what lies on surfaces of the same kind. */
static void join_surfaces(const struct graph *g, struct spl_forest *f, const uint8_t *kind)
{
    for (uint32_t i = 0; i < g->count; i++) {
        uint8_t sign;
        uint32_t root = kind[i] ? spl_forest_find_root(f, i, &sign) : i;
        for (unsigned a = 0; kind[i] && a < g->k; a++) {
            uint32_t j;
            float agreement = g->agreement[(size_t)i * g->k + a];
            if (spl_orient_is_certain(agreement) && get_neighbour(g, i, a, &j) && kind[j] == kind[i] &&
                f->parent[j] != root && spl_forest_find_root(f, j, &sign) != root) {
                spl_forest_join(f, i, j, agreement < 0);
                root = spl_forest_find_root(f, i, &sign);
            }
        }
    }
}

static bool reaches_out(const struct graph *g, uint32_t i)
{
    const uint32_t *list = g->neighbours + (size_t)i * g->k, begin = (uint32_t)g->begin;
    unsigned outside = 0;
    for (unsigned a = 0; a < g->k; a++)
        outside |= (list[a] - begin >= g->count) & (list[a] != UINT32_MAX);
    return outside;
}

/* Has pieces wait that go on in other blocks, and what is anchored. Leaves `kind` to the points of such as are level.
 */
static void hold(const struct graph *g, struct spl_forest *f, uint8_t *kind)
{
    uint8_t sign;
    for (uint32_t i = 0; i < g->count; i++)
        if ((f->held[i] & SPL_TREE_ANCHORED) || (kind[i] != SPL_PIECE_OTHER && reaches_out(g, i)))
            f->held[spl_forest_find_root(f, i, &sign)] |= SPL_TREE_WAITS;
    for (uint32_t i = 0; i < g->count; i++)
        if (kind[i] != SPL_PIECE_LEVEL || !(f->held[spl_forest_find_root(f, i, &sign)] & SPL_TREE_WAITS))
            kind[i] = SPL_PIECE_OTHER;
}

/* Which pieces have a say for up: large ones. What waits may be larger than it looks, so how much of it there is is
 * kept in `own`. */
static void count_level(const struct graph *g, struct spl_forest *f, int32_t *own)
{
    for (uint32_t i = 0; i < g->count; i++) {
        bool is_root = f->parent[i] == i;
        own[i] = is_root && f->held[i] & SPL_TREE_WAITS && !(f->held[i] & SPL_TREE_ANCHORED) ? (int32_t)f->level[i] : 0;
        if (!is_root || !spl_orient_is_large(f->level[i]))
            f->level[i] = 0;
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

/* Tells of the trees, which are numbered in the order of their roots, and of each point which one holds it. */
static uint32_t list_components(struct spl_orient *orient, const struct graph *g)
{
    uint32_t count = 0;
    orient->components = (struct spl_component *)orient->edges; /* which nobody needs any more */
    for (uint32_t i = 0; i < g->count; i++)
        if (orient->label[i] == i) {
            orient->components[count] =
                (struct spl_component){.level = orient->level[i], .anchored = orient->held[i] & SPL_TREE_ANCHORED};
            orient->parent[i] = count++; /* which is free to hold the numbers now */
        }
    for (uint32_t i = 0; i < g->count; i++) {
        struct spl_component *c = &orient->components[orient->label[i] = orient->parent[orient->label[i]]];
        double area = get_area(g, orient->usual, i);
        c->outward += area * spl_eyes_get_outward(g->points, g->begin + i);
        c->area += area;
        c->count++;
        c->own += orient->own[i];
    }
    for (uint32_t c = 0; c < count; c++)
        if (spl_orient_is_large(orient->components[c].own))
            orient->components[c].level -= orient->components[c].own;
    return count;
}

uint32_t spl_orient_block(struct spl_orient *orient, struct spl_points *points, size_t begin, size_t end,
                          const uint32_t *neighbours, unsigned k)
{
    uint32_t n = (uint32_t)(end - begin), first_anchored = UINT32_MAX;
    const struct graph graph = {points, begin, n, neighbours, orient->reach, (float *)(orient->edges + (size_t)n * k),
                                k};
    struct spl_forest forest = {
        orient->parent, orient->flip, orient->held, orient->level, orient->label, orient->place, n};
    for (uint32_t i = 0; i < n; i++) {
        if (orient->held[i] && first_anchored == UINT32_MAX)
            first_anchored = i;
        orient->parent[i] = orient->held[i] ? first_anchored : i;
        orient->flip[i] = 0;
    }
    find_agreements(&graph, orient->kind);
    find_level(&graph, orient->usual, orient->level, first_anchored == UINT32_MAX && !points->eye_count, orient->kind);
    join_surfaces(&graph, &forest, orient->kind);
    if (n < points->count)
        hold(&graph, &forest, orient->kind);
    count_level(&graph, &forest, orient->own);
    spl_forest_vote(&forest, orient->edges, orient->edges + (size_t)n * k, find_edges(&graph, &forest, orient->edges));
    for (uint32_t i = 0; i < n; i++) {
        uint8_t sign;
        orient->label[i] = spl_forest_find_root(&forest, i, &sign);
        for (int c = 0; sign && c < 3; c++)
            points->normal[begin + i][c] = -points->normal[begin + i][c];
        if (sign)
            orient->own[i] = -orient->own[i];
    }
    return list_components(orient, &graph);
}
