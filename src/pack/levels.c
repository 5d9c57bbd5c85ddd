/* Inner nodes: their children's splats, clustered on a grid.
 *
 * A cell gives one splat, or two where normals oppose, so that a thin wall keeps both its faces. The cell is as large
 * as it must be for the node to hold about a quarter of its children's splats, which is what doubling the spacing of a
 * surface means and keeps all levels together at a third of the leaves. A cluster's disc has the area of its parts,
 * reaches over them (which matters along wires), and is no larger than its cell calls for unless one of its parts was.
 *
 * What panels leave may be a few splats, far from each other. A quarter of them would be discs from one to the next,
 * across what lies between, so there cells stay near what their splats are large, or as large as the node's panels ask
 * for, and discs near the area of their parts, or as far as these reach laid end to end, which is what lines of a scan
 * need; the node holds more of them instead.
 *
 * Where inner nodes are drawn for good, a mean of two surfaces is drawn for good too, and maps put the wrong texels on
 * it. There a cell gives a splat for each surface in it, told apart by their normals and by how far off one another's
 * plane they lie. On an exact courtyard with exact maps 1/100 of the splats gains 0.5 dB by it at the same number.
 *
 * Nodes of one depth are done in parallel; each is done by one worker in the order of its children, so the result does
 * not depend on the number of threads. */
#include "pack/tree.h"

#include <float.h>
#include <malloc.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "base/memory.h"
#include "base/parallel.h"
#include "pack/early.h"
#include "pack/level_scalars.h"
#include "pack/median.h"
#include "pack/prune.h"

/* Splats of a node as a share of its children's; never more than inner_most, which volumes would exceed level by level.
 */
static const double most = 0.28, wanted = 0.25, least = 0.20;
enum { look_grain = 32, attempts = 6, inner_most = 12288, pruned_inner_most = 768 };

/* Beside panels: how many times as wide as its splats lie apart a cell becomes, if not for the panels' sake; along a
 * wire a quarter of the splats asks for 4, lines of a scan that lie unevenly for up to twice as much. And how much
 * farther a disc reaches than its area. */
static const double beside_panels = 8, reach_most = 1.5;

/* Surfaces of a cell: their normals differ by more than so much (cosine), or their planes by such a share of the
 * cell. The fourth takes what faces its way at all. */
static const double same_facing = 0.6, same_plane = 0.15;
enum { surfaces_most = 4 };

struct cluster {
    uint64_t cell;
    uint32_t other; /* the cell's next cluster, 0 = none */
    uint32_t votes; /* of `classification`, majority by pairing off */
    uint8_t classification;
    float largest;
    double weight, length, linear, position[3], squared, normal[3], color[3], uncertainty;
};

struct scratch { /* of one worker */
    struct spl_spill *spill; /* where the arrays up to `numbers` lie: the points' */
    struct spl_inner_splat *input;
    struct cluster *clusters;
    uint32_t *table; /* cell -> cluster + 1 */
    uint32_t *of;    /* input -> cluster */
    uint32_t *numbers; /* of each input its scalars */
    struct spl_scalar_mixer mixer;
    size_t input_capacity, cluster_capacity, table_size;
    struct spl_panel_left left; /* points that were in panels below the node, and are splats from it on */
    struct spl_inner_splat *left_splats;
    uint32_t *left_numbers, left_count;
};

struct levels {
    struct spl_tree *tree;
    const struct spl_points *points;
    struct spl_stage *stage;
    struct scratch *scratch;
    const uint32_t *order; /* inner nodes of the depth at work */
    size_t scalars;        /* how many the points have */
    atomic_bool failed;
};

/* A point as a splat of `parent`. */
static void load_point(const struct spl_points *p, const struct spl_tree_node *parent, size_t i,
                       struct spl_inner_splat *out)
{
    for (int c = 0; c < 3; c++) {
        out->position[c] = (float)(spl_points_at(p, c, i) - parent->origin[c]);
        out->normal[c] = p->normal[i][c];
    }
    out->radius = p->radius[i];
    out->color_class = p->color_class[i];
    spl_inner_set(out, p->uncertainty[i], p->linear && p->linear[i]);
}

