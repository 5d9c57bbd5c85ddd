/* Pieces with relief, from patches to surfaces to points:
 * 1. patches that bend, of points that no plane took or a small one (patches.c, curve.c), and pieces of them (graph.c,
 *    pieces.c): small planes may be facets of what bends;
 * 2. the surface of each piece, by its points (heights.c), and which of them lie on it;
 * 3. small planes that lose half of their points or more are facets, and there is no such plane; others have all of
 * their points back;
 * 4. growth: points beside them that lie on the surface (grow.c);
 * 5. numbers.
 * Pieces of few points, that are as flat as the planes were, or that lose many of them to their own surface, are given
 * up.
 *
 * Parallel over pieces in 2: each depends on its own points alone, in their order. Runs on the caller's thread. */
#include "pack/planes/smooth.h"

#include <stdlib.h>
#include <string.h>

#include "base/memory.h"
#include "base/parallel.h"
#include "pack/median.h"
#include "pack/planes/grow.h"
#include "pack/planes/heights.h"

enum { grain = 1 << 16, pieces_least = 60, even_least = 4, sample_most = 1023 };
static const double edge_spacings = 3;      /* of a surface's grid */
static const double radius_spacing = 1.128; /* radius of a disc amid a surface, over its points' spacing */
static const double kept_share = 0.75;      /* of a piece's points that its surface keeps */
static const double closer = 1.6;           /* times what points are off the surface, is what they are off planes */
static const double matters = 0.1;          /* of the bound: what planes are off is worth a surface from there on */
static const double facet_share = 0.5;      /* of a plane's points that lie on pieces: then it is none */
static const uint64_t small_most = 4096;    /* points of a small plane */

/* Of the points of one square of a piece. */
struct square {
    double sum, count;
};

struct work {
    struct spl_regions pieces;
    struct spl_heights *heights; /* by piece */
    uint32_t *label;             /* of points: planes, then pieces */
    uint32_t *claim;             /* of points: the piece that would have it, or SPL_NO_PLANE */
    const struct spl_plane *plane;
    uint32_t planes;           /* how many of the labels are */
    uint32_t *member;          /* points, piece after piece */
    size_t *first;             /* of each piece, and one behind the last */
    struct spl_plane *numbers; /* by piece */
    const struct spl_points *points;
    const struct spl_plane_limits_list *limits;
    struct spl_stage *stage;
    atomic_bool failed;
};

/* Finds the pieces, and claims their points. */
static int find_pieces(struct work *w, struct spl_plane_levels *levels, struct spl_error *err)
{
    struct spl_patches patches = {0};
    struct spl_patch_graph graph = {0};
    uint32_t *region = NULL, *taken = spl_spill_alloc_raw(w->points->spill, w->points->count, sizeof *taken, err);
    w->claim = spl_spill_alloc_raw(w->points->spill, w->points->count, sizeof *w->claim, err);
    for (size_t i = 0; taken && i < w->points->count; i++)
        taken[i] =
            w->label[i] != SPL_NO_PLANE && w->plane[w->label[i]].points > small_most ? w->label[i] : SPL_NO_PLANE;
    int rc = taken && w->claim ? spl_patches_find(&patches, w->claim, taken, w->points, w->limits, w->stage, err)
                               : SPL_E_NOMEM;
    spl_spill_free(w->points->spill, taken);
    if (!rc)
        rc = spl_stage_check(w->stage, err);
    if (!rc)
        rc = spl_patch_graph_init(&graph, levels, patches.count, w->points, w->claim, w->stage, err);
    if (!rc)
        rc = spl_stage_check(w->stage, err);
    if (!rc && !(region = spl_alloc_raw(patches.count, sizeof *region, err)))
        rc = SPL_E_NOMEM;
    if (!rc)
        rc = spl_pieces_find(&w->pieces, region, &patches, &graph, w->points, w->limits, w->stage, err);
    for (size_t i = 0; !rc && i < w->points->count; i++)
        if (w->claim[i] != SPL_NO_PLANE)
            w->claim[i] = region[w->claim[i]];
    free(region);
    spl_patch_graph_finish(&graph);
    spl_patches_finish(&patches);
    return rc;
}

