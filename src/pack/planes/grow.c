/* Points that no patch has: beside edges, in cells of too few, on far scan lines. Each takes the nearest of the planes
 * in its cell and in those around it, if it lies on it and was seen from the same side. Level by level the cells grow,
 * and with them the gap that is crossed: a far scan line is 30 spacings from the next one. So that a plane does not run
 * on as a slice through what is no plane,
 * - it must have a share of what lies around: a slice of foliage is a small one;
 * - a point's normal must agree, unless nearly all that is open in its cell lies on the planes around: the points of a
 * scan line have no normals worth the name, and those beside an edge have that of the edge.
 * A point that was taken for one of a wire joins the plane it lies on likewise, and is none then: where a wall and a
 * ceiling meet, a far scan line looks like a wire.
 *
 * A round reads the lists that were made before it, and each cell writes its own points' labels alone, so the result
 * does not depend on threads or order. Most that is open is foliage, far from any plane: a cell is looked at only where
 * a level of cells four times as wide has labels around it, and in later rounds, where some were given in the last;
 * lists are filled where these are read, and anew where labels were given. */
#include "pack/planes/grow.h"

#include <stdlib.h>

#include "base/memory.h"
#include "base/parallel.h"
#include "pack/planes/heights.h"

enum { rounds = 3, grain = 1 << 10, look_grain = 32, most = 16, coarser = 2 };
static const double reach_sigmas = 4, reach_least = 0.3; /* of the noise, and of the bound */
static const double agreement = 0.8;                     /* cosine of a point's normal and the plane's */
static const double on_line = 0.7; /* of a cell's open points that lie on planes, where normals are not asked */
static const double share = 0.25;  /* a plane's points, of the open ones around */

struct growth {
    uint32_t *label;
    const struct spl_region *regions;
    const struct spl_points *points;
    const struct spl_cells *cells;
    const struct spl_plane_list *lists;
    const struct spl_stage *stage;
    const struct spl_plane_limits_list *limits;
    atomic_size_t taken;
    const struct spl_cells *coarse;
    atomic_uchar *given; /* of each coarse cell: it has labels of what grows, new ones in later rounds */
    atomic_uchar *near;  /* it, or one around it, has */
    atomic_uchar *read;  /* it, or one around it, is near, and its lists are to be filled */
    bool *filled;        /* its lists say what labels there are */
};

struct candidate {
    uint32_t region, count;
};

/* The planes in a cell and around it that have their share there; returns how many. */
static unsigned find_candidates(const struct growth *g, uint32_t cell, struct candidate found[most])
{
    unsigned count = 0, kept = 0;
    uint64_t open = 0;
    int64_t at[3];
    spl_cells_place(g->cells, cell, at);
    for (int n = 0; n < 27; n++) {
        uint32_t other =
            n == 13 ? cell : spl_cells_find(g->cells, at[0] + n % 3 - 1, at[1] + n / 3 % 3 - 1, at[2] + n / 9 - 1);
        if (other == UINT32_MAX)
            continue;
        const struct spl_plane_list *list = &g->lists[other];
        open += list->open;
        for (int s = 0; s < SPL_PLANE_LIST && list->label[s] != SPL_NO_PLANE; s++) {
            unsigned k = 0;
            if (g->regions[list->label[s]].closed)
                continue;
            while (k < count && found[k].region != list->label[s])
                k++;
            if (k == most)
                continue;
            if (k == count)
                found[count++] = (struct candidate){.region = list->label[s]};
            found[k].count += list->count[s];
        }
    }
    for (unsigned k = 0; k < count; k++)
        if (found[k].count >= share * (double)open)
            found[kept++] = found[k];
    return kept;
}

static bool is_open(const struct growth *g, size_t i)
{
    return g->label[i] == SPL_NO_PLANE;
}

static bool is_linear(const struct growth *g, size_t i)
{
    return g->points->linear && g->points->linear[i];
}