/* Puts the child's splats into w->input from `at` on, their positions relative to the parent's origin, and their
 * scalars beside them. Returns where they end. */
static size_t take_child(const struct levels *l, struct scratch *w, const struct spl_tree_node *parent,
                         const struct spl_tree_node *child, size_t at)
{
    if (child->child_count) {
        double shift[3];
        for (int c = 0; c < 3; c++)
            shift[c] = child->origin[c] - parent->origin[c];
        for (uint32_t i = 0; i < child->splat_count; i++, at++) {
            w->input[at] = child->splats[i];
            for (int c = 0; c < 3; c++)
                w->input[at].position[c] = (float)(shift[c] + child->splats[i].position[c]);
            for (size_t k = 0; k < l->scalars; k++)
                w->numbers[at * l->scalars + k] = child->numbers[(size_t)i * l->scalars + k];
        }
        return at;
    }
    spl_spill_keep_bound(l->points->spill);
    for (size_t i = child->begin; i < child->end; i++)
        if (!spl_panels_has_point(l->points, i)) {
            load_point(l->points, parent, i, &w->input[at]);
            spl_scalars_take_point(l->points, i, w->numbers + at++ * l->scalars);
        }
    return at;
}

static double median_radius(const struct spl_inner_splat *splats, size_t count, float *radii)
{
    size_t sample = count < 255 ? count : 255;
    for (size_t i = 0; i < sample; i++)
        radii[i] = splats[i * count / sample].radius;
    return spl_middle(radii, sample);
}

static uint64_t cell_of(const struct spl_inner_splat *s, double inverse)
{
    uint64_t cell = 0;
    for (int c = 0; c < 3; c++) {
        double v = s->position[c] * inverse;
        v = v > 0 ? v : 0;
        cell = cell << 21 | (uint64_t)(v < 2097151 ? v : 2097151);
    }
    return cell;
}

static double dot(const double a[3], const float b[3])
{
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
}

static void add_to(struct cluster *k, const struct spl_inner_splat *s)
{
    double w = (double)s->radius * s->radius;
    for (int c = 0; c < 3; c++) {
        k->position[c] += w * s->position[c];
        k->normal[c] += w * s->normal[c];
        k->color[c] += w * (s->color_class >> 8 * c & 255);
        k->squared += w * s->position[c] * s->position[c];
    }
    k->weight += w;
    k->length += s->radius;
    k->linear += spl_inner_is_linear(s) ? w : 0;
    k->uncertainty += w * spl_inner_get_uncertainty(s);
    k->largest = s->radius > k->largest ? s->radius : k->largest;
    uint8_t classification = s->color_class >> 24;
    if (k->votes == 0)
        k->classification = classification;
    k->votes += k->classification == classification ? 1 : -1u;
}

static struct cluster *add_cluster(struct scratch *w, size_t *clusters, uint64_t cell)
{
    struct cluster *k = &w->clusters[(*clusters)++];
    *k = (struct cluster){.cell = cell};
    return k;
}

/* The one of a cell's clusters, `first` and maybe another, that faces as the splat does, or a new one. */
static struct cluster *find_side(struct scratch *w, size_t *clusters, struct cluster *first,
                                 const struct spl_inner_splat *s)
{
    struct cluster *other = &w->clusters[first->other];
    if (!(dot(first->normal, s->normal) < 0))
        return first;
    if (first->other)
        return dot(other->normal, s->normal) > dot(first->normal, s->normal) ? other : first;
    first->other = (uint32_t)*clusters;
    return add_cluster(w, clusters, UINT64_MAX);
}

/* The one of a cell's clusters whose surface the splat lies on, or a new one. */
static struct cluster *find_surface(struct scratch *w, size_t *clusters, struct cluster *first, double cell,
                                    const struct spl_inner_splat *s)
{
    struct cluster *same = NULL, *alike = NULL, *last = NULL;
    double same_cosine = 0, alike_cosine = 0;
    unsigned count = 0;
    for (uint32_t at = (uint32_t)(first - w->clusters); at; at = last->other, count++) {
        double length = 0, off = 0, cosine;
        last = &w->clusters[at];
        for (int c = 0; c < 3; c++) {
            length += last->normal[c] * last->normal[c];
            off += last->normal[c] * (s->position[c] - last->position[c] / last->weight);
        }
        length = fmax(sqrt(length), DBL_MIN);
        cosine = dot(last->normal, s->normal) / length;
        if (cosine >= same_facing && fabs(off) <= same_plane * cell * length && (!same || cosine > same_cosine)) {
            same = last;
            same_cosine = cosine;
        }
        if (!alike || cosine > alike_cosine) {
            alike = last;
            alike_cosine = cosine;
        }
    }
    if (same || (count >= surfaces_most && alike_cosine >= 0))
        return same ? same : alike;
    last->other = (uint32_t)*clusters;
    return add_cluster(w, clusters, UINT64_MAX);
}