/* Lists the points of each piece by counting. */
static int list_members(struct work *w, const uint32_t *of, uint32_t base, struct spl_error *err)
{
    size_t pieces = w->pieces.count, total = 0;
    free(w->member);
    free(w->first);
    w->member = NULL;
    w->first = spl_alloc(pieces + 2, sizeof *w->first, err);
    if (!w->first)
        return SPL_E_NOMEM;
    for (size_t i = 0; i < w->points->count; i++)
        if (of[i] != SPL_NO_PLANE && of[i] >= base) {
            w->first[of[i] - base + 2]++;
            total++;
        }
    for (size_t k = 0; k < pieces; k++)
        w->first[k + 2] += w->first[k + 1];
    w->member = spl_alloc_raw(total, sizeof *w->member, err);
    if (!w->member)
        return SPL_E_NOMEM;
    for (size_t i = 0; i < w->points->count; i++)
        if (of[i] != SPL_NO_PLANE && of[i] >= base)
            w->member[w->first[of[i] - base + 1]++] = (uint32_t)i;
    return 0;
}

static double spacing_of(const struct work *w, const uint32_t *member, size_t count)
{
    float radii[sample_most];
    size_t sample = count < sample_most ? count : sample_most;
    for (size_t s = 0; s < sample; s++)
        radii[s] = w->points->radius[member[s * count / sample]];
    return spl_median(radii, sample) / radius_spacing;
}

/* Drops members, by off[] = NAN, of squares whose points are off the surface as a whole. */
static bool drop_uneven(const struct work *w, const struct spl_heights *r, const uint32_t *member, size_t count,
                        float *off)
{
    struct square *squares = spl_alloc(r->count, sizeof *squares, NULL);
    uint32_t *at = spl_alloc_raw(count, sizeof *at, NULL);
    for (size_t k = 0; squares && at && k < count; k++) {
        double place[3];
        spl_heights_place(r, w->points, member[k], place);
        at[k] = spl_heights_vertex_at(r, place);
        if (at[k] == UINT32_MAX || isnan(off[k]))
            continue;
        squares[at[k]].sum += (double)off[k];
        squares[at[k]].count++;
    }
    for (size_t k = 0; squares && at && k < count; k++) {
        const struct spl_plane_limits *l = spl_plane_limits_at(w->limits, member[k]);
        const struct square *s = at[k] == UINT32_MAX ? NULL : &squares[at[k]];
        if (!s || (s->count >= even_least && fabs(s->sum) > l->step * s->count + 3 * l->noise * sqrt(s->count)))
            off[k] = NAN;
    }
    free(at);
    bool ok = squares && at;
    free(squares);
    return ok;
}

/* Whether the planes that some of the piece's points lie on do for them: they follow the points as closely as the
 * surface does, which is off them by off[], or so closely that what is left does not matter. */
static bool is_flat(const struct work *w, const uint32_t *member, size_t count, const float *off)
{
    double from_planes = 0, from_surface = 0, enough = 0;
    for (size_t i = 0; i < count; i++) {
        uint32_t k = w->label[member[i]];
        if (k == SPL_NO_PLANE || isnan(off[i]))
            continue;
        double distance = spl_plane_distance(w->points, member[i], w->plane[k].origin, w->plane[k].normal);
        from_planes += distance * distance;
        from_surface += (double)off[i] * (double)off[i];
        double least = matters * spl_plane_limits_at(w->limits, member[i])->bound;
        enough += least * least;
    }
    return from_planes < closer * closer * from_surface || from_planes < enough;
}

