/* The cut that loses least for its number of splats. The losses of the nodes are found in parallel, each by one worker;
 * then a slope says of each node, from the deepest up, whether its children are worth their splats, and the slope whose
 * cut has the number wanted is found by halving. Sums are made in the order of nodes and chunks, so the cut does not
 * depend on the number of threads. The caller's thread. */
#include "pack/prune.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "base/memory.h"
#include "base/parallel.h"
#include "pack/prune_loss.h"

struct cut {
    double slope;
    uint64_t splats;
};

struct plan {
    struct spl_prune_loss input;
    uint64_t nodes, before; /* leaf splats before */
    double *loss;            /* of inner nodes; 0 of leaves */
    double *least;           /* loss + slope * splats, of the best cut below each node */
    uint64_t *count, *below; /* splats of the node; leaf splats below it, or its own */
    uint64_t *left;          /* leaf splats that the dataset has of it where it is drawn; their number is asked for */
    uint8_t *steps;          /* levels above the lowest leaf below it */
    bool *leaf, *gone;       /* the cut: loses its children; lies below one that does */
    bool *split;             /* is split where the slope is just too small */
    struct spl_prune_shapes **shapes; /* by worker */
    struct spl_stage *stage;
    atomic_bool failed;
};

static void find_losses(void *context, size_t begin, size_t end, unsigned worker)
{
    struct plan *p = context;
    for (size_t n = begin; n < end; n++) {
        if (!p->input.nodes[n].child_count)
            continue;
        if (atomic_load(&p->failed) || spl_stage_is_cancelled(p->stage))
            return;
        p->loss[n] = spl_prune_get_loss(&p->input, n, p->below[n], p->shapes[worker]);
        if (p->loss[n] < 0)
            atomic_store(&p->failed, true);
        spl_stage_add(p->stage, 1, worker);
    }
}

static void count_splats(struct plan *p)
{
    for (uint64_t n = p->nodes; n-- > 0;) {
        const struct spl_node *node = &p->input.nodes[n];
        p->count[n] = spl_prune_count(&p->input, n);
        p->left[n] = spl_prune_left(&p->input, n);
        p->below[n] = node->child_count ? 0 : p->count[n];
        p->steps[n] = 0;
        for (uint64_t c = node->first_child; c < node->first_child + node->child_count; c++) {
            p->below[n] += p->below[c];
            p->steps[n] = p->steps[c] + 1 > p->steps[n] ? p->steps[c] + 1 : p->steps[n];
        }
    }
}

static bool is_drawn(const struct plan *p, uint64_t node)
{
    return !p->gone[node] && (p->leaf[node] || !p->input.nodes[node].child_count);
}

/* Says of each node whether it is gone, from the root down; returns how many splats are drawn. */
static uint64_t drop(struct plan *p)
{
    const struct spl_node *nodes = p->input.nodes;
    uint64_t splats = 0;
    p->gone[0] = false;
    for (uint64_t n = 0; n < p->nodes; n++) {
        p->leaf[n] = p->leaf[n] && !p->gone[n] && nodes[n].child_count;
        for (uint64_t c = nodes[n].first_child; c < nodes[n].first_child + nodes[n].child_count; c++)
            p->gone[c] = p->gone[n] || p->leaf[n];
        splats += is_drawn(p, n) ? p->left[n] : 0;
    }
    return splats;
}

/* Sets leaf[] to the best cut at a slope; returns how many splats it has. */
static uint64_t cut_at(struct plan *p, double slope)
{
    const struct spl_node *nodes = p->input.nodes;
    for (uint64_t n = p->nodes; n-- > 0;) {
        double whole = p->loss[n] + slope * (double)p->count[n], split = 0;
        for (uint64_t c = nodes[n].first_child; c < nodes[n].first_child + nodes[n].child_count; c++)
            split += p->least[c];
        p->leaf[n] = !nodes[n].child_count || whole <= split;
        p->least[n] = p->leaf[n] ? whole : split;
    }
    return drop(p);
}

static double steps_off(double splats, double wanted)
{
    return fabs(log2(fmax(splats, 1) / wanted));
}

/* Of two cuts at neighbouring slopes none may be near what is wanted: where no level between is worth it, noise for
 * one, a whole branch goes at once. From the one with fewer splats, which is set, nodes that the other splits are split
 * level by level for as long as that comes closer. */
static uint64_t fill_gap(struct plan *p, uint64_t splats, double wanted)
{
    const struct spl_node *nodes = p->input.nodes;
    for (uint64_t n = 0; n < p->nodes; n++) {
        uint64_t more = splats - p->left[n], first = nodes[n].first_child, end = first + nodes[n].child_count;
        for (uint64_t c = first; c < end; c++)
            more += p->left[c];
        if (!p->leaf[n] || !p->split[n] || steps_off((double)more, wanted) >= steps_off((double)splats, wanted))
            continue;
        p->leaf[n] = false;
        for (uint64_t c = first; c < end; c++) {
            p->leaf[c] = nodes[c].child_count;
            p->gone[c] = false;
        }
        splats = more;
    }
    return splats;
}

