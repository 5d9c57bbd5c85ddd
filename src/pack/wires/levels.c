/* A node's share of the wires: its pieces, put together to lines, and these simplified (Douglas and Peucker). Each
 * level is made of what was joined, not of the level below, so errors do not add up. A long line is simplified in
 * stretches, which bounds the work by its length. Any thread. */
#include "pack/wires/wires.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "base/memory.h"
#include "dataset/format.h" /* SPL_RADIUS_SPACING */

enum { stretch = 1024 }; /* vertices that are simplified together */

static bool reserve_pieces(struct spl_node_lines *out, size_t pieces)
{
    if (pieces <= out->piece_capacity)
        return true;
    free(out->pieces);
    free(out->kept);
    out->piece_capacity = 0;
    out->pieces = spl_alloc_raw(pieces, sizeof *out->pieces, NULL);
    out->kept = spl_alloc_raw(pieces + 1, sizeof *out->kept, NULL);
    if (!out->pieces || !out->kept)
        return false;
    out->piece_capacity = pieces;
    return true;
}

static bool reserve_vertices(struct spl_node_lines *out, size_t vertices)
{
    if (vertices <= out->capacity)
        return true;
    free(out->vertices);
    out->capacity = 0;
    out->vertices = spl_alloc_raw(vertices, sizeof *out->vertices, NULL);
    if (!out->vertices)
        return false;
    out->capacity = vertices;
    return true;
}

static int compare_indices(const void *a, const void *b)
{
    uint32_t p = *(const uint32_t *)a, q = *(const uint32_t *)b;
    return (p > q) - (p < q);
}

/* First piece whose point is at least `point`. */
static size_t lower_bound(const struct spl_wires *w, size_t point)
{
    size_t low = 0, high = w->piece_count;
    while (low < high) {
        size_t middle = low + (high - low) / 2;
        if (w->vertices[w->pieces[middle]].point < point)
            low = middle + 1;
        else
            high = middle;
    }
    return low;
}

/* Squared distance of `at` from the straight line between two vertices. */
static double squared_off(const double from[3], const double to[3], const double at[3])
{
    double along = 0, length = 0, squared = 0;
    for (int c = 0; c < 3; c++) {
        along += (at[c] - from[c]) * (to[c] - from[c]);
        length += (to[c] - from[c]) * (to[c] - from[c]);
    }
    double t = length > 0 ? fmin(fmax(along / length, 0), 1) : 0;
    for (int c = 0; c < 3; c++) {
        double off = from[c] + t * (to[c] - from[c]) - at[c];
        squared += off * off;
    }
    return squared;
}

/* Says which of `count` vertices stay; at most `stretch` of them, of which the ends do. */
static void thin_out(const struct spl_wire_vertex *v, size_t count, double error, uint8_t *kept)
{
    uint16_t stack[stretch][2];
    size_t depth = 0;
    memset(kept, 0, count);
    kept[0] = kept[count - 1] = 1;
    stack[depth][0] = 0;
    stack[depth++][1] = (uint16_t)(count - 1);
    while (depth) {
        uint16_t from = stack[--depth][0], to = stack[depth][1], at = from;
        double most = error * error;
        for (uint16_t i = from + 1; i < to; i++) {
            double squared = squared_off(v[from].position, v[to].position, v[i].position);
            if (squared > most) {
                most = squared;
                at = i;
            }
        }
        if (at == from)
            continue;
        kept[at] = 1;
        stack[depth][0] = from;
        stack[depth++][1] = at;
        stack[depth][0] = at;
        stack[depth++][1] = to;
    }
}

/* Vertex `at` with the mean colour and normal of vertices [first, last], which it stands for. */
static struct spl_wire_vertex mean_vertex(const struct spl_wire_vertex *v, size_t at, size_t first, size_t last,
                                          double spacing)
{
    struct spl_wire_vertex out = v[at];
    double color[3] = {0}, normal[3] = {0}, squared = 0, count = (double)(last - first + 1);
    for (size_t i = first; i <= last; i++)
        for (int c = 0; c < 3; c++) {
            color[c] += v[i].color_class >> 8 * c & 255;
            normal[c] += (double)v[i].normal[c];
        }
    out.color_class &= 255u << 24;
    for (int c = 0; c < 3; c++) {
        out.color_class |= (uint32_t)(color[c] / count + 0.5) << 8 * c;
        squared += normal[c] * normal[c];
    }
    for (int c = 0; c < 3 && squared > 1e-6; c++)
        out.normal[c] = (float)(normal[c] / sqrt(squared));
    out.radius = fmaxf(out.radius, (float)(spacing * SPL_RADIUS_SPACING));
    return out;
}