/* Clusters `count` splats, by sides or by surfaces; gives up once there are more than `limit` clusters. Cluster 0 is
 * unused. */
static size_t cluster(struct scratch *w, size_t count, double cell, size_t limit, bool surfaces)
{
    size_t clusters = 1, mask = w->table_size - 1;
    double inverse = 1 / cell;
    memset(w->table, 0, w->table_size * sizeof *w->table);
    for (size_t i = 0; i < count && clusters <= limit + 1; i++) {
        const struct spl_inner_splat *s = &w->input[i];
        uint64_t key = cell_of(s, inverse);
        size_t slot = (size_t)(key * 0x9e3779b97f4a7c15ull >> 20) & mask;
        while (w->table[slot] && w->clusters[w->table[slot]].cell != key)
            slot = (slot + 1) & mask;
        struct cluster *k = &w->clusters[w->table[slot]];
        if (!w->table[slot]) {
            w->table[slot] = (uint32_t)clusters;
            k = add_cluster(w, &clusters, key);
        } else {
            k = surfaces ? find_surface(w, &clusters, k, cell, s) : find_side(w, &clusters, k, s);
        }
        add_to(k, s);
        w->of[i] = (uint32_t)(k - w->clusters);
    }
    return clusters - 1;
}

struct clustering {
    struct scratch *scratch;
    size_t count;
};

/* spl_prune_clusters() */
static size_t cluster_surfaces(void *context, double cell)
{
    const struct clustering *c = context;
    return cluster(c->scratch, c->count, cell, c->count, true);
}

/* `farthest`: it reaches over its parts up to so many times the radius of their area, or what they do end to end. */
static void finish_cluster(const struct cluster *k, double cell, double farthest, struct spl_inner_splat *out)
{
    double mean2 = 0, length = 0, weight = k->weight;
    for (int c = 0; c < 3; c++) {
        double m = k->position[c] / weight;
        mean2 += m * m;
        length += k->normal[c] * k->normal[c];
        out->position[c] = (float)m;
    }
    length = sqrt(length);
    for (int c = 0; c < 3; c++)
        out->normal[c] = length > 0 ? (float)(k->normal[c] / length) : c == 2;
    double reach = fmin(sqrt(3 * fmax(0, k->squared / weight - mean2)), fmax(farthest * sqrt(weight), k->length));
    double radius = fmin(fmax(sqrt(weight), reach), 1.1284 * 1.4142 * cell);
    out->radius = fmaxf((float)radius, k->largest);
    out->color_class = (uint32_t)k->classification << 24;
    spl_inner_set(out, (float)(k->uncertainty / weight), 2 * k->linear > weight);
    for (int c = 0; c < 3; c++)
        out->color_class |= (uint32_t)(k->color[c] / weight + 0.5) << 8 * c;
}

/* Room for `count` inputs and their clusters, of which there may be `clusters`. */
static bool reserve(struct scratch *w, size_t count, size_t clusters, size_t scalars)
{
    struct spl_spill *spill = w->spill;
    if (count > w->input_capacity) {
        size_t table = 256;
        while (table < count)
            table *= 2;
        spl_spill_free(spill, w->input);
        spl_spill_free(spill, w->table);
        spl_spill_free(spill, w->of);
        spl_spill_free(spill, w->numbers);
        w->input_capacity = 0;
        w->input = spl_spill_alloc_raw(spill, count, sizeof *w->input, NULL);
        w->table = spl_spill_alloc_raw(spill, table, sizeof *w->table, NULL);
        w->of = spl_spill_alloc_raw(spill, count, sizeof *w->of, NULL);
        w->numbers = spl_spill_alloc_raw(spill, count * scalars + 1, sizeof *w->numbers, NULL);
        if (!w->input || !w->table || !w->of || !w->numbers)
            return false;
        w->input_capacity = count;
        w->table_size = table;
    }
    if (clusters > w->cluster_capacity) {
        spl_spill_free(spill, w->clusters);
        w->clusters = spl_spill_alloc_raw(spill, clusters, sizeof *w->clusters, NULL);
        w->cluster_capacity = w->clusters ? clusters : 0;
    }
    return w->cluster_capacity >= clusters;
}

