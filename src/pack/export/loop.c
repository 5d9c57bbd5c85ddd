/* A border and its holes as one loop, for formats whose faces have no holes: from the rightmost vertex of each hole,
 * the rightmost hole first, a cut runs to the right to what it meets first, gets a vertex there, and is walked there
 * and back. Nothing lies between, so cuts cross nothing. O(holes * vertices) of a polygon. */
#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "base/array.h"
#include "base/memory.h"
#include "pack/export/outline.h"

struct hole {
    double right;
    uint32_t ring, vertex; /* its rightmost */
};

static int compare(const void *a, const void *b)
{
    const struct hole *x = a, *y = b;
    if (x->right != y->right)
        return x->right > y->right ? -1 : 1;
    return x->ring < y->ring ? -1 : x->ring > y->ring;
}

/* The piece of the loop that a ray from `at` to the right meets first, and where; false: none. */
static bool meet(const struct spl_outline *o, const uint32_t *loop, uint32_t count, const double at[2], uint32_t *piece,
                 double *where)
{
    *where = INFINITY;
    for (uint32_t i = 0; i < count; i++) {
        const double *a = o->vertices[loop[i]], *b = o->vertices[loop[i + 1 < count ? i + 1 : 0]];
        if ((a[1] > at[1]) == (b[1] > at[1]))
            continue;
        double x = a[0] + (at[1] - a[1]) / (b[1] - a[1]) * (b[0] - a[0]);
        if (x < at[0] || x >= *where)
            continue;
        *where = x;
        *piece = i;
    }
    return *where < INFINITY;
}

static int cut(struct spl_outline *o, struct spl_polygon *p, const struct hole *hole, struct spl_error *err)
{
    const struct spl_ring ring = o->rings[hole->ring];
    uint32_t piece = 0, *loop;
    double at[2] = {o->vertices[hole->vertex][0], o->vertices[hole->vertex][1]}, where;
    if (!meet(o, o->loop + p->loop, p->loops, at, &piece, &where)) /* it was moved across the border: it stays a ring */
        return 0;
    int rc = spl_array_reserve(o->vertices, o->vertex_capacity, o->vertex_count + 1, err);
    if (!rc)
        rc = spl_array_reserve(o->loop, o->loop_capacity, o->loop_count + ring.count + 3, err);
    if (rc)
        return rc;
    uint32_t met = (uint32_t)o->vertex_count++;
    o->vertices[met][0] = where;
    o->vertices[met][1] = at[1];
    loop = o->loop + p->loop;
    memmove(loop + piece + 1 + ring.count + 3, loop + piece + 1, (p->loops - piece - 1) * sizeof *loop);
    loop += piece + 1;
    *loop++ = met;
    for (uint32_t i = 0; i <= ring.count; i++)
        *loop++ = ring.first + (hole->vertex - ring.first + i) % ring.count;
    *loop = met;
    p->loops += ring.count + 3;
    o->loop_count += ring.count + 3;
    return 0;
}

int spl_outline_add_loop(struct spl_outline *o, struct spl_polygon *p, struct spl_error *err)
{
    const struct spl_ring *border = &o->rings[p->ring];
    struct hole *holes = spl_alloc_raw(p->rings, sizeof *holes, err);
    int rc = holes ? spl_array_reserve(o->loop, o->loop_capacity, o->loop_count + border->count, err) : SPL_E_NOMEM;
    if (!rc) {
        p->loop = (uint32_t)o->loop_count;
        p->loops = border->count;
        for (uint32_t i = 0; i < border->count; i++)
            o->loop[o->loop_count++] = border->first + i;
    }
    for (uint32_t k = 1; !rc && k < p->rings; k++) {
        const struct spl_ring *ring = &o->rings[p->ring + k];
        holes[k - 1] = (struct hole){-INFINITY, p->ring + k, ring->first};
        for (uint32_t i = ring->first; i < ring->first + ring->count; i++)
            if (o->vertices[i][0] > holes[k - 1].right) {
                holes[k - 1].right = o->vertices[i][0];
                holes[k - 1].vertex = i;
            }
    }
    if (!rc)
        qsort(holes, p->rings - 1, sizeof *holes, compare);
    for (uint32_t k = 0; !rc && k + 1 < p->rings; k++)
        rc = cut(o, p, &holes[k], err);
    free(holes);
    return rc;
}
