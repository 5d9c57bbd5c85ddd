/* A stack in place of recursion, so that depth costs no more than room for the vertices' numbers. A ring is cut at two
 * vertices far from each other: of a rectangle, corners. Pure; the same for any caller. */
#include "pack/export/simplify.h"

#include <math.h>
#include <string.h>

static double squared(const double a[3], const double b[3])
{
    double sum = 0;
    for (int c = 0; c < 3; c++)
        sum += (a[c] - b[c]) * (a[c] - b[c]);
    return sum;
}

/* From `p` to the piece from a to b. */
static double squared_off(const double p[3], const double a[3], const double b[3])
{
    double along = 0, length = squared(a, b), at[3];
    for (int c = 0; c < 3; c++)
        along += (p[c] - a[c]) * (b[c] - a[c]);
    double t = length > 0 ? fmin(1, fmax(0, along / length)) : 0;
    for (int c = 0; c < 3; c++)
        at[c] = a[c] + t * (b[c] - a[c]);
    return squared(p, at);
}

static size_t farthest(const double (*vertices)[3], size_t count, const double from[3])
{
    size_t best = 0;
    double most = -1;
    for (size_t i = 0; i < count; i++) {
        double d = squared(vertices[i], from);
        if (d > most) {
            most = d;
            best = i;
        }
    }
    return best;
}

/* Vertices between `from` and `to`, which are kept; beyond count - 1 they begin anew. */
static void cut(const double (*vertices)[3], size_t count, size_t from, size_t to, double limit, uint8_t *kept,
                size_t *stack)
{
    size_t depth = 0;
    stack[depth++] = from;
    stack[depth++] = to;
    while (depth) {
        size_t last = stack[--depth], first = stack[--depth], best = first;
        double most = limit;
        for (size_t i = first + 1; i < last; i++) {
            double d = squared_off(vertices[i % count], vertices[first % count], vertices[last % count]);
            if (d > most) {
                most = d;
                best = i;
            }
        }
        if (best == first)
            continue;
        kept[best % count] = 1;
        stack[depth++] = first;
        stack[depth++] = best;
        stack[depth++] = best;
        stack[depth++] = last;
    }
}

size_t spl_simplify(const double (*vertices)[3], size_t count, bool ring, double tolerance, uint8_t *kept,
                    size_t *stack)
{
    size_t from = ring ? farthest(vertices, count, vertices[0]) : 0;
    size_t to = ring ? farthest(vertices, count, vertices[from]) : count - 1, left = 0;
    memset(kept, 0, count);
    kept[from] = kept[to] = 1;
    if (to < from)
        to += count;
    cut(vertices, count, from, to, tolerance * tolerance, kept, stack);
    if (ring)
        cut(vertices, count, to, from + count, tolerance * tolerance, kept, stack);
    for (size_t i = 0; i < count; i++)
        left += kept[i];
    return left;
}