/* Points that the node's panels have left become splats of their children's spacing: parts of its own. */
static bool make_left(struct levels *l, struct scratch *w, const struct spl_tree_node *node)
{
    const struct spl_panel_left *left = &w->left;
    free(w->left_splats);
    spl_spill_give(l->points->spill, w->left_numbers);
    w->left_splats = NULL;
    w->left_numbers = NULL;
    w->left_count = 0;
    if (!left->count)
        return true;
    if (!reserve(w, left->count, left->count + 2, l->scalars))
        return false;
    for (size_t i = 0; i < left->count; i++) {
        if (i % look_grain == 0)
            spl_spill_keep_bound(l->points->spill);
        load_point(l->points, node, left->points[i], &w->input[i]);
        spl_scalars_take_point(l->points, left->points[i], w->numbers + i * l->scalars);
    }
    size_t clusters = cluster(w, left->count, left->cell, left->count, l->tree->pruned_to > 0);
    w->left_splats = spl_alloc_raw(clusters, sizeof *w->left_splats, NULL);
    if (!w->left_splats)
        return false;
    for (size_t k = 0; k < clusters; k++)
        finish_cluster(&w->clusters[k + 1], left->cell, reach_most, &w->left_splats[k]);
    w->left_count = (uint32_t)clusters;
    return spl_scalars_mix(&w->mixer, l->points, w->numbers, w->of, w->input, left->count, clusters, &w->left_numbers);
}

static bool build_node(struct levels *l, unsigned worker, struct spl_tree_node *node)
{
    struct scratch *w = &l->scratch[worker];
    const struct spl_tree_node *children = l->tree->nodes + node->first_child;
    size_t count = 0, at = 0, clusters = 0;
    float radii[255];
    if (l->tree->panels &&
        (!spl_panels_make_inner(l->tree->panels, node, worker, &w->left) || !make_left(l, w, node)))
        return false;
    for (uint32_t c = 0; c < node->child_count; c++)
        count += children[c].splat_count;
    count += w->left_count;
    if (!count)
        return true; /* of panels alone */
    /* Nothing is coarser than the root: where it alone is to be left, it has just as many as are wanted. */
    bool last = node == l->tree->nodes && l->tree->pruned_to && l->tree->pruned_to < count && !l->tree->panels;
    const bool panels = l->tree->panels, surfaces = l->tree->pruned_to > 0;
    const size_t room = surfaces ? pruned_inner_most : inner_most;
    size_t clusters_most = last ? count : count / 3;
    if (panels && clusters_most < room)
        clusters_most = count < room ? count : room;
    if (!reserve(w, count, clusters_most + 8, l->scalars))
        return false;
    for (uint32_t c = 0; c < node->child_count; c++)
        at = take_child(l, w, node, &children[c], at);
    if (w->left_count) {
        memcpy(w->input + at, w->left_splats, w->left_count * sizeof *w->input);
        for (size_t k = 0; k < w->left_count * l->scalars; k++)
            w->numbers[at * l->scalars + k] = w->left_numbers[k];
    }

    double base = fmin((double)count, (double)room / most);
    size_t limit = base * most > 2 ? (size_t)(base * most) : 2; /* two opposed splats never become one */
    double cell = 2 * median_radius(w->input, count, radii) / 1.128379, too_fine = 0;
    const double widest = panels ? fmax(beside_panels * cell, 2 * w->left.cell) : INFINITY;
    if (last) {
        cell = spl_prune_find_cell(cluster_surfaces, &(struct clustering){w, count}, l->tree->pruned_to, cell);
        clusters = cluster(w, count, cell, count, true);
    }
    for (int attempt = 0; !last; attempt++) {
        /* In a large enough cell there are two sides, but as many surfaces as there are normals. */
        if (cell >= widest && limit < room)
            limit = count < room ? count : room;
        clusters = cluster(w, count, cell, limit, surfaces && attempt <= attempts);
        double share = (double)clusters / base;
        if (clusters > limit) {
            const double wider = cell * (attempt < attempts ? 1.25 : 2);
            too_fine = cell;
            cell = cell < widest ? fmin(wider, widest) : wider;
        } else if (share < least && attempt < attempts && cell * sqrt(share / wanted) > too_fine * 1.1) {
            cell *= sqrt(share / wanted);
        } else {
            break;
        }
    }
    node->splats = spl_spill_take(l->points->spill, clusters, sizeof *node->splats, NULL);
    if (!node->splats)
        return false;
    for (size_t k = 0; k < clusters; k++)
        finish_cluster(&w->clusters[k + 1], cell, panels ? reach_most : INFINITY, &node->splats[k]);
    node->splat_count = (uint32_t)clusters;
    return spl_scalars_mix(&w->mixer, l->points, w->numbers, w->of, w->input, count, clusters, &node->numbers);
}

