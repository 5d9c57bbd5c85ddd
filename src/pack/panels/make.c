/* Which points of a node become panels, and of what cells.
 *
 * Leaves: a plane's points are halved along the Morton order until those of a part lie about equally dense; its cells
 * are half as large, in area, as what each of these stands for: the borders of panels are stairs of cells. Where panels
 * cost more than the discs that they are for, these stay: points->plane forgets the plane. Inner nodes: cells twice as
 * large as the median of those below, on all planes the same, as of discs; cells that are larger already stay as they
 * are, so that each level has about a quarter of the cells of the one below it. All points below a node are rasterised
 * anew: exact, and as dear as the points times the levels.
 *
 * Each node is one worker's; what it changes of points is its own points'. */
#include "pack/panels/panels.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "base/array.h"
#include "base/memory.h"
#include "base/parallel.h"
#include "pack/median.h"
#include "pack/panels/borders.h"
#include "pack/panels/raster.h"
#include "pack/tree.h"

enum { part_least = 128, sample_most = 255, bins = 2048, bins_an_octave = 8 };
static const double even = 2;             /* radii of a part differ by no more, but for the outermost sixths */
static const double fineness = M_SQRT1_2; /* a leaf's cells, as a share of how far apart its points lie */
static const double stands_out = 5;       /* radii over the part's cells from which on a point stays a disc */
static const double cells_most = 16384;   /* of an inner node: with what they cost at most, it has chunks enough */
static const double disc_bytes = 6;       /* of one, with its colour and its share of the chunk's header */

struct spl_panel_scratch {
    struct spl_panel_groups groups;
    struct spl_panel_borders borders;
    struct spl_panel_raster raster;
    double *weights; /* of bins: sizes of cells, by the logarithm */
};

struct leaves {
    struct spl_panel_maker *maker;
    struct spl_tree *tree;
    struct spl_stage *stage;
    atomic_bool failed;
};

/* Mean of the logarithms, so that neither the dense nor the sparse parts of a plane have all the say. */
static int settle_bases(struct spl_panel_maker *m, struct spl_error *err)
{
    const struct spl_points *p = m->points;
    double *sum = spl_alloc(m->planes->count, sizeof *sum, err);
    uint32_t *count = spl_alloc(m->planes->count, sizeof *count, err);
    m->base = spl_alloc_raw(m->planes->count, sizeof *m->base, err);
    int rc = sum && count && m->base ? SPL_OK : SPL_E_NOMEM;
    for (size_t i = 0; !rc && i < p->count; i++)
        if (p->plane[i] != SPL_NO_PLANE) {
            sum[p->plane[i]] += log2((double)p->radius[i]);
            count[p->plane[i]]++;
        }
    for (uint32_t k = 0; !rc && k < m->planes->count; k++)
        m->base[k] = count[k] ? (float)(exp2(sum[k] / count[k]) / SPL_RADIUS_SPACING) : 1;
    free(sum);
    free(count);
    return rc;
}

int spl_panel_maker_init(struct spl_panel_maker *m, struct spl_points *points, const struct spl_planes *planes,
                         unsigned threads, struct spl_error *err)
{
    m->points = points;
    m->planes = planes;
    m->workers = threads;
    m->level = spl_spill_alloc(points->spill, points->count, sizeof *m->level, err);
    m->scratch = spl_alloc(threads, sizeof *m->scratch, err);
    spl_clip_turns_init(&m->turns);
    if (points->clip) {
        m->neighbours = spl_neighbours_create(points, threads, err);
        m->crease = m->neighbours ? spl_spill_alloc_raw(points->spill, points->count, sizeof *m->crease, err) : NULL;
        if (!m->crease)
            return SPL_E_NOMEM;
        for (size_t i = 0; i < points->count; i++)
            m->crease[i] = SPL_NO_PLANE;
    }
    return m->level && m->scratch ? settle_bases(m, err) : SPL_E_NOMEM;
}