/* Sets leaf[] to the cut that comes closest to one of `factor` leaf splats: between the last slope with as many, which
 * is halved down to, and the first with fewer. */
static struct cut find_cut(struct plan *p, double factor)
{
    memset(p->leaf, 0, p->nodes);
    p->before = drop(p);
    struct cut many = {0, p->before}, few = {1, 0};
    const double wanted = (double)p->before / factor;
    if (factor <= 1)
        return many;
    while ((few.splats = cut_at(p, few.slope)) > wanted && few.slope < 4 * (double)p->below[0]) {
        many = few;
        few.slope *= 2;
    }
    for (int i = 0; i < 64 && many.splats > few.splats; i++) {
        struct cut middle = {.slope = (many.slope + few.slope) / 2};
        middle.splats = cut_at(p, middle.slope);
        *((double)middle.splats > wanted ? &many : &few) = middle;
    }
    cut_at(p, many.slope);
    for (uint64_t n = 0; n < p->nodes; n++)
        p->split[n] = !p->gone[n] && !is_drawn(p, n);
    cut_at(p, few.slope);
    few.splats = fill_gap(p, few.splats, wanted);
    return few;
}

static void fill_report(const struct plan *p, double factor, const struct cut *cut, struct spl_prune_report *report)
{
    *report = (struct spl_prune_report){.before = p->before, .after = cut->splats, .slope = cut->slope};
    for (uint64_t n = 0; n < p->nodes; n++) {
        if (!is_drawn(p, n))
            continue;
        report->by_steps[p->steps[n] < SPL_PRUNE_STEPS ? p->steps[n] : SPL_PRUNE_STEPS - 1] += p->left[n];
        report->dense += (double)p->count[n] * factor > 2 * (double)p->below[n] ? p->left[n] : 0;
        report->lost += p->leaf[n] ? p->loss[n] / (double)p->below[0] : 0;
    }
}

static int allocate(struct plan *p, struct spl_error *err)
{
    p->loss = spl_alloc(p->nodes, sizeof *p->loss, err);
    p->least = spl_alloc(p->nodes, sizeof *p->least, err);
    p->count = spl_alloc_raw(p->nodes, sizeof *p->count, err);
    p->left = spl_alloc_raw(p->nodes, sizeof *p->left, err);
    p->below = spl_alloc_raw(p->nodes, sizeof *p->below, err);
    p->steps = spl_alloc_raw(p->nodes, sizeof *p->steps, err);
    p->gone = spl_alloc_raw(p->nodes, sizeof *p->gone, err);
    p->split = spl_alloc_raw(p->nodes, sizeof *p->split, err);
    p->shapes = spl_alloc(p->stage->threads, sizeof(struct spl_prune_shapes *), err);
    if (!p->loss || !p->least || !p->count || !p->left || !p->below || !p->steps || !p->gone || !p->split || !p->shapes)
        return SPL_E_NOMEM;
    for (unsigned t = 0; t < p->stage->threads; t++)
        if (!(p->shapes[t] = spl_prune_shapes_create(err)))
            return SPL_E_NOMEM;
    return SPL_OK;
}

int spl_prune_plan(const struct spl_dataset *dataset, const struct spl_prune_options *options, bool *leaf,
                   struct spl_prune_report *report, struct spl_stage *stage, struct spl_error *err)
{
    if (!(options->factor >= 1 && options->factor <= SPL_PRUNE_FACTOR_MAX))
        return spl_fail_field(err, SPL_E_USAGE, "prune", "%g; of so many splats about one stays, 1 to %d",
                              options->factor, SPL_PRUNE_FACTOR_MAX);
    uint64_t chunk_count;
    struct plan p = {.leaf = leaf, .stage = stage};
    p.input = (struct spl_prune_loss){
        .dataset = dataset, .options = options, .chunks = spl_dataset_get_chunks(dataset, &chunk_count)};
    p.input.nodes = spl_dataset_get_nodes(dataset, &p.nodes);
    int rc = allocate(&p, err);
    if (rc)
        goto done;
    count_splats(&p);
    spl_stage_begin(stage, "pruning", "nodes", p.nodes);
    spl_parallel_for(stage->threads, p.nodes, 1, find_losses, &p);
    if (atomic_load(&p.failed))
        rc = spl_fail(err, SPL_E_NOMEM, "out of memory while pruning");
    if (rc || (rc = spl_stage_check(stage, err)))
        goto done;
    struct cut cut = find_cut(&p, options->factor);
    fill_report(&p, options->factor, &cut, report);
    spl_stage_finish(stage);
done:
    for (unsigned t = 0; p.shapes && t < stage->threads; t++)
        spl_prune_shapes_destroy(p.shapes[t]);
    free(p.shapes);
    free(p.loss);
    free(p.least);
    free(p.count);
    free(p.left);
    free(p.below);
    free(p.steps);
    free(p.gone);
    free(p.split);
    return rc;
}