/* Appends the line of vertices [0, count), simplified; the last one ends it. False: a node has no room for all of
 * it. */
static bool add_simplified(struct spl_node_lines *out, const struct spl_wire_vertex *v, size_t count, size_t most,
                           double spacing, double error)
{
    for (size_t first = 0; first + 1 < count; first += stretch - 1) {
        size_t left = count - first;
        thin_out(v + first, left < stretch ? left : stretch, error, out->kept + first);
    }
    for (size_t at = 0, before = 0; at < count;) {
        size_t next = at + 1;
        while (next < count && !out->kept[next])
            next++;
        size_t last = next < count ? at + (next - at) / 2 : at;
        if (out->count == most)
            return false;
        out->vertices[out->count++] = mean_vertex(v, at, before, last, spacing);
        before = last + 1;
        at = next;
    }
    out->vertices[out->count - 1].point = SPL_WIRE_END;
    return true;
}

/* Where the run of consecutive pieces that begins at `i` ends: a line of one vertex more than it has pieces. */
static size_t end_of_run(const struct spl_node_lines *out, size_t i, size_t pieces)
{
    for (i++; i < pieces && out->pieces[i] == out->pieces[i - 1] + 1;)
        i++;
    return i;
}

/* The lines as they were joined. False: no memory. */
static bool copy_lines(const struct spl_wires *w, size_t pieces, struct spl_node_lines *out)
{
    size_t runs = 0;
    for (size_t i = 0; i < pieces; i = end_of_run(out, i, pieces))
        runs++;
    if (!reserve_vertices(out, pieces + runs))
        return false;
    for (size_t i = 0, end; i < pieces; i = end) {
        end = end_of_run(out, i, pieces);
        memcpy(out->vertices + out->count, &w->vertices[out->pieces[i]], (end - i + 1) * sizeof *out->vertices);
        out->count += end - i + 1;
        out->vertices[out->count - 1].point = SPL_WIRE_END;
    }
    return true;
}

/* The lines as they were joined, but for vertices that the bound does not need. False: no memory. */
static bool simplify_leaf(const struct spl_wires *w, size_t pieces, struct spl_node_lines *out)
{
    if (!reserve_vertices(out, 2 * pieces))
        return false;
    for (size_t i = 0, end; i < pieces; i = end) {
        const struct spl_wire_vertex *v = &w->vertices[out->pieces[i]];
        double error = w->error > 0 ? w->error : SPL_WIRES_WIDTH_ERROR * v->width;
        end = end_of_run(out, i, pieces);
        add_simplified(out, v, end - i + 1, out->capacity, 0, error);
    }
    return true;
}

/* The lines of a level; false where a node has no room for all of their vertices. */
static bool simplify_lines(const struct spl_wires *w, size_t pieces, double spacing, double coarse,
                           struct spl_node_lines *out)
{
    out->count = 0;
    for (size_t i = 0, end; i < pieces; i = end) {
        const struct spl_wire_vertex *v = &w->vertices[out->pieces[i]];
        end = end_of_run(out, i, pieces);
        if (v->length >= SPL_WIRES_SHORTEST * coarse &&
            !add_simplified(out, v, end - i + 1, SPL_NODE_VERTICES, spacing, SPL_WIRES_ERROR * coarse))
            return false;
    }
    return true;
}

bool spl_wires_get_node(const struct spl_wires *wires, size_t begin, size_t end, double spacing,
                        struct spl_node_lines *out)
{
    size_t first = lower_bound(wires, begin), pieces = lower_bound(wires, end) - first;
    out->count = 0;
    if (!pieces)
        return true;
    if (!reserve_pieces(out, pieces))
        return false;
    memcpy(out->pieces, wires->pieces + first, pieces * sizeof *out->pieces);
    qsort(out->pieces, pieces, sizeof *out->pieces, compare_indices);
    if (spacing <= 0)
        return wires->with_widths ? simplify_leaf(wires, pieces, out) : copy_lines(wires, pieces, out);
    if (!reserve_vertices(out, 2 * pieces < SPL_NODE_VERTICES ? 2 * pieces : SPL_NODE_VERTICES))
        return false;
    for (double coarse = spacing; !simplify_lines(wires, pieces, spacing, coarse, out);)
        coarse *= 2;
    return true;
}

void spl_node_lines_finish(struct spl_node_lines *lines)
{
    free(lines->vertices);
    free(lines->pieces);
    free(lines->kept);
    *lines = (struct spl_node_lines){0};
}