/* How far a point is off a region's surface; normal[], unless NULL, is the surface's there. */
static double distance(const struct growth *g, size_t i, uint32_t region, double normal[3])
{
    const struct spl_region *r = &g->regions[region];
    if (r->heights)
        return spl_heights_off(r->heights, g->points, i, normal);
    for (int c = 0; normal && c < 3; c++)
        normal[c] = r->normal[c];
    return fabs(spl_plane_distance(g->points, i, r->moments.mean, r->normal));
}

/* How far off a plane a point may lie, near point `i`. */
static double reach_at(const struct growth *g, size_t i)
{
    const struct spl_plane_limits *limits = spl_plane_limits_at(g->limits, i);
    return fmin(limits->bound, fmax(reach_sigmas * limits->noise, reach_least * limits->bound));
}

static size_t grow_cell(const struct growth *g, uint32_t cell, const struct candidate *found, unsigned count)
{
    size_t begin = g->cells->cells[cell].begin, end = g->cells->cells[cell + 1].begin, taken = 0, on = 0, open = 0;
    const double reach = reach_at(g, begin);
    for (size_t i = begin; i < end; i++) {
        if (!is_open(g, i) || is_linear(g, i))
            continue;
        bool lies = false;
        for (unsigned k = 0; k < count && !lies; k++)
            lies = distance(g, i, found[k].region, NULL) <= reach;
        open++;
        on += lies;
    }
    bool trusted = (double)on >= on_line * (double)open;
    for (size_t i = begin; i < end; i++) {
        double least = reach;
        uint32_t best = SPL_NO_PLANE;
        if (!is_open(g, i))
            continue;
        for (unsigned k = 0; k < count; k++) {
            const float *n = g->points->normal[i];
            double normal[3], off = distance(g, i, found[k].region, normal);
            double cosine = fabs(normal[0] * (double)n[0] + normal[1] * (double)n[1] + normal[2] * (double)n[2]);
            if (off > least || (off == least && best != SPL_NO_PLANE && found[k].region > best) ||
                !(trusted || is_linear(g, i) || cosine >= agreement) || !spl_plane_is_seen(g->points, i, normal) ||
                (is_linear(g, i) && g->regions[found[k].region].heights)) /* a wire bends as well */
                continue;
            least = off;
            best = found[k].region;
        }
        g->label[i] = best;
        taken += best != SPL_NO_PLANE;
    }
    return taken;
}

static void find_given(void *context, size_t begin, size_t end, unsigned worker)
{
    const struct growth *g = context;
    (void)worker;
    for (size_t k = begin; k < end; k++) {
        bool given = false;
        if (k % look_grain == 0)
            spl_spill_keep_bound(g->coarse->spill);
        for (size_t i = g->coarse->cells[k].begin; !given && i < g->coarse->cells[k + 1].begin; i++)
            given = g->label[i] != SPL_NO_PLANE && !g->regions[g->label[i]].closed;
        atomic_store_explicit(&g->given[k], given, memory_order_relaxed);
    }
}

/* to[] of each coarse cell: whether it, or one around it, is in from[]. */
struct ring {
    const struct spl_cells *cells;
    const atomic_uchar *from;
    atomic_uchar *to;
};

static void find_ring(void *context, size_t begin, size_t end, unsigned worker)
{
    const struct ring *r = context;
    (void)worker;
    for (size_t k = begin; k < end; k++) {
        int64_t at[3];
        bool near = atomic_load_explicit(&r->from[k], memory_order_relaxed);
        spl_cells_place(r->cells, (uint32_t)k, at);
        for (int n = 0; n < 27 && !near; n++) {
            uint32_t other = spl_cells_find(r->cells, at[0] + n % 3 - 1, at[1] + n / 3 % 3 - 1, at[2] + n / 9 - 1);
            near = other != UINT32_MAX && atomic_load_explicit(&r->from[other], memory_order_relaxed);
        }
        atomic_store_explicit(&r->to[k], near, memory_order_relaxed);
    }
}

