/* Level pieces that blocks cut are put together first, where their certain edges say so together: a roof is one piece
 * wherever the border of a block crosses it, and has its say for up by all of its points. Walls are not: noise between
 * thin fins may turn a wall's sign from one end to the other, which is for all votes to weigh, those of the floor too.
 * Then trees join by votes, as within a block (forest.c).
 *
 * What touches others only over gaps as wide as points are apart is told its side by chance: of the scene `interior` a
 * door's leaf, 1.6 % of its points, agrees with its room or not by how many points there are. */
#include "pack/orient_join.h"

#include <math.h>
#include <stdlib.h>

#include "base/memory.h"
#include "pack/spill.h"

static const double unsure = 0.25, doubt = 0.02, least = 256; /* of a tree's area; usual points of such a tree */

int spl_orient_join_init(struct spl_orient_join *join, struct spl_component *components, size_t count,
                         struct spl_spill *spill, struct spl_error *err)
{
    struct spl_forest *f = &join->forest;
    *join = (struct spl_orient_join){.components = components, .count = count, .spill = spill};
    f->parent = spl_alloc_raw(count, sizeof *f->parent, err);
    f->flip = spl_alloc(count, sizeof *f->flip, err);
    f->held = spl_alloc(count, sizeof *f->held, err);
    f->level = spl_alloc(count, sizeof *f->level, err);
    f->best = spl_alloc(count, sizeof *f->best, err);
    f->place = spl_alloc_raw(count, sizeof *f->place, err);
    if (!f->parent || !f->flip || !f->held || !f->level || !f->best || !f->place)
        return SPL_E_NOMEM;
    f->count = (uint32_t)count;
    for (uint32_t i = 0; i < f->count; i++) {
        f->parent[i] = i;
        f->held[i] = components[i].anchored ? SPL_TREE_ANCHORED : 0;
        f->level[i] = 0;
    }
    return SPL_OK;
}

void spl_orient_join_finish(struct spl_orient_join *join)
{
    free(join->forest.parent);
    free(join->forest.flip);
    free(join->forest.held);
    free(join->forest.level);
    free(join->forest.best);
    free(join->forest.place);
    spl_spill_free(join->spill, join->seams.list);
    spl_spill_free(join->spill, join->edges.list);
    *join = (struct spl_orient_join){0};
}

static int add(struct spl_orient_join *join, struct spl_orient_edges *edges, uint32_t a, uint32_t b, float agreement,
               struct spl_error *err)
{
    if (edges->count == edges->capacity) {
        size_t capacity = edges->capacity + edges->capacity / 2 + 4096;
        struct spl_forest_edge *more = spl_spill_realloc(join->spill, edges->list, capacity, sizeof *more, err);
        if (!more)
            return SPL_E_NOMEM;
        edges->list = more;
        edges->capacity = capacity;
    }
    uint32_t *place = &edges->recent[(a < b ? a * 31 + b : b * 31 + a) % SPL_ORIENT_RECENT];
    const struct spl_forest_edge *recent = &edges->list[*place];
    if (*place < edges->count && recent->a == (a < b ? a : b) && recent->b == (a < b ? b : a)) {
        spl_forest_add_edge(edges->list, *place + 1, a, b, agreement);
    } else {
        edges->count = spl_forest_add_edge(edges->list, edges->count, a, b, agreement);
        *place = (uint32_t)(edges->count - 1);
    }
    return SPL_OK;
}

int spl_orient_join_add(struct spl_orient_join *join, uint32_t a, uint32_t b, float agreement, bool seam,
                        struct spl_error *err)
{
    int rc = seam && spl_orient_is_certain(agreement) ? add(join, &join->seams, a, b, agreement, err) : SPL_OK;
    return rc ? rc : add(join, &join->edges, a, b, agreement, err);
}

/* How much of each tree is level, now that its pieces that go on are whole: of these what is large, and what their
 * components hold beside. */
static void count_level(struct spl_orient_join *join)
{
    struct spl_forest *f = &join->forest;
    uint8_t sign;
    for (uint32_t i = 0; i < f->count; i++) {
        uint32_t root = spl_forest_find_root(f, i, &sign);
        f->level[root] += sign ? -join->components[i].own : join->components[i].own;
    }
    for (uint32_t i = 0; i < f->count; i++)
        if (f->parent[i] == i && !spl_orient_is_large(f->level[i]))
            f->level[i] = 0;
    for (uint32_t i = 0; i < f->count; i++) {
        uint32_t root = spl_forest_find_root(f, i, &sign);
        f->level[root] += sign ? -join->components[i].level : join->components[i].level;
    }
    for (uint32_t i = 0; i < f->count; i++)
        if (f->held[i] & SPL_TREE_ANCHORED)
            f->level[i] = 0;
}

int spl_orient_join_decide(struct spl_orient_join *join, struct spl_error *err)
{
    struct spl_forest *f = &join->forest;
    struct spl_forest_edge *spare = spl_spill_alloc_raw(join->spill, join->edges.count, sizeof *spare, err);
    double *outward = spl_alloc(join->count, sizeof *outward, err), *area = spl_alloc(join->count, sizeof *area, err);
    bool enough = spare && outward && area;
    if (enough) {
        spl_forest_vote(f, join->seams.list, spare, join->seams.count);
        count_level(join);
        spl_forest_vote(f, join->edges.list, spare, join->edges.count);
    }
    for (uint32_t i = 0; enough && i < f->count; i++) {
        uint8_t sign;
        uint32_t root = spl_forest_find_root(f, i, &sign);
        outward[root] += sign ? -join->components[i].outward : join->components[i].outward;
        area[root] += join->components[i].area;
    }
    for (uint32_t i = 0; enough && i < f->count; i++) {
        uint8_t sign;
        uint32_t root = spl_forest_find_root(f, i, &sign);
        bool anchored = f->held[root] & SPL_TREE_ANCHORED;
        join->components[i].flip = sign ^ (!anchored && outward[root] < 0);
        join->components[i].unsure = !anchored && area[root] > least && fabs(outward[root]) < unsure * area[root];
        join->components[i].doubtful = join->components[i].unsure && fabs(outward[root]) < doubt * area[root];
        join->components[i].tree = root;
    }
    spl_spill_free(join->spill, spare);
    free(outward);
    free(area);
    return enough ? SPL_OK : SPL_E_NOMEM;
}
