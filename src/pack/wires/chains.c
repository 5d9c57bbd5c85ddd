/* Wires are found once, after the radii, for the whole scan: which points belong together depends on no level of
 * detail. A join of two points is a straight piece; over a gap it is several, which follow the arc that the stretches
 * on both sides are parts of. A piece belongs to the node of the nearer of its two points. One thread. */
#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "base/memory.h"
#include "pack/median.h"
#include "pack/stage.h"
#include "pack/wires/axis.h"
#include "pack/wires/join.h"
#include "pack/wires/sides.h"
#include "pack/wires/wires.h"
#include "shared.h" /* SPL_CHUNK_SPLATS, SPL_FILL_STRAY */

enum { pieces_most = 31 };         /* of a join; odd, so that colours change within one */
static const double straight = 8;  /* spacings that a piece over a gap is long */
enum { point_steps = 8192 };       /* 10 to 20 ns each; a scan of nothing but wires takes a twentieth */

struct gathered {
    struct spl_wire_point *points;
    uint32_t *index; /* in the scan, of each */
    size_t count;
};

/* Points that lie close together in Morton order: one whose radius is several times that of most linear ones among them
 * strays, and reaches no farther. The least of all, which the kernels go by, would be too little: ground beside a
 * pylon's foot is scanned more densely than what hangs from its head. */
static void gather_run(struct gathered *g, const struct spl_points *p, size_t begin, size_t end)
{
    float radii[SPL_CHUNK_SPLATS];
    size_t linear = 0;
    for (size_t i = begin; i < end; i++)
        if (p->linear[i])
            radii[linear++] = p->radius[i];
    double most = linear ? SPL_FILL_STRAY * (double)spl_median(radii, linear) : 0;
    for (size_t i = begin; i < end; i++) {
        if (!p->linear[i])
            continue;
        struct spl_wire_point *point = &g->points[g->count];
        point->spacing = fmin(p->radius[i], most);
        for (int c = 0; c < 3; c++)
            point->position[c] = spl_points_at(p, c, i);
        g->index[g->count++] = (uint32_t)i;
    }
}

static int gather(struct gathered *g, const struct spl_points *p, const struct spl_stage *stage, struct spl_error *err)
{
    size_t linear = 0;
    for (size_t i = 0; i < p->count; i++)
        linear += p->linear[i];
    g->points = spl_alloc_raw(linear + 1, sizeof *g->points, err);
    g->index = spl_alloc_raw(linear + 1, sizeof *g->index, err);
    if (!g->points || !g->index)
        return SPL_E_NOMEM;
    for (size_t i = 0; i < p->count && !spl_stage_is_cancelled(stage); i += SPL_CHUNK_SPLATS) {
        spl_spill_keep_bound(p->spill);
        gather_run(g, p, i, p->count - i < SPL_CHUNK_SPLATS ? p->count : i + SPL_CHUNK_SPLATS);
    }
    return spl_stage_check(stage, err);
}

/* The way from the middle of the straight line between two points to that of the arc on which both and what they are
 * joined with lie: over `length` between stretches of `base` on average, whose directions an end lies `aside` of, its
 * curvature is 2 aside / (length (length + base)), its height length^2 / 8 times that. */
static void find_arc(const struct spl_wire_point *p, uint32_t a, uint32_t b, double length, double rise[3],
                     struct spl_wires_work *work)
{
    double base = 0, aside[3] = {0};
    uint32_t ends[2] = {a, b};
    memset(rise, 0, 3 * sizeof *rise);
    for (int k = 0; k < 2; k++) {
        uint32_t own = ends[k], far = ends[1 - k];
        double heading[3], along = 0, behind = spl_wires_heading(p, own, far, length, heading, work);
        if (!(behind > 0))
            return;
        base += behind / 2;
        for (int c = 0; c < 3; c++)
            along += (p[far].position[c] - p[own].position[c]) * heading[c];
        for (int c = 0; c < 3; c++)
            aside[c] += (p[far].position[c] - p[own].position[c] - along * heading[c]) / 2;
    }
    for (int c = 0; c < 3; c++)
        rise[c] = -aside[c] * length / (4 * (length + base));
}