void spl_panel_maker_finish(struct spl_panel_maker *m)
{
    struct spl_spill *spill = m->points ? m->points->spill : NULL;
    for (unsigned t = 0; m->scratch && t < m->workers; t++) {
        spl_panel_groups_finish(&m->scratch[t].groups);
        spl_panel_borders_finish(&m->scratch[t].borders);
        spl_panel_raster_finish(&m->scratch[t].raster);
        free(m->scratch[t].weights);
    }
    spl_neighbours_destroy(m->neighbours);
    spl_spill_free(spill, m->crease);
    free(m->scratch);
    free(m->base);
    spl_spill_free(spill, m->level);
    *m = (struct spl_panel_maker){0};
}

/* Says how large the cells of members [begin, end) are, which are points of one plane in Morton order. */
static void settle_part(struct spl_panel_maker *m, const struct spl_tree_node *leaf, const uint32_t *members,
                        size_t count, uint32_t plane)
{
    float radii[sample_most];
    size_t sample = count < sample_most ? count : sample_most;
    for (size_t s = 0; s < sample; s++)
        radii[s] = m->points->radius[leaf->begin + members[s * count / sample]];
    double median = spl_median(radii, sample); /* sorts them */
    if (count >= 2 * part_least && (double)radii[sample - 1 - sample / 6] > even * (double)radii[sample / 6]) {
        settle_part(m, leaf, members, count / 2, plane);
        settle_part(m, leaf, members + count / 2, count - count / 2, plane);
        return;
    }
    uint8_t level = spl_panel_level(m, plane, fineness * median / SPL_RADIUS_SPACING);
    double most = stands_out * SPL_RADIUS_SPACING * spl_panel_cell(m, plane, level);
    for (size_t k = 0; k < count; k++) {
        size_t i = leaf->begin + members[k];
        m->level[i] = (double)m->points->radius[i] <= most ? level : 0;
    }
}

/* The members of a run that have cells of one level. */
static struct spl_panel_group group_of(const struct spl_panel_maker *m, const struct spl_panel_scratch *w,
                                       const struct spl_tree_node *node, uint32_t plane, uint8_t level, size_t count)
{
    return (struct spl_panel_group){.points = m->points,
                                    .planes = m->planes,
                                    .plane = &m->planes->list[plane],
                                    .crease = m->crease,
                                    .node_origin = node->origin,
                                    .members = w->groups.level_members,
                                    .first = node->begin,
                                    .count = count,
                                    .cell = (double)(float)spl_panel_cell(m, plane, level),
                                    .leaf = !node->child_count};
}

/* The least level above `above` that a member of the run has; 0: none has one. */
static uint8_t next_level(const struct spl_panel_maker *m, const struct spl_panel_groups *groups, size_t first,
                          const struct spl_panel_run *run, uint8_t above)
{
    uint8_t next = 0;
    for (size_t k = run->begin; k < run->begin + run->count; k++) {
        uint8_t level = m->level[first + groups->members[k]];
        if (level > above && (!next || level < next))
            next = level;
    }
    return next;
}

/* How many discs of a node of that spacing the members would be. */
static double count_discs(const struct spl_panel_group *group)
{
    double area = 0, disc = SPL_RADIUS_SPACING * group->cell / fineness;
    if (group->leaf)
        return (double)group->count;
    for (size_t k = 0; k < group->count; k++) {
        double radius = (double)group->points->radius[group->first + group->members[k]];
        area += radius * radius;
    }
    return area / (disc * disc);
}

/* Notes that the members are discs from this node on. */
static int leave(struct spl_panel_maker *m, const struct spl_panel_group *group, struct spl_panel_left *left)
{
    if (left && spl_array_reserve(left->points, left->capacity, left->count + group->count, NULL))
        return SPL_E_NOMEM;
    for (size_t k = 0; k < group->count; k++) {
        m->level[group->first + group->members[k]] = 0;
        if (left)
            left->points[left->count++] = (uint32_t)(group->first + group->members[k]);
    }
    return SPL_OK;
}