/* Fits the piece's surface and lets those points go that are off it; false: no memory. */
static bool make_piece(struct work *w, uint32_t k)
{
    const uint32_t *member = w->member + w->first[k];
    size_t count = w->first[k + 1] - w->first[k], kept = 0;
    struct spl_region *piece = &w->pieces.list[k];
    struct spl_heights *r = &w->heights[k];
    piece->closed = true;
    if (count < pieces_least)
        return true;
    float *bound = spl_alloc_raw(count, sizeof *bound, NULL), *off = spl_alloc_raw(count, sizeof *off, NULL);
    for (size_t i = 0; bound && i < count; i++)
        bound[i] = (float)spl_plane_limits_at(w->limits, member[i])->bound;
    spl_heights_init(r, piece->moments.mean, piece->normal, edge_spacings * spacing_of(w, member, count));
    bool ok = bound && off && spl_heights_fit(r, w->points, member, count, bound);
    for (size_t i = 0; ok && i < count; i++) {
        double at[3], distance = spl_heights_measure(r, w->points, member[i], at, NULL);
        off[i] = fabs(distance) <= (double)bound[i] ? (float)distance : NAN;
    }
    ok = ok && drop_uneven(w, r, member, count, off);
    for (size_t i = 0; ok && i < count; i++)
        kept += isnan(off[i]) ? 0 : 1;
    if (ok && kept >= pieces_least && (double)kept >= kept_share * (double)count && !is_flat(w, member, count, off)) {
        piece->heights = r;
        piece->closed = false;
        for (size_t i = 0; i < count; i++)
            if (isnan(off[i]))
                w->claim[member[i]] = SPL_NO_PLANE;
    }
    free(bound);
    free(off);
    return ok;
}

static void make_pieces(void *context, size_t begin, size_t end, unsigned worker)
{
    struct work *w = context;
    (void)worker;
    for (size_t k = begin; k < end && !spl_stage_is_cancelled(w->stage); k++) {
        spl_spill_keep_bound(w->points->spill);
        if (!make_piece(w, (uint32_t)k))
            atomic_store(&w->failed, true);
    }
}

static bool is_claimed(const struct work *w, size_t i)
{
    return w->claim[i] != SPL_NO_PLANE && !w->pieces.list[w->claim[i]].closed;
}

/* Decides between small planes and pieces; labels are as decided, and facets' planes, which `gone` marks, have no
 * points. */
static int settle_claims(struct work *w, bool *gone, struct spl_error *err)
{
    uint64_t *lost = spl_alloc(w->planes, sizeof *lost, err);
    if (!lost)
        return SPL_E_NOMEM;
    for (size_t i = 0; i < w->points->count; i++)
        if (w->label[i] != SPL_NO_PLANE && is_claimed(w, i))
            lost[w->label[i]]++;
    for (uint32_t k = 0; k < w->planes; k++)
        gone[k] = (double)lost[k] >= facet_share * (double)w->plane[k].points;
    for (size_t i = 0; i < w->points->count; i++) {
        if (w->label[i] != SPL_NO_PLANE && !gone[w->label[i]])
            continue;
        w->label[i] = is_claimed(w, i) ? w->planes + w->claim[i] : SPL_NO_PLANE;
    }
    free(lost);
    return 0;
}

static int grow_pieces(struct work *w, struct spl_plane_levels *levels, struct spl_error *err)
{
    struct spl_regions all = {.count = w->planes + w->pieces.count};
    all.list = spl_alloc(all.count, sizeof *all.list, err);
    if (!all.list)
        return SPL_E_NOMEM;
    for (uint32_t k = 0; k < w->planes; k++)
        all.list[k].closed = true;
    for (uint32_t k = 0; k < w->pieces.count; k++)
        all.list[w->planes + k] = w->pieces.list[k];
    int rc = spl_planes_grow(w->label, &all, levels, w->points, w->limits, w->stage, err);
    free(all.list);
    return rc;
}

static void describe_pieces(void *context, size_t begin, size_t end, unsigned worker)
{
    struct work *w = context;
    (void)worker;
    for (size_t k = begin; k < end; k++) {
        struct spl_heights *r = &w->heights[k];
        struct spl_plane *n = &w->numbers[k];
        double squared = 0;
        *n = (struct spl_plane){.points = w->first[k + 1] - w->first[k], .heights = r};
        memcpy(n->origin, r->origin, sizeof n->origin);
        memcpy(n->normal, r->normal, sizeof n->normal);
        for (size_t i = w->first[k]; i < w->first[k + 1]; i++) {
            double off = spl_heights_off(r, w->points, w->member[i], NULL);
            squared += off * off;
            n->error_max = fmax(n->error_max, off);
            n->bound += spl_plane_limits_at(w->limits, w->member[i])->bound;
        }
        n->error_rms = n->points ? sqrt(squared / (double)n->points) : 0;
        n->bound /= (double)(n->points ? n->points : 1);
    }
}