/* Of how many pieces a join is, and how long. */
static int count_pieces(const struct spl_wire_point *a, const struct spl_wire_point *b, double *length)
{
    double squared = 0;
    for (int c = 0; c < 3; c++)
        squared += (b->position[c] - a->position[c]) * (b->position[c] - a->position[c]);
    *length = sqrt(squared);
    return (int)fmin(ceil(*length / (straight * fmax(a->spacing, b->spacing))), pieces_most) | 1;
}

/* Room for all vertices: one for each piece, and one more for each chain. */
static int reserve(struct spl_wires *w, const struct gathered *g, struct spl_error *err)
{
    const struct spl_wire_point *p = g->points;
    uint64_t vertices = 0;
    for (uint32_t i = 0; i < g->count; i++) {
        double length;
        for (int k = 0; k < 2; k++) /* each join at one of its points */
            if (p[i].next[k] != SPL_WIRE_END && p[i].next[k] > i)
                vertices += (unsigned)count_pieces(&p[i], &p[p[i].next[k]], &length);
        vertices += spl_wires_is_begin(p, i);
    }
    if (vertices >= SPL_WIRE_END)
        return spl_fail(err, SPL_E_LIMIT,
                        "wires, poles and cables of %llu vertices; at most %u can be joined: pack the scans as several "
                        "datasets, or with --no-linear",
                        (unsigned long long)vertices, SPL_WIRE_END - 1);
    w->vertices = spl_spill_alloc_raw(w->spill, vertices + 1, sizeof *w->vertices, err);
    w->capacity = vertices;
    return w->vertices ? SPL_OK : SPL_E_NOMEM;
}

/* Adds a vertex that looks like wire point `like`. */
static void add_vertex(struct spl_wires *w, const struct spl_points *p, const struct gathered *g, uint32_t like,
                       const double position[3], float length)
{
    spl_assert(w->count < w->capacity);
    uint32_t index = g->index[like];
    spl_spill_keep_bound(p->spill); /* each is in pages of its own */
    struct spl_wire_vertex *vertex = &w->vertices[w->count++];
    *vertex = (struct spl_wire_vertex){.radius = (float)g->points[like].spacing,
                                       .length = length,
                                       .width = (float)g->points[like].width,
                                       .color_class = p->color_class[index],
                                       .point = SPL_WIRE_END};
    memcpy(vertex->position, position, sizeof vertex->position);
    memcpy(vertex->normal, p->normal[index], sizeof vertex->normal);
}

/* From the last vertex, which is that of point `a`, to one of point `b`. */
static void add_join(struct spl_wires *w, const struct spl_points *p, const struct gathered *g, uint32_t a, uint32_t b,
                     float chain, struct spl_wires_work *work)
{
    const double *from = g->points[a].position, *to = g->points[b].position;
    double rise[3] = {0}, length;
    int pieces = count_pieces(&g->points[a], &g->points[b], &length);
    if (pieces > 1)
        find_arc(g->points, a, b, length, rise, work);
    for (int i = 1; i <= pieces; i++) {
        double t = (double)i / pieces, at[3];
        for (int c = 0; c < 3; c++)
            at[c] = i < pieces ? from[c] + t * (to[c] - from[c]) + 4 * t * (1 - t) * rise[c] : to[c];
        w->vertices[w->count - 1].point = g->index[2 * i <= pieces + 1 ? a : b];
        add_vertex(w, p, g, 2 * i < pieces ? a : b, at, chain);
    }
}

static int compare_begins(const void *a, const void *b, void *context)
{
    const struct spl_wire_point *p = context;
    uint32_t i = *(const uint32_t *)a, k = *(const uint32_t *)b;
    return p[i].width != p[k].width ? (p[i].width > p[k].width) - (p[i].width < p[k].width) : (i > k) - (i < k);
}

/* Where chains begin, by their width, since those of a chunk share one; *count of them. The caller frees. */
static uint32_t *list_begins(const struct spl_wires *w, const struct gathered *g, size_t *count, struct spl_error *err)
{
    uint32_t *begins = spl_alloc_raw(g->count + 1, sizeof *begins, err);
    *count = 0;
    for (uint32_t i = 0; begins && i < g->count; i++)
        if (spl_wires_is_begin(g->points, i) && (!w->with_widths || g->points[i].width > 0))
            begins[(*count)++] = i;
    if (begins && w->with_widths)
        qsort_r(begins, *count, sizeof *begins, compare_begins, g->points);
    return begins;
}

