/* Signs of normals by growing a forest over the neighbour graph, most certain edges first.
 *
 * Two neighbouring normals agree in sign when one, mirrored in the plane between the points, resembles the other: that
 * is right on a plane and around a corner alike, where the plain scalar product is a coin toss. Edges are taken in a
 * few passes of falling certainty, in index order, so the result depends on nothing but the points. Blocks are done in
 * parallel; their components are then joined over the edges between blocks in the same way. */
#include "pack/orient.h"

#include <math.h>
#include <stdlib.h>

#include "base/memory.h"

static const float certainty[] = {0.9f, 0.6f, 0.3f, 0.0f};
enum { passes = sizeof certainty / sizeof *certainty };

int spl_orient_init(struct spl_orient *orient, size_t capacity, struct spl_error *err)
{
    orient->parent = spl_alloc_raw(capacity, sizeof *orient->parent, err);
    orient->flip = spl_alloc_raw(capacity, sizeof *orient->flip, err);
    orient->label = spl_alloc_raw(capacity, sizeof *orient->label, err);
    orient->anchored = spl_alloc_raw(capacity, sizeof *orient->anchored, err);
    return orient->parent && orient->flip && orient->label && orient->anchored ? 0 : SPL_E_NOMEM;
}

void spl_orient_finish(struct spl_orient *orient)
{
    free(orient->parent);
    free(orient->flip);
    free(orient->label);
    free(orient->anchored);
}

float spl_orient_agreement(const struct spl_points *points, size_t i, size_t j)
{
    const float *a = points->normal[i], *b = points->normal[j];
    float e[3], ee = 0, ea = 0, eb = 0, ab = 0;
    for (int c = 0; c < 3; c++) {
        e[c] = (float)(points->axis[c][j] - points->axis[c][i]);
        ee += e[c] * e[c];
        ea += e[c] * a[c];
        eb += e[c] * b[c];
        ab += a[c] * b[c];
    }
    return ee > 0 ? ab - 2 * ea * eb / ee : ab;
}

/* The root of `i`, with the sign of i relative to it; halves the path. */
static uint32_t find_root(uint32_t *parent, uint8_t *flip, uint32_t i, uint8_t *sign)
{
    uint8_t s = 0;
    while (parent[i] != i) {
        uint32_t up = parent[i];
        if (parent[up] != up) {
            flip[i] ^= flip[up];
            parent[i] = parent[up];
        }
        s ^= flip[i];
        i = parent[i];
    }
    *sign = s;
    return i;
}

/* Joins the trees of a and b; the smaller root stays, so that roots precede their trees. Anchored trees keep their
 * sign, so two of them never join. */
static void join(uint32_t *parent, uint8_t *flip, uint8_t *anchored, uint32_t a, uint32_t b, bool opposed)
{
    uint8_t sa, sb;
    uint32_t ra = find_root(parent, flip, a, &sa), rb = find_root(parent, flip, b, &sb);
    if (ra == rb || (anchored[ra] && anchored[rb]))
        return;
    if (ra < rb ? anchored[rb] : !anchored[ra]) {
        uint32_t r = ra;
        ra = rb;
        rb = r;
    }
    parent[rb] = ra;
    flip[rb] = sa ^ sb ^ opposed;
}

uint32_t spl_orient_block(struct spl_orient *orient, struct spl_points *points, size_t begin, size_t end,
                          const uint32_t *neighbours, unsigned k)
{
    uint32_t n = (uint32_t)(end - begin), components = 0, first_anchored = UINT32_MAX;
    for (uint32_t i = 0; i < n; i++) {
        if (orient->anchored[i] && first_anchored == UINT32_MAX)
            first_anchored = i;
        orient->parent[i] = orient->label[i] = orient->anchored[i] ? first_anchored : i;
        orient->flip[i] = 0;
    }
    for (int pass = 0; pass < passes; pass++) {
        for (uint32_t i = 0; i < n; i++) {
            for (unsigned a = 0; a < k; a++) {
                uint32_t j = neighbours[(size_t)i * k + a];
                /* Mutual neighbours meet twice: the first pass, which settles nearly all, takes them once. */
                if (j < begin || j >= end || (pass == 0 && j - begin > i))
                    continue;
                j -= (uint32_t)begin;
                if (orient->label[i] == orient->label[j])
                    continue;
                float agreement = spl_orient_agreement(points, begin + i, begin + j);
                if (fabsf(agreement) >= certainty[pass])
                    join(orient->parent, orient->flip, orient->anchored, i, j, agreement < 0);
            }
        }
        for (uint32_t i = 0; i < n; i++) {
            uint8_t sign;
            orient->label[i] = find_root(orient->parent, orient->flip, i, &sign);
        }
    }
    for (uint32_t i = 0; i < n; i++) {
        uint8_t sign;
        find_root(orient->parent, orient->flip, i, &sign);
        for (int c = 0; sign && c < 3; c++)
            points->normal[begin + i][c] = -points->normal[begin + i][c];
    }
    /* Roots are numbered where they stand; parent is free to hold the numbers now. */
    for (uint32_t i = 0; i < n; i++)
        if (orient->label[i] == i)
            orient->parent[i] = components++;
    for (uint32_t i = 0; i < n; i++)
        orient->label[i] = orient->parent[orient->label[i]];
    return components;
}

int spl_orient_components(struct spl_component *components, size_t count, const struct spl_orient_edge *edges,
                          size_t edge_count, struct spl_error *err)
{
    uint32_t *parent = spl_alloc_raw(count, sizeof *parent, err);
    uint8_t *flip = spl_alloc(count, 1, err), *anchored = spl_alloc_raw(count, 1, err);
    double *up = spl_alloc(count, sizeof *up, err);
    int rc = SPL_E_NOMEM;
    if (!parent || !flip || !anchored || !up)
        goto done;
    for (size_t i = 0; i < count; i++) {
        parent[i] = (uint32_t)i;
        anchored[i] = components[i].anchored;
    }
    for (int pass = 0; pass < passes; pass++)
        for (size_t e = 0; e < edge_count; e++)
            if (fabsf(edges[e].agreement) >= certainty[pass])
                join(parent, flip, anchored, edges[e].a, edges[e].b, edges[e].agreement < 0);
    for (size_t i = 0; i < count; i++) {
        uint8_t sign;
        uint32_t root = find_root(parent, flip, (uint32_t)i, &sign);
        up[root] += sign ? -components[i].up : components[i].up;
    }
    for (size_t i = 0; i < count; i++) {
        uint8_t sign;
        uint32_t root = find_root(parent, flip, (uint32_t)i, &sign);
        components[i].flip = sign ^ (!anchored[root] && up[root] < 0);
    }
    rc = 0;
done:
    free(parent);
    free(flip);
    free(anchored);
    free(up);
    return rc;
}
