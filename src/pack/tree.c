/* Octree by binary search over Morton order: a node is a range of points, its children are the eight ranges of the next
 * three key bits. A cube whose points all lie in one octant is replaced by that octant, so a dense cluster in a wide
 * cloud costs no chain of nodes. Points of equal keys go on in the cube around themselves that spl_points_order()
 * ordered them in. One thread; milliseconds. */
#include "pack/tree.h"

#include <math.h>
#include <stdlib.h>

#include "base/array.h"
#include "geom/morton.h"
#include "pack/order.h"

enum { grain = 1 << 16 };

static uint64_t key_of(const struct spl_tree_node *node, const struct spl_points *points, size_t i)
{
    return spl_points_key(points, i, node->frame_low, node->frame_size);
}

/* First point of [begin, node->end) whose key, above `shift`, is at least `prefix`. */
static size_t lower_bound(const struct spl_tree_node *node, const struct spl_points *points, size_t begin,
                          unsigned shift, uint64_t prefix)
{
    size_t end = node->end;
    while (begin < end) {
        spl_spill_keep_bound(points->spill); /* each is in pages of its own */
        size_t middle = begin + (end - begin) / 2;
        if (key_of(node, points, middle) >> shift < prefix)
            begin = middle + 1;
        else
            end = middle;
    }
    return begin;
}

/* The cube around the node's points, as spl_points_order() takes it. */
static void frame_points(struct spl_tree_node *node, const struct spl_points *points)
{
    node->frame_size = 0;
    for (int c = 0; c < 3; c++) {
        double low = spl_points_at(points, c, node->begin), high = low;
        for (size_t i = node->begin; i < node->end; i++) {
            if (i % grain == 0)
                spl_spill_keep_bound(points->spill);
            low = fmin(low, spl_points_at(points, c, i));
            high = fmax(high, spl_points_at(points, c, i));
        }
        node->frame_low[c] = low;
        node->frame_size = fmax(node->frame_size, high - low);
    }
}

/* The smallest cube of the octree that holds the node's points, in `parent`'s (NULL for the root); returns the shift of
 * the key bits that divide it. */
static unsigned shrink_cube(struct spl_tree_node *node, const struct spl_tree_node *parent,
                            const struct spl_points *points)
{
    uint64_t first = key_of(node, points, node->begin), last = key_of(node, points, node->end - 1);
    if (first == last && node->end - node->begin > 1) {
        frame_points(node, points);
        first = key_of(node, points, node->begin);
        last = key_of(node, points, node->end - 1);
    }
    unsigned level = SPL_MORTON_BITS;
    if (first != last)
        level = SPL_MORTON_BITS - 1 - (63 - (unsigned)__builtin_clzll(first ^ last)) / 3;
    uint32_t cell[3] = {0};
    for (unsigned bit = 0; bit < level; bit++)
        for (unsigned c = 0; c < 3; c++)
            cell[c] = cell[c] << 1 | (first >> (3 * (SPL_MORTON_BITS - 1 - bit) + c) & 1);
    node->size = node->frame_size / (double)(1u << level);
    for (unsigned c = 0; c < 3; c++) {
        node->origin[c] = node->frame_low[c] + cell[c] * node->size;
        if (parent) /* a cube around points may stand out of the cell that they lie in */
            node->origin[c] = fmin(node->origin[c], parent->origin[c] + parent->size - node->size);
    }
    return level < SPL_MORTON_BITS ? 3 * (SPL_MORTON_BITS - 1 - level) : 0;
}

/* Whether floats relative to the cube are too coarse for its smallest splat: positions are kept to 2^-25 of the cube.
 */
static bool too_wide(const struct spl_tree_node *node, const struct spl_points *points)
{
    float smallest = points->radius[node->begin];
    for (size_t i = node->begin; i < node->end; i++) {
        if (i % grain == 0)
            spl_spill_keep_bound(points->spill);
        smallest = points->radius[i] < smallest ? points->radius[i] : smallest;
    }
    return node->size > smallest * (double)(1 << 18);
}

static int add_node(struct spl_tree *tree, size_t *capacity, const struct spl_tree_node *node, struct spl_error *err)
{
    if (spl_array_reserve(tree->nodes, *capacity, (size_t)tree->count + 1, err))
        return SPL_E_NOMEM;
    tree->nodes[tree->count++] = *node;
    tree->levels = node->depth + 1 > tree->levels ? node->depth + 1 : tree->levels;
    return 0;
}

/* Pruning splits and joins whole nodes: of a small scan they are finer, so that it comes near what is wanted. */
static size_t most_points(const struct spl_tree *tree, const struct spl_points *points)
{
    size_t most = tree->pruned_to / 16;
    if (!tree->pruned_to)
        return SPL_LEAF_POINTS;
    if (points->plane || most > SPL_PRUNED_LEAF_POINTS) /* small nodes would cut panels to pieces */
        return SPL_PRUNED_LEAF_POINTS;
    return most > SPL_PRUNED_LEAF_LEAST ? most : SPL_PRUNED_LEAF_LEAST;
}

int spl_tree_build(struct spl_tree *tree, const struct spl_points *points, struct spl_error *err)
{
    size_t capacity = 0, most = most_points(tree, points);
    struct spl_tree_node root = {.end = points->count, .frame_size = points->cube_size};
    for (int c = 0; c < 3; c++)
        root.frame_low[c] = points->cube_min[c];
    tree->spill = points->spill;
    int rc = add_node(tree, &capacity, &root, err);
    for (uint32_t i = 0; !rc && i < tree->count; i++) {
        struct spl_tree_node node = tree->nodes[i];
        spl_spill_keep_bound(points->spill);
        unsigned shift = shrink_cube(&node, i ? &tree->nodes[node.parent] : NULL, points);
        size_t count = node.end - node.begin, at = node.begin;
        if (count > most || (count > 1 && too_wide(&node, points))) {
            struct spl_tree_node child = {.parent = i, .depth = node.depth + 1, .frame_size = node.frame_size};
            for (int c = 0; c < 3; c++)
                child.frame_low[c] = node.frame_low[c];
            node.first_child = tree->count;
            uint64_t prefix = key_of(&node, points, node.begin) >> shift & ~(uint64_t)7;
            for (unsigned octant = 0; !rc && octant < 8; octant++) {
                child.begin = at;
                child.end = at = lower_bound(&node, points, at, shift, prefix + octant + 1);
                if (child.end > child.begin)
                    rc = add_node(tree, &capacity, &child, err);
            }
            node.child_count = tree->count - node.first_child;
        } else {
            node.splat_count = (uint32_t)count;
        }
        tree->nodes[i] = node;
    }
    return rc;
}

void spl_tree_drop_splats(struct spl_tree *tree, uint32_t node)
{
    struct spl_tree_node *n = &tree->nodes[node];
    if (n->splats)
        spl_spill_discard(tree->spill, n->splats, n->splat_count * sizeof *n->splats);
    spl_spill_give(tree->spill, n->splats);
    spl_spill_give(tree->spill, n->numbers);
    n->splats = NULL;
    n->numbers = NULL;
}

void spl_tree_finish(struct spl_tree *tree)
{
    for (uint32_t i = 0; i < tree->count; i++) {
        spl_tree_drop_splats(tree, i);
        if (tree->nodes[i].panels)
            spl_node_panels_finish(tree->nodes[i].panels);
        free(tree->nodes[i].panels);
    }
    free(tree->nodes);
    *tree = (struct spl_tree){0};
}