/* The members of one level: panels, or discs where these cost less. */
static int make_group(struct spl_panel_maker *m, struct spl_panel_scratch *w, const struct spl_tree_node *node,
                      uint32_t plane, uint8_t level, size_t count, struct spl_panel_left *left,
                      struct spl_node_panels *out)
{
    struct spl_panel_group group = group_of(m, w, node, plane, level, count);
    struct spl_node_panels before = *out;
    int rc = spl_panel_raster_add(&w->raster, &group, out);
    if (rc == SPL_E_NOMEM)
        return rc;
    double bytes = (double)(out->chunk_count - before.chunk_count) * SPL_CHUNK_BYTES +
                   (double)(out->word_count - before.word_count) * sizeof *out->words;
    if (!rc && bytes < disc_bytes * count_discs(&group))
        return SPL_OK;
    out->chunk_count = before.chunk_count;
    out->word_count = before.word_count;
    out->panel_count = before.panel_count;
    memcpy(out->box_min, before.box_min, sizeof out->box_min);
    memcpy(out->box_max, before.box_max, sizeof out->box_max);
    return leave(m, &group, left);
}

/* Makes the node's panels from the runs of its groups, whose points have their levels. */
static bool make_runs(struct spl_panel_maker *m, struct spl_panel_scratch *w, struct spl_tree_node *node,
                      struct spl_panel_left *left)
{
    struct spl_node_panels made = {0};
    for (size_t r = 0; r < w->groups.run_count; r++) {
        const struct spl_panel_run *run = &w->groups.runs[r];
        spl_spill_keep_bound(m->points->spill);
        for (uint8_t level = 0; (level = next_level(m, &w->groups, node->begin, run, level));) {
            size_t count = spl_panel_groups_select(&w->groups, m, node->begin, run, level);
            if (make_group(m, w, node, run->plane, level, count, left, &made)) {
                spl_node_panels_finish(&made);
                return false;
            }
            if (level == UINT8_MAX)
                break;
        }
    }
    if (!made.chunk_count) {
        spl_node_panels_finish(&made);
        return true;
    }
    node->panels = spl_alloc(1, sizeof *node->panels, NULL);
    if (!node->panels || !spl_node_panels_settle(&made, m->points->spill)) {
        spl_node_panels_finish(&made);
        return false;
    }
    *node->panels = made;
    return true;
}

static bool make_leaf(struct spl_panel_maker *m, struct spl_panel_scratch *w, struct spl_tree_node *leaf)
{
    struct spl_points *p = m->points;
    if (!spl_panel_groups_find(&w->groups, m, leaf->begin, leaf->end))
        return false;
    for (size_t r = 0; r < w->groups.run_count; r++) {
        const struct spl_panel_run *run = &w->groups.runs[r];
        settle_part(m, leaf, w->groups.members + run->begin, run->count, run->plane);
    }
    if (!make_runs(m, w, leaf, NULL))
        return false;
    leaf->splat_count = 0;
    for (size_t i = leaf->begin; i < leaf->end; i++) {
        leaf->splat_count += !m->level[i];
        if (!m->level[i])
            p->plane[i] = SPL_NO_PLANE;
    }
    return true;
}

/* Before leaves are made: it reads the planes of points of other ones. */
static void find_borders(void *context, size_t begin, size_t end, unsigned worker)
{
    struct leaves *l = context;
    struct spl_panel_maker *m = l->maker;
    struct spl_panel_scratch *w = &m->scratch[worker];
    for (size_t i = begin; i < end; i++) {
        const struct spl_tree_node *leaf = &l->tree->nodes[i];
        if (leaf->child_count)
            continue;
        for (size_t k = leaf->begin; k < leaf->end; k++)
            m->level[k] = m->points->plane[k] != SPL_NO_PLANE;
        if (!spl_panel_groups_find(&w->groups, m, leaf->begin, leaf->end) ||
            !spl_panel_borders_find(&w->borders, &w->groups, m, leaf->begin))
            atomic_store(&l->failed, true);
        if (atomic_load(&l->failed) || spl_stage_is_cancelled(l->stage))
            return;
    }
}

