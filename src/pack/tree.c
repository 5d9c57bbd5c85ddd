/* Octree by binary search over Morton order: a node is a range of points, its children are the eight ranges of the next
 * three key bits. A cube whose points all lie in one octant is replaced by that octant, so a dense cluster in a wide cloud
 * costs no chain of nodes. Below the keys' resolution a range is split into eight equal parts, which are compact too
 * because equal keys are ordered among themselves. One thread; milliseconds. */
#include "pack/tree.h"

#include <stdlib.h>

#include "base/memory.h"
#include "geom/morton.h"
#include "pack/order.h"

/* First point of [begin, end) whose key, above `shift`, is at least `prefix`. */
static size_t lower_bound(const struct spl_points *points, size_t begin, size_t end, unsigned shift, uint64_t prefix)
{
    while (begin < end) {
        size_t middle = begin + (end - begin) / 2;
        if (spl_points_key(points, middle) >> shift < prefix)
            begin = middle + 1;
        else
            end = middle;
    }
    return begin;
}

/* The smallest cube of the octree that holds the node's points; returns its level, 0 = the whole cloud. */
static unsigned shrink_cube(struct spl_tree_node *node, const struct spl_points *points)
{
    uint64_t first = spl_points_key(points, node->begin), last = spl_points_key(points, node->end - 1);
    unsigned level = SPL_MORTON_BITS;
    if (first != last)
        level = SPL_MORTON_BITS - 1 - (63 - (unsigned)__builtin_clzll(first ^ last)) / 3;
    uint32_t cell[3] = {0};
    for (unsigned bit = 0; bit < level; bit++)
        for (unsigned c = 0; c < 3; c++)
            cell[c] = cell[c] << 1 | (first >> (3 * (SPL_MORTON_BITS - 1 - bit) + c) & 1);
    node->size = points->cube_size / (double)(1u << level);
    for (unsigned c = 0; c < 3; c++)
        node->origin[c] = points->bounds_min[c] + cell[c] * node->size;
    return level;
}

/* Whether floats relative to the cube are too coarse for its smallest splat: positions are kept to 2^-25 of the cube. */
static bool too_wide(const struct spl_tree_node *node, const struct spl_points *points)
{
    float smallest = points->radius[node->begin];
    for (size_t i = node->begin; i < node->end; i++)
        smallest = points->radius[i] < smallest ? points->radius[i] : smallest;
    return node->size > smallest * (double)(1 << 18);
}

static int add_node(struct spl_tree *tree, size_t *capacity, size_t begin, size_t end, uint32_t depth,
                    struct spl_error *err)
{
    if (tree->count == *capacity) {
        size_t wanted = *capacity ? *capacity * 2 : 64;
        void *bigger = spl_realloc(tree->nodes, wanted, sizeof *tree->nodes, err);
        if (!bigger)
            return SPL_E_NOMEM;
        tree->nodes = bigger;
        *capacity = wanted;
    }
    tree->nodes[tree->count++] = (struct spl_tree_node){.begin = begin, .end = end, .depth = depth};
    tree->levels = depth + 1 > tree->levels ? depth + 1 : tree->levels;
    return 0;
}

int spl_tree_build(struct spl_tree *tree, const struct spl_points *points, struct spl_error *err)
{
    size_t capacity = 0;
    int rc = add_node(tree, &capacity, 0, points->count, 0, err);
    for (uint32_t i = 0; !rc && i < tree->count; i++) {
        struct spl_tree_node node = tree->nodes[i];
        unsigned level = shrink_cube(&node, points);
        size_t count = node.end - node.begin, at = node.begin;
        bool splits = level < SPL_MORTON_BITS && count > 1 && count <= SPL_LEAF_POINTS && too_wide(&node, points);
        if (count > SPL_LEAF_POINTS || splits) {
            node.first_child = tree->count;
            unsigned shift = level < SPL_MORTON_BITS ? 3 * (SPL_MORTON_BITS - 1 - level) : 0;
            uint64_t prefix = spl_points_key(points, node.begin) >> shift & ~(uint64_t)7;
            for (unsigned octant = 0; !rc && octant < 8; octant++) {
                size_t end = level < SPL_MORTON_BITS
                    ? lower_bound(points, at, node.end, shift, prefix + octant + 1)
                    : node.begin + count * (octant + 1) / 8;
                if (end > at)
                    rc = add_node(tree, &capacity, at, end, node.depth + 1, err);
                at = end;
            }
            node.child_count = tree->count - node.first_child;
        } else {
            node.splat_count = (uint32_t)count;
        }
        tree->nodes[i] = node;
    }
    return rc;
}

void spl_tree_finish(struct spl_tree *tree)
{
    for (uint32_t i = 0; i < tree->count; i++)
        free(tree->nodes[i].splats);
    free(tree->nodes);
    *tree = (struct spl_tree){0};
}