static int compare(const void *a, const void *b)
{
    const uint32_t *x = a, *y = b;
    return (x[0] > y[0]) - (x[0] < y[0]);
}

/* Takes the planes that are gone from the list, and appends the pieces that there are, by their first points; labels
 * have the numbers afterwards. */
static int number(struct work *w, const bool *gone, struct spl_planes *planes, struct spl_error *err)
{
    uint32_t count = 0, kept = 0, (*order)[2] = spl_alloc_raw(w->pieces.count, sizeof *order, err);
    uint32_t *place = spl_alloc_raw((size_t)w->planes + w->pieces.count, sizeof *place, err);
    int rc = order && place ? list_members(w, w->label, w->planes, err) : SPL_E_NOMEM;
    if (!rc) {
        spl_parallel_for(w->stage->threads, w->pieces.count, 1, describe_pieces, w);
        for (uint32_t k = 0; k < w->pieces.count; k++)
            if (w->first[k + 1] > w->first[k]) {
                order[count][0] = w->member[w->first[k]];
                order[count++][1] = k;
            }
        qsort(order, count, sizeof *order, compare);
        struct spl_plane *list = spl_realloc(planes->list, (size_t)w->planes + count, sizeof *list, err);
        if (list)
            planes->list = list;
        else
            rc = SPL_E_NOMEM;
    }
    for (uint32_t k = 0; !rc && k < w->planes; k++)
        if (!gone[k]) {
            planes->list[kept] = planes->list[k];
            place[k] = kept++;
        }
    planes->count = planes->flat = rc ? planes->count : kept;
    for (uint32_t n = 0; !rc && n < count; n++) {
        struct spl_heights *own = spl_alloc_raw(1, sizeof *own, err);
        uint32_t k = order[n][1];
        if (!own) {
            rc = SPL_E_NOMEM;
            break;
        }
        *own = w->heights[k];
        w->heights[k] = (struct spl_heights){0};
        planes->list[planes->count] = w->numbers[k];
        planes->list[planes->count].heights = own;
        place[w->planes + k] = planes->count++;
    }
    for (size_t i = 0; !rc && i < w->points->count; i++)
        if (w->label[i] != SPL_NO_PLANE)
            w->label[i] = place[w->label[i]];
    free(order);
    free(place);
    return rc;
}

int spl_smooth_find(struct spl_planes *planes, uint32_t *label, struct spl_plane_levels *levels,
                    const struct spl_points *points, const struct spl_plane_limits_list *limits,
                    struct spl_stage *stage, struct spl_error *err)
{
    struct work w = {.label = label,
                     .plane = planes->list,
                     .planes = planes->count,
                     .points = points,
                     .limits = limits,
                     .stage = stage};
    bool *gone = spl_alloc(planes->count, sizeof *gone, err);
    int rc = gone ? find_pieces(&w, levels, err) : SPL_E_NOMEM;
    w.heights = spl_alloc(w.pieces.count, sizeof *w.heights, err);
    w.numbers = spl_alloc(w.pieces.count, sizeof *w.numbers, err);
    if (!rc && !(w.heights && w.numbers))
        rc = SPL_E_NOMEM;
    if (!rc)
        rc = list_members(&w, w.claim, 0, err);
    if (!rc) {
        spl_parallel_for(stage->threads, w.pieces.count, 1, make_pieces, &w);
        rc = atomic_load(&w.failed) ? spl_fail(err, SPL_E_NOMEM, "out of memory for %u surfaces", w.pieces.count)
                                    : spl_stage_check(stage, err);
    }
    if (!rc)
        rc = settle_claims(&w, gone, err);
    if (!rc)
        rc = grow_pieces(&w, levels, err);
    if (!rc)
        rc = number(&w, gone, planes, err);
    for (uint32_t k = 0; w.heights && k < w.pieces.count; k++)
        spl_heights_finish(&w.heights[k]);
    free(gone);
    free(w.heights);
    free(w.numbers);
    spl_spill_free(points->spill, w.claim);
    free(w.member);
    free(w.first);
    spl_regions_finish(&w.pieces);
    return rc;
}