/* Adds up to as many items as there are points to the stage. */
static int add_chains(struct spl_wires *w, const struct spl_points *points, const struct gathered *g,
                      struct spl_wires_work *work, struct spl_error *err)
{
    const struct spl_wire_point *p = g->points;
    uint64_t done = 0;
    size_t count = 0;
    uint32_t *begins = list_begins(w, g, &count, err);
    int rc = begins ? reserve(w, g, err) : SPL_E_NOMEM;
    for (size_t k = 0; k < count && !rc; k++) {
        uint32_t i = begins[k];
        float length = (float)p[i].length;
        add_vertex(w, points, g, i, p[i].position, length);
        for (uint32_t before = SPL_WIRE_END, at = i; at != p[i].other && !rc; done++) {
            uint32_t next = p[at].next[p[at].next[0] == before];
            add_join(w, points, g, at, next, length, work);
            before = at;
            at = next;
            spl_wires_advance(work, done, g->count, g->count);
            rc = spl_stage_check(work->stage, err);
        }
    }
    free(begins);
    return rc;
}

/* Points that no line stands for are as others are. */
static void unmark(const struct gathered *g, struct spl_points *points)
{
    for (size_t i = 0; i < g->count; i++)
        points->linear[g->index[i]] = g->points[i].width > 0;
}

static int compare_pieces(const void *a, const void *b, void *context)
{
    const struct spl_wire_vertex *vertices = context;
    uint32_t i = *(const uint32_t *)a, k = *(const uint32_t *)b, p = vertices[i].point, q = vertices[k].point;
    return p != q ? (p > q) - (p < q) : (i > k) - (i < k);
}

static int sort_pieces(struct spl_wires *w, struct spl_error *err)
{
    w->pieces = spl_spill_alloc_raw(w->spill, w->count + 1, sizeof *w->pieces, err);
    if (!w->pieces)
        return SPL_E_NOMEM;
    for (size_t i = 0; i < w->count; i++)
        if (w->vertices[i].point != SPL_WIRE_END)
            w->pieces[w->piece_count++] = (uint32_t)i;
    qsort_r(w->pieces, w->piece_count, sizeof *w->pieces, compare_pieces, w->vertices);
    return SPL_OK;
}

int spl_wires_find(struct spl_wires *wires, struct spl_points *points, const struct spl_wires_options *options,
                   struct spl_stage *stage, struct spl_error *err)
{
    struct gathered g = {0};
    *wires = (struct spl_wires){.with_widths = options, .error = options ? options->error : 0,
                                .spill = stage->spill};
    if (!points->linear)
        return SPL_OK;
    spl_stage_begin(stage, "joining wires", NULL, 0);
    int rc = gather(&g, points, stage, err);
    stage->total = 3 * (uint64_t)g.count;
    struct spl_wires_work joining = {point_steps * ((uint64_t)g.count + 128), stage}, cutting = joining;
    if (!rc)
        rc = spl_wires_join(g.points, (uint32_t)g.count, &joining, err);
    wires->cut_short = rc == SPL_E_LIMIT; /* the links hold */
    if (rc == SPL_E_CANCELLED)
        rc = spl_stage_check(stage, err);
    if (wires->cut_short)
        rc = SPL_OK;
    if (!rc && options)
        rc = spl_wires_find_axes(g.points, (uint32_t)g.count, options->noise, &cutting, err);
    if (!rc && options)
        rc = spl_wires_drop_thick(g.points, (uint32_t)g.count, points->up, &cutting, err);
    if (!rc && options)
        unmark(&g, points);
    if (!rc)
        rc = add_chains(wires, points, &g, &cutting, err);
    free(g.points);
    free(g.index);
    if (!rc)
        rc = sort_pieces(wires, err);
    if (!rc && options)
        rc = spl_wires_claim(wires, points, options->noise, stage, err);
    if (!rc)
        rc = spl_stage_check(stage, err);
    if (!rc)
        spl_stage_finish(stage);
    return rc;
}

void spl_wires_finish(struct spl_wires *wires)
{
    spl_spill_free(wires->spill, wires->vertices);
    spl_spill_free(wires->spill, wires->pieces);
    *wires = (struct spl_wires){0};
}
