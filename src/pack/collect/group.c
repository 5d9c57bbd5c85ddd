/* The tree over the tiles: neighbours along the Morton curve, up to eight a node, level by level up to one root. All
 * tiles are of one depth, so a level's nodes lie one behind the other, and the tiles' own roots, which are leaves while
 * the levels are built and are not written, lie last. A parent's cube is centred on its children's, as large as these
 * together and twice as large as the largest. One thread; milliseconds. */
#include <float.h>
#include <math.h>
#include <stdlib.h>

#include "base/memory.h"
#include "geom/morton.h"
#include "pack/collect/collect.h"

enum { children_most = 8, levels_most = 8 };

struct placed {
    uint64_t key;
    size_t tile; /* by name */
};

static int by_key(const void *a, const void *b)
{
    const struct placed *one = a, *other = b;
    return one->key != other->key ? (one->key < other->key ? -1 : 1)
                                  : (one->tile > other->tile) - (one->tile < other->tile);
}

static double middle_of(const struct spl_collect_tile *tile, int axis)
{
    return tile->root.origin[axis] + (double)tile->root.size / 2;
}

/* By the middles of their cubes, of equal ones by name. */
static int sort_by_place(struct spl_collect *c, struct spl_error *err)
{
    double low[3], size = 0;
    struct placed *places = spl_alloc_raw(c->count, sizeof *places, err);
    struct spl_collect_tile *sorted = spl_alloc_raw(c->count, sizeof *sorted, err);
    for (int a = 0; a < 3 && places && sorted; a++) {
        double high = low[a] = middle_of(&c->tiles[0], a);
        for (size_t i = 1; i < c->count; i++) {
            low[a] = fmin(low[a], middle_of(&c->tiles[i], a));
            high = fmax(high, middle_of(&c->tiles[i], a));
        }
        size = fmax(size, high - low[a]);
    }
    if (!places || !sorted) {
        free(places);
        free(sorted);
        return SPL_E_NOMEM;
    }
    for (size_t i = 0; i < c->count; i++) {
        uint32_t cell[3];
        for (int a = 0; a < 3; a++)
            cell[a] = size > 0 ? spl_morton_cell(middle_of(&c->tiles[i], a), low[a], size) : 0;
        places[i] = (struct placed){spl_morton_encode(cell[0], cell[1], cell[2]), i};
    }
    qsort(places, c->count, sizeof *places, by_key);
    for (size_t i = 0; i < c->count; i++)
        sorted[i] = c->tiles[places[i].tile];
    free(places);
    free(c->tiles);
    c->tiles = sorted;
    c->capacity = c->count;
    return SPL_OK;
}

/* The cube around a node's children; its size is a float, as it is written. */
static void enclose(const struct spl_tree *tree, struct spl_tree_node *node)
{
    double low[3], high[3], size = 0;
    const struct spl_tree_node *child = tree->nodes + node->first_child;
    for (int a = 0; a < 3; a++) {
        low[a] = INFINITY;
        high[a] = -INFINITY;
        for (uint32_t k = 0; k < node->child_count; k++) {
            low[a] = fmin(low[a], child[k].origin[a]);
            high[a] = fmax(high[a], child[k].origin[a] + child[k].size);
            size = fmax(size, 2 * child[k].size);
        }
        size = fmax(size, high[a] - low[a]);
    }
    node->size = (double)nextafterf((float)size, (double)(float)size < size ? INFINITY : (float)size);
    for (int a = 0; a < 3; a++)
        node->origin[a] = low[a] + (high[a] - low[a]) / 2 - node->size / 2;
}

/* As a reader will see them. */
static bool fits(const struct spl_tree_node *parent, const struct spl_tree_node *child)
{
    struct spl_node nodes[2] = {{.size = (float)parent->size}, {.size = (float)child->size, .depth = 1}};
    for (int a = 0; a < 3; a++) {
        nodes[0].origin[a] = parent->origin[a];
        nodes[1].origin[a] = child->origin[a];
    }
    return !spl_node_judge_child(&nodes[0], &nodes[1]);
}

static int set_cubes(const struct spl_collect *c, struct spl_tree *tree, uint32_t inner, struct spl_error *err)
{
    for (uint32_t i = 0; i < c->count; i++) {
        struct spl_tree_node *leaf = &tree->nodes[inner + i];
        for (int a = 0; a < 3; a++)
            leaf->origin[a] = c->tiles[i].root.origin[a];
        leaf->size = (double)c->tiles[i].root.size;
        leaf->begin = c->tiles[i].begin;
        leaf->end = c->tiles[i].end;
        leaf->splat_count = (uint32_t)(leaf->end - leaf->begin);
    }
    for (uint32_t i = inner; i-- > 0;) {
        struct spl_tree_node *node = &tree->nodes[i];
        enclose(tree, node);
        bool good = node->size < (double)FLT_MAX;
        for (uint32_t k = 0; k < node->child_count; k++) {
            tree->nodes[node->first_child + k].parent = i;
            good = good && fits(node, &tree->nodes[node->first_child + k]);
        }
        if (!good)
            return spl_fail_field(err, SPL_E_LIMIT, "inputs",
                                  "the tiles lie farther apart (%g) than coordinates can say; collect those of one "
                                  "place",
                                  node->size);
    }
    return SPL_OK;
}

int spl_collect_group(struct spl_collect *c, struct spl_tree *tree, uint32_t *first, uint32_t *inner,
                      struct spl_error *err)
{
    size_t width[levels_most] = {c->count}, total = c->count; /* from the tiles up */
    uint32_t levels = 1, at = 0;
    int rc = sort_by_place(c, err);
    if (rc)
        return rc;
    for (; width[levels - 1] > 1; levels++) {
        spl_assert(levels < levels_most);
        width[levels] = (width[levels - 1] + children_most - 1) / children_most;
    }
    for (uint32_t k = 0; k < levels; k++)
        total += width[k];
    tree->nodes = spl_alloc(total, sizeof *tree->nodes, err);
    if (!tree->nodes)
        return SPL_E_NOMEM;
    tree->count = (uint32_t)total;
    tree->levels = levels;
    *inner = (uint32_t)(total - c->count);
    for (uint32_t depth = 0; depth < levels; depth++) {
        size_t nodes = width[levels - 1 - depth], below = depth + 1 < levels ? width[levels - 2 - depth] : c->count;
        uint32_t next = at + (uint32_t)nodes;
        *first = at;
        for (size_t i = 0; i < nodes; i++) { /* an even share of the level below each */
            size_t begin = i * below / nodes, end = (i + 1) * below / nodes;
            tree->nodes[at++] = (struct spl_tree_node){
                .first_child = next + (uint32_t)begin, .child_count = (uint32_t)(end - begin), .depth = depth};
        }
    }
    for (size_t i = 0; i < c->count; i++)
        tree->nodes[at + i].depth = levels;
    return set_cubes(c, tree, *inner, err);
}