static void make_leaves(void *context, size_t begin, size_t end, unsigned worker)
{
    struct leaves *l = context;
    for (size_t i = begin; i < end; i++) {
        struct spl_tree_node *node = &l->tree->nodes[i];
        if (node->child_count)
            continue;
        size_t points = node->splat_count;
        if (!make_leaf(l->maker, &l->maker->scratch[worker], node))
            atomic_store(&l->failed, true);
        if (atomic_load(&l->failed) || spl_stage_is_cancelled(l->stage))
            return;
        spl_stage_add(l->stage, points, worker);
    }
}

int spl_panels_make_leaves(struct spl_panel_maker *maker, struct spl_tree *tree, struct spl_stage *stage,
                           struct spl_error *err)
{
    struct leaves l = {.maker = maker, .tree = tree, .stage = stage};
    spl_stage_begin(stage, "panels", "points", maker->points->count);
    spl_parallel_for(stage->threads, tree->count, 4, find_borders, &l);
    if (!atomic_load(&l.failed))
        spl_parallel_for(stage->threads, tree->count, 4, make_leaves, &l);
    if (atomic_load(&l.failed))
        return spl_fail(err, SPL_E_NOMEM, "out of memory while making panels of %zu points", maker->points->count);
    spl_stage_end(stage);
    return spl_stage_check(stage, err);
}

/* How many cells points are whose sizes of cells w->weights counts, where these are `cell` at least. */
static double count_cells(const struct spl_panel_scratch *w, double cell)
{
    double cells = 0;
    for (int bin = 0; bin < bins; bin++) {
        double wider = cell / exp2((double)(bin - bins / 2) / bins_an_octave);
        cells += w->weights[bin] > 0 ? w->weights[bin] / fmax(1, wider * wider) : 0;
    }
    return cells;
}

/* How large cells of an inner node are: twice the median of those that its panels' points have below it, or as large
 * as they must be for a node; 0: it has no panels. Each point stands for as many cells as its disc. */
static double settle_inner(const struct spl_panel_maker *m, struct spl_panel_scratch *w,
                           const struct spl_tree_node *node)
{
    double total = 0, sum = 0, cell = 1;
    int bin = 0;
    memset(w->weights, 0, bins * sizeof *w->weights);
    for (size_t r = 0; r < w->groups.run_count; r++) {
        const struct spl_panel_run *run = &w->groups.runs[r];
        uint8_t level = 0;
        for (size_t k = run->begin; k < run->begin + run->count; k++) {
            size_t i = node->begin + w->groups.members[k];
            if (m->level[i] != level) {
                level = m->level[i];
                cell = spl_panel_cell(m, run->plane, level);
                bin = (int)fmin(fmax(floor(bins_an_octave * log2(cell) + 0.5) + bins / 2, 0), bins - 1);
            }
            double radius = (double)m->points->radius[i] / (SPL_RADIUS_SPACING * cell);
            w->weights[bin] += radius * radius;
            total += radius * radius;
        }
    }
    if (!(total > 0))
        return 0;
    for (bin = 0; bin < bins - 1 && 2 * (sum += w->weights[bin]) < total;)
        bin++;
    cell = 2 * exp2((double)(bin - bins / 2) / bins_an_octave);
    while (count_cells(w, cell) > cells_most)
        cell *= 1.1;
    return cell;
}

bool spl_panels_make_inner(struct spl_panel_maker *m, struct spl_tree_node *node, unsigned worker,
                           struct spl_panel_left *left)
{
    struct spl_panel_scratch *w = &m->scratch[worker];
    if (!w->weights && !(w->weights = spl_alloc_raw(bins, sizeof *w->weights, NULL)))
        return false;
    if (!spl_panel_groups_find(&w->groups, m, node->begin, node->end))
        return false;
    double cell = settle_inner(m, w, node);
    left->count = 0;
    left->cell = cell / 2 / fineness;
    if (!(cell > 0))
        return true;
    for (size_t r = 0; r < w->groups.run_count; r++) {
        const struct spl_panel_run *run = &w->groups.runs[r];
        uint8_t least = spl_panel_level(m, run->plane, cell);
        for (size_t k = run->begin; k < run->begin + run->count; k++) {
            uint8_t *level = &m->level[node->begin + w->groups.members[k]];
            *level = *level > least ? *level : least;
        }
    }
    return make_runs(m, w, node, left);
}
