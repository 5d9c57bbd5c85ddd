/* Trees join where votes are strongest. Pure; whoever has the forest owns it.
 *
 * Each tree joins the one that it has most votes with, all edges between the two together; then votes are counted
 * again, until no two trees touch. So two halves of a road are not joined by way of the bush that stands on both. Votes
 * are integers: what comes of them depends on nothing but the points.
 *
 * Where nobody says what is seen, what is level mostly is ground or a roof, and shows upwards. A wall with ground on
 * both of its sides tells one of them to show downwards, and so does a bush half of the time. So where two trees join
 * that hold large level pieces, "both up" has votes of its own: a fraction of what the whole border of these would
 * have. A ceiling hangs on its walls by all of its border, and they still tell it to show down. */
#include "pack/forest.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#define FOREST_VOTE (1 << 20)   /* of an edge whose ends agree */
static const double border = 1; /* votes for "both up" of what is level and has a point; sqrt(n) times as many of n */

size_t spl_forest_add_edge(struct spl_forest_edge *edges, size_t count, uint32_t a, uint32_t b, float agreement)
{
    struct spl_forest_edge edge = {a < b ? a : b, a < b ? b : a, lrintf(agreement * FOREST_VOTE)};
    if (count > 0 && edges[count - 1].a == edge.a && edges[count - 1].b == edge.b)
        edges[count - 1].votes += edge.votes;
    else
        edges[count++] = edge;
    return count;
}

void spl_forest_join(struct spl_forest *f, uint32_t a, uint32_t b, bool opposed)
{
    uint8_t sa, sb;
    uint32_t ra = spl_forest_find_root(f, a, &sa), rb = spl_forest_find_root(f, b, &sb);
    if (ra == rb || (f->held[ra] & f->held[rb] & SPL_TREE_ANCHORED))
        return;
    if (ra < rb ? f->held[rb] & SPL_TREE_ANCHORED : !(f->held[ra] & SPL_TREE_ANCHORED)) {
        uint32_t r = ra;
        ra = rb;
        rb = r;
    }
    f->parent[rb] = ra;
    f->flip[rb] = sa ^ sb ^ opposed;
    f->held[ra] |= f->held[rb];
    if (!(f->held[ra] & SPL_TREE_ANCHORED))
        f->level[ra] += f->flip[rb] ? -f->level[rb] : f->level[rb];
}

static int compare_edges(const void *a, const void *b)
{
    const struct spl_forest_edge *x = a, *y = b;
    return (x->b > y->b) - (x->b < y->b);
}

/* Makes one of all edges that have the same second end; those that are left are in its order. Returns how many. `at`
 * tells of each end where its edge may be. */
static size_t unite_run(struct spl_forest_edge *edges, size_t count, uint32_t *at)
{
    enum { few = 32 };
    size_t kept = 0;
    for (size_t e = 0; e < count; e++) {
        struct spl_forest_edge edge = edges[e];
        uint32_t to = at[edge.b];
        if (to < kept && edges[to].b == edge.b) {
            edges[to].votes += edge.votes;
        } else {
            at[edge.b] = (uint32_t)kept;
            edges[kept++] = edge;
        }
    }
    if (kept > few)
        qsort(edges, kept, sizeof *edges, compare_edges);
    for (size_t e = 1; kept <= few && e < kept; e++) {
        struct spl_forest_edge edge = edges[e];
        size_t to = e;
        for (; to > 0 && edges[to - 1].b > edge.b; to--)
            edges[to] = edges[to - 1];
        edges[to] = edge;
    }
    return kept;
}

/* Moves the edges to the roots of their ends, one for all of the same two, and leaves out those that can't join. Leaves
 * them by their ends. `spare` has room for as many. */
static size_t unite(struct spl_forest *f, struct spl_forest_edge *edges, struct spl_forest_edge *spare, size_t count)
{
    uint32_t *place = f->place, sum = 0;
    size_t moved = 0, kept = 0;
    memset(place, 0, f->count * sizeof *place);
    for (size_t i = 0; i < count; i++) {
        uint8_t sa, sb;
        uint32_t a = spl_forest_find_root(f, edges[i].a, &sa), b = spl_forest_find_root(f, edges[i].b, &sb);
        if (a == b || (f->held[a] & f->held[b] & (SPL_TREE_ANCHORED | SPL_TREE_WAITS)))
            continue;
        edges[moved] =
            (struct spl_forest_edge){a < b ? a : b, a < b ? b : a, sa == sb ? edges[i].votes : -edges[i].votes};
        place[edges[moved++].a]++;
    }
    for (uint32_t i = 0; i < f->count; i++) {
        uint32_t here = place[i];
        place[i] = sum;
        sum += here;
    }
    for (size_t e = 0; e < moved; e++)
        spare[place[edges[e].a]++] = edges[e];
    for (size_t begin = 0, end; begin < moved; begin = end) {
        end = place[spare[begin].a];
        size_t run = unite_run(spare + begin, end - begin, f->best);
        memcpy(edges + kept, spare + begin, run * sizeof *edges);
        kept += run;
    }
    return kept;
}

static void take_best(struct spl_forest *f, const struct spl_forest_edge *edges, uint32_t root, size_t edge)
{
    if (f->held[root] & SPL_TREE_WAITS)
        return;
    if (f->best[root] == UINT32_MAX || llabs(edges[edge].votes) > llabs(edges[f->best[root]].votes))
        f->best[root] = (uint32_t)edge;
}

/* Votes for two roots to show to the same side, by what is level in their trees. */
static int64_t count_up(const struct spl_forest *f, uint32_t a, uint32_t b)
{
    int64_t x = f->level[a], y = f->level[b], least = llabs(x) < llabs(y) ? llabs(x) : llabs(y);
    int64_t votes = llrint(border * sqrt((double)least) * FOREST_VOTE);
    return (x < 0) == (y < 0) ? votes : -votes;
}

/* Joins the trees of an edge's ends. Where up says something else than the edge, and one of the two trees has joined
 * another in this round, there may be more edges between them: then it waits until these are counted together. */
static void join_ends(struct spl_forest *f, const struct spl_forest_edge *edge)
{
    uint8_t sa, sb;
    uint32_t a = spl_forest_find_root(f, edge->a, &sa), b = spl_forest_find_root(f, edge->b, &sb);
    int64_t up = sa == sb ? count_up(f, a, b) : -count_up(f, a, b);
    bool opposed = edge->votes + up < 0;
    if (opposed != (edge->votes < 0) && (f->place[a] || f->place[b]))
        return;
    spl_forest_join(f, edge->a, edge->b, opposed);
    f->place[a] = f->place[b] = 1;
}

/* Each round joins at least the two whose edge is the first of those with most votes, and mostly halves the number of
 * trees. */
void spl_forest_vote(struct spl_forest *f, struct spl_forest_edge *edges, struct spl_forest_edge *spare, size_t count)
{
    while ((count = unite(f, edges, spare, count)) > 0) {
        for (size_t e = 0; e < count; e++) {
            f->best[edges[e].a] = f->best[edges[e].b] = UINT32_MAX;
            f->place[edges[e].a] = f->place[edges[e].b] = 0;
        }
        for (size_t e = 0; e < count; e++) {
            take_best(f, edges, edges[e].a, e);
            take_best(f, edges, edges[e].b, e);
        }
        for (size_t e = 0; e < count; e++)
            if (f->best[edges[e].a] == e || f->best[edges[e].b] == e)
                join_ends(f, &edges[e]);
    }
}
