/* Built top-down with the exact surface-area heuristic: scenes have some thousand primitives, so sorting at each level
 * costs milliseconds and buys the best tree. Below `sah_depth` nodes are halved by count, which bounds the depth and so
 * the fixed stack of a hit. Building belongs to one thread. */
#include "synth/bvh.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "base/memory.h"

enum { leaf_max = 4, sah_depth = 40, stack_max = sah_depth + 32 };

struct item {
    double bounds[2][3];
    double middle[3];
    uint32_t index;
};

struct build {
    struct item *items;
    double *area; /* of what lies right of a split, scratch */
    struct spl_bvh_node *nodes;
    uint32_t used;
};

static void grow(double box[2][3], double other[2][3])
{
    for (int i = 0; i < 3; i++) {
        box[0][i] = fmin(box[0][i], other[0][i]);
        box[1][i] = fmax(box[1][i], other[1][i]);
    }
}

static double half_area(double box[2][3])
{
    double x = box[1][0] - box[0][0], y = box[1][1] - box[0][1], z = box[1][2] - box[0][2];
    return x * y + y * z + z * x;
}

/* Ties are broken by index, so that the tree (and with it the order of equal hits) does not depend on qsort. */
static int compare(const void *a, const void *b, void *axis)
{
    const struct item *first = a, *second = b;
    double difference = first->middle[*(int *)axis] - second->middle[*(int *)axis];
    if (difference != 0)
        return difference < 0 ? -1 : 1;
    return first->index < second->index ? -1 : 1;
}

/* The cheapest place to split items sorted along an axis: cost is the sum of area × count over both sides. */
static double best_split(struct build *b, struct item *items, size_t count, size_t *split)
{
    double box[2][3], best = INFINITY;
    memcpy(box, items[count - 1].bounds, sizeof box);
    for (size_t i = count; i-- > 1;) {
        grow(box, items[i].bounds);
        b->area[i] = half_area(box);
    }
    memcpy(box, items[0].bounds, sizeof box);
    for (size_t i = 1; i < count; i++) {
        grow(box, items[i - 1].bounds);
        double cost = half_area(box) * (double)i + b->area[i] * (double)(count - i);
        if (cost < best) {
            best = cost;
            *split = i;
        }
    }
    return best;
}

static void split_node(struct build *b, size_t begin, size_t end, unsigned depth)
{
    struct spl_bvh_node *node = &b->nodes[b->used++];
    struct item *items = b->items + begin;
    size_t count = end - begin, split = count / 2;
    memcpy(node->bounds, items[0].bounds, sizeof node->bounds);
    for (size_t i = 1; i < count; i++)
        grow(node->bounds, items[i].bounds);
    if (count <= leaf_max) {
        node->first = (uint32_t)begin;
        node->count = (uint16_t)count;
        node->axis = 0;
        return;
    }
    int axis = 0;
    double best = INFINITY;
    for (int a = 0; a < 3; a++) {
        size_t place = count / 2;
        qsort_r(items, count, sizeof *items, compare, &a);
        double cost = best_split(b, items, count, &place);
        if (cost < best) {
            best = cost;
            axis = a;
            split = place;
        }
    }
    if (depth >= sah_depth)
        split = count / 2;
    qsort_r(items, count, sizeof *items, compare, &axis);
    node->count = 0;
    node->axis = (uint16_t)axis;
    split_node(b, begin, begin + split, depth + 1);
    node->first = b->used;
    split_node(b, begin + split, end, depth + 1);
}

int spl_bvh_build(struct spl_primitive *primitives, size_t count, struct spl_bvh_node **nodes, struct spl_error *err)
{
    struct build b = {.items = spl_alloc_raw(count, sizeof *b.items, err),
                      .area = spl_alloc_raw(count, sizeof *b.area, err),
                      .nodes = spl_alloc_raw(2 * count, sizeof *b.nodes, err)};
    struct spl_primitive *ordered = spl_alloc_raw(count, sizeof *ordered, err);
    int result = SPL_E_NOMEM;
    if (!b.items || !b.area || !b.nodes || !ordered)
        goto done;
    for (size_t i = 0; i < count; i++) {
        struct item *item = &b.items[i];
        item->index = (uint32_t)i;
        spl_primitive_bounds(&primitives[i], item->bounds);
        for (int a = 0; a < 3; a++)
            item->middle[a] = (item->bounds[0][a] + item->bounds[1][a]) / 2;
    }
    split_node(&b, 0, count, 0);
    for (size_t i = 0; i < count; i++)
        ordered[i] = primitives[b.items[i].index];
    memcpy(primitives, ordered, count * sizeof *ordered);
    *nodes = b.nodes;
    b.nodes = NULL;
    result = 0;
done:
    free(ordered);
    free(b.nodes);
    free(b.area);
    free(b.items);
    return result;
}

/* Where the ray enters the box, INFINITY when it misses it before `t`. A NaN (a ray in a face's plane: 0 × ∞) loses
 * every comparison, so it never narrows the interval. */
static inline double entry(const struct spl_bvh_node *node, const double o[3], const double inverse[3],
                           const int negative[3], double t)
{
    double from = 0, to = t;
    for (int i = 0; i < 3; i++) {
        double first = (node->bounds[negative[i]][i] - o[i]) * inverse[i];
        double last = (node->bounds[!negative[i]][i] - o[i]) * inverse[i];
        from = first > from ? first : from;
        to = last < to ? last : to;
    }
    return from <= to ? from : INFINITY;
}

bool spl_bvh_hit(const struct spl_bvh_node *nodes, const struct spl_primitive *primitives, const double origin[3],
                 const double direction[3], double *t, uint32_t *index)
{
    struct {
        uint32_t node;
        double t;
    } stack[stack_max];
    double inverse[3] = {1 / direction[0], 1 / direction[1], 1 / direction[2]};
    int negative[3] = {inverse[0] < 0, inverse[1] < 0, inverse[2] < 0};
    int depth = 0;
    bool found = false;
    uint32_t at = 0;
    if (isinf(entry(&nodes[0], origin, inverse, negative, *t)))
        return false;
    for (;;) {
        const struct spl_bvh_node *node = &nodes[at];
        if (node->count) {
            for (uint32_t i = node->first; i < node->first + node->count; i++) {
                if (spl_primitive_hit(&primitives[i], origin, direction, t)) {
                    *index = i;
                    found = true;
                }
            }
        } else {
            uint32_t near = at + 1, far = node->first;
            double near_t = entry(&nodes[near], origin, inverse, negative, *t);
            double far_t = entry(&nodes[far], origin, inverse, negative, *t);
            if (far_t < near_t) {
                uint32_t n = near;
                double nt = near_t;
                near = far;
                near_t = far_t;
                far = n;
                far_t = nt;
            }
            if (!isinf(far_t)) {
                stack[depth].node = far;
                stack[depth++].t = far_t;
            }
            if (!isinf(near_t)) {
                at = near;
                continue;
            }
        }
        do {
            if (!depth)
                return found;
        } while (stack[--depth].t >= *t);
        at = stack[depth].node;
    }
}