static void build_nodes(void *context, size_t begin, size_t end, unsigned worker)
{
    struct levels *l = context;
    for (size_t i = begin; i < end; i++) {
        struct spl_tree_node *node = &l->tree->nodes[l->order[i]];
        if (!build_node(l, worker, node) ||
            (l->tree->early && !spl_early_encode_children(l->tree->early, node, worker)))
            atomic_store(&l->failed, true);
        if (atomic_load(&l->failed) || spl_stage_is_cancelled(l->stage))
            return;
        spl_stage_add(l->stage, 1, worker);
    }
}

int spl_levels_build(struct spl_tree *tree, const struct spl_points *points, struct spl_stage *stage,
                     struct spl_error *err)
{
    struct levels l = {.tree = tree, .points = points, .stage = stage};
    uint32_t *order = spl_alloc_raw(tree->count, sizeof *order, err);
    size_t inner = 0;
    int rc = 0;
    l.scratch = spl_alloc(stage->threads, sizeof *l.scratch, err);
    if (!order || !l.scratch) {
        rc = SPL_E_NOMEM;
        goto done;
    }
    l.order = order;
    for (unsigned t = 0; t < stage->threads; t++)
        l.scratch[t].spill = points->spill;
    int scalars[SPL_POINT_SCALARS];
    l.scalars = spl_points_list_scalars(points, scalars);
    for (uint32_t i = 0; i < tree->count; i++)
        if (tree->nodes[i].child_count)
            order[inner++] = i;
    spl_stage_begin(stage, "levels of detail", "nodes", inner);
    /* Breadth first order: each depth is a run of it. */
    for (size_t end = inner, begin; end > 0; end = begin) {
        for (begin = end; begin > 0 && tree->nodes[order[begin - 1]].depth == tree->nodes[order[end - 1]].depth;)
            begin--;
        l.order = order + begin;
        spl_parallel_for(stage->threads, end - begin, 1, build_nodes, &l);
        if (atomic_load(&l.failed)) {
            rc = spl_fail(err, SPL_E_NOMEM, "out of memory while building the levels of detail");
            goto done;
        }
        if ((rc = spl_stage_check(stage, err)))
            goto done;
    }
    spl_stage_end(stage);
done:
    for (unsigned t = 0; l.scratch && t < stage->threads; t++) {
        spl_spill_free(points->spill, l.scratch[t].input);
        spl_spill_free(points->spill, l.scratch[t].clusters);
        spl_spill_free(points->spill, l.scratch[t].table);
        spl_spill_free(points->spill, l.scratch[t].of);
        spl_spill_free(points->spill, l.scratch[t].numbers);
        free(l.scratch[t].left.points);
        free(l.scratch[t].left_splats);
        spl_spill_give(points->spill, l.scratch[t].left_numbers);
        spl_scalar_mixer_finish(&l.scratch[t].mixer);
    }
    free(l.scratch);
    free(order);
    malloc_trim(0); /* of the scratch */
    return rc;
}