static void grow_cells(void *context, size_t begin, size_t end, unsigned worker)
{
    struct growth *g = context;
    size_t taken = 0;
    uint32_t above = spl_plane_cell_of(g->coarse, g->cells->cells[begin].begin);
    (void)worker;
    for (size_t k = begin; k < end && !spl_stage_is_cancelled(g->stage); k++) {
        struct candidate found[most];
        if (k % look_grain == 0)
            spl_spill_keep_bound(g->cells->spill);
        while (g->coarse->cells[above + 1].begin <= g->cells->cells[k].begin)
            above++;
        if (!atomic_load_explicit(&g->near[above], memory_order_relaxed) || !(g->lists[k].open || g->lists[k].linear))
            continue;
        unsigned count = find_candidates(g, (uint32_t)k, found);
        size_t some = count ? grow_cell(g, (uint32_t)k, found, count) : 0;
        if (some)
            atomic_store_explicit(&g->given[above], 1, memory_order_relaxed);
        taken += some;
    }
    atomic_fetch_add(&g->taken, taken);
}

/* Finds what cells of level `k` are looked at in this round, and fills the lists that are read there; after it, `given`
 * says where labels were given. */
static void find_work(struct growth *g, struct spl_plane_levels *levels, unsigned k, int round, unsigned threads)
{
    g->coarse = &levels->cells[k + coarser < levels->count ? k + coarser : levels->count - 1];
    size_t count = g->coarse->count;
    if (round == 0)
        spl_parallel_for(threads, count, grain, find_given, g);
    for (size_t i = 0; i < count; i++)
        g->filled[i] = round > 0 && g->filled[i] && !atomic_load_explicit(&g->given[i], memory_order_relaxed);
    spl_parallel_for(threads, count, grain, find_ring, &(struct ring){g->coarse, g->given, g->near});
    spl_parallel_for(threads, count, grain, find_ring, &(struct ring){g->coarse, g->near, g->read});
    for (size_t i = 0; i < count; i++) {
        bool read = atomic_load_explicit(&g->read[i], memory_order_relaxed);
        atomic_store_explicit(&g->read[i], read && !g->filled[i], memory_order_relaxed);
        atomic_store_explicit(&g->given[i], 0, memory_order_relaxed);
        g->filled[i] |= read;
    }
    spl_plane_levels_fill_part(levels, k, g->points, g->label, &(struct spl_plane_part){g->coarse, g->read}, threads);
}

int spl_planes_grow(uint32_t *label, const struct spl_regions *regions, struct spl_plane_levels *levels,
                    const struct spl_points *points, const struct spl_plane_limits_list *limits,
                    struct spl_stage *stage, struct spl_error *err)
{
    struct growth g = {.label = label,
                       .regions = regions->list,
                       .points = points,
                       .lists = levels->lists,
                       .stage = stage,
                       .limits = limits};
    size_t room = levels->cells[levels->count > coarser ? coarser : levels->count - 1].count;
    g.given = spl_alloc(room, sizeof *g.given, err);
    g.near = spl_alloc(room, sizeof *g.near, err);
    g.read = spl_alloc(room, sizeof *g.read, err);
    g.filled = spl_alloc(room, sizeof *g.filled, err);
    int rc = g.given && g.near && g.read && g.filled ? 0 : SPL_E_NOMEM;
    for (unsigned k = 0; !rc && k < levels->count; k++) {
        g.cells = &levels->cells[k];
        atomic_store(&g.taken, 1);
        for (int round = 0; !rc && round < rounds && atomic_load(&g.taken); round++) {
            atomic_store(&g.taken, 0);
            find_work(&g, levels, k, round, stage->threads);
            spl_parallel_for(stage->threads, g.cells->count, grain, grow_cells, &g);
            rc = spl_stage_check(stage, err);
        }
    }
    free(g.given);
    free(g.near);
    free(g.read);
    free(g.filled);
    return rc;
}
