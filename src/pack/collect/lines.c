/* Lines of tiles' roots: wires, poles and cables, as the vertices that they have there. Above the tiles they are what
 * lines of any node are, simplified for its spacing. A piece belongs to its tile; once tiles are in their places, a
 * node's pieces are those of the tiles below it. The caller's thread. */
#include <math.h>
#include <stdlib.h>

#include "base/array.h"
#include "base/memory.h"
#include "dataset/chunk.h"
#include "pack/collect/collect.h"

static double length_between(const struct spl_wire_vertex *a, const struct spl_wire_vertex *b)
{
    double squared = 0;
    for (int c = 0; c < 3; c++)
        squared += (a->position[c] - b->position[c]) * (a->position[c] - b->position[c]);
    return sqrt(squared);
}

/* Each vertex of a line knows how long the whole of it is. */
static void measure(struct spl_wire_vertex *v, uint32_t count)
{
    for (uint32_t begin = 0, end; begin < count; begin = end + 1) {
        double length = 0;
        for (end = begin; v[end].point != SPL_WIRE_END && end + 1 < count; end++)
            length += length_between(&v[end], &v[end + 1]);
        for (uint32_t i = begin; i <= end; i++)
            v[i].length = (float)length;
    }
}

int spl_collect_take_lines(struct spl_collect *c, const struct spl_chunk *chunk, const double origin[3],
                           const uint32_t *page, struct spl_error *err)
{
    struct spl_wires *w = &c->wires;
    if (w->count + chunk->count >= SPL_WIRE_END)
        return spl_fail_field(err, SPL_E_LIMIT, "inputs", "the tiles' roots have more than %u vertices of lines; "
                                                          "collect fewer",
                              SPL_WIRE_END);
    if (spl_array_reserve(w->vertices, w->capacity, w->count + chunk->count, err))
        return SPL_E_NOMEM;
    struct spl_wire_vertex *v = w->vertices + w->count;
    for (uint32_t i = 0; i < chunk->count; i++) {
        struct spl_splat splat;
        spl_chunk_decode(chunk, page, i, &splat);
        v[i] = (struct spl_wire_vertex){.radius = splat.radius,
                                        .width = (float)spl_chunk_line_width(chunk),
                                        .point = splat.linear && i + 1 < chunk->count ? 0 : SPL_WIRE_END};
        for (int a = 0; a < 3; a++) {
            v[i].position[a] = origin[a] + (double)splat.position[a];
            v[i].normal[a] = splat.normal[a];
            v[i].color_class |= (uint32_t)splat.color[a] << 8 * a;
        }
        if (!(splat.radius > 0 && (double)splat.radius <= SPL_COLLECT_MOST))
            return spl_fail(err, SPL_E_CORRUPT,
                            "a vertex of a line in a tile's root has radius %g; pack the tile again",
                            (double)splat.radius);
    }
    measure(v, chunk->count);
    w->with_widths |= spl_chunk_line_width(chunk) > 0;
    w->count += chunk->count;
    return SPL_OK;
}

int spl_collect_place_lines(struct spl_collect *c, struct spl_tree *tree, uint32_t first, uint32_t inner,
                            struct spl_error *err)
{
    struct spl_wires *w = &c->wires;
    for (uint32_t i = inner; i-- > 0;) {
        struct spl_tree_node *node = &tree->nodes[i];
        const struct spl_tree_node *child = tree->nodes + node->first_child;
        node->begin = i >= first ? i - first : child[0].begin;
        node->end = i >= first ? node->begin + 1 : child[node->child_count - 1].end;
    }
    if (!w->count)
        return SPL_OK;
    w->pieces = spl_alloc_raw(w->count, sizeof *w->pieces, err);
    if (!w->pieces)
        return SPL_E_NOMEM;
    for (size_t i = 0; i < c->count; i++)
        for (size_t v = c->tiles[i].first_vertex; v < c->tiles[i].end_vertex; v++)
            if (w->vertices[v].point != SPL_WIRE_END) {
                w->vertices[v].point = (uint32_t)i;
                w->pieces[w->piece_count++] = (uint32_t)v;
            }
    return SPL_OK;
}
