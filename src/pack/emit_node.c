/* One node's splats, lines and panels as chunks: ordered, cut and encoded. What comes out depends on the node alone,
 * not on the worker or on what that encoded before. Boxes and spacings are of what is decoded, and in panels of the
 * discs that their cells stand for. */
#include "pack/emit_node.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "base/memory.h"
#include "pack/chunks.h"
#include "pack/median.h"

enum { spacing_sample = 1023 };
_Static_assert((int)spacing_sample <= (int)SPL_MIDDLE_MAX, "a sample has a middle");
static const float width_most = 1.4f; /* of a chunk's lines, as a multiple of the least */
enum { widths_most = 36 };            /* chunks that begin for another width: lines are sorted by theirs */

static void set_color(struct spl_splat *s, uint32_t color_class)
{
    for (int c = 0; c < 3; c++)
        s->color[c] = color_class >> 8 * c & 255;
}

static void load_leaf(const struct spl_points *p, const struct spl_tree_node *node, uint32_t at, struct spl_splat *s,
                      double position[3])
{
    size_t i = node->begin + at;
    *s = (struct spl_splat){0};
    for (int c = 0; c < 3; c++) {
        position[c] = spl_points_at(p, c, i) - node->origin[c];
        s->normal[c] = p->normal[i][c];
    }
    s->radius = p->radius[i];
    s->linear = p->linear && p->linear[i];
    for (int c = 0; p->clip && c < 3; c++)
        s->clip.direction[c] = (float)p->clip[i].direction[c] / 127;
    s->clip.offset = p->clip ? (float)p->clip[i].offset / 255 : 1;
    set_color(s, p->color_class[i]);
}

static void load_inner(const struct spl_tree_node *node, uint32_t at, struct spl_splat *s, double position[3])
{
    const struct spl_inner_splat *from = &node->splats[at];
    *s = (struct spl_splat){0};
    for (int c = 0; c < 3; c++) {
        position[c] = from->position[c];
        s->normal[c] = from->normal[c];
    }
    s->radius = from->radius;
    s->linear = spl_inner_is_linear(from);
    set_color(s, from->color_class);
}

/* The discs as they decode: codes may stand out by a step. */
static void grow_box(struct spl_node *node, const struct spl_splat *splats, double (*position)[3],
                     const struct spl_chunk *chunk)
{
    double slack = 1.001 * ((double)chunk->step + chunk->radius_step), half = spl_chunk_line_width(chunk) / 2;
    for (int c = 0; c < 3; c++) {
        float low = node->box_min[c], high = node->box_max[c];
        for (uint32_t i = 0; i < chunk->count; i++) {
            double radius = (double)splats[i].radius > half ? (double)splats[i].radius : half;
            double reach = radius + slack + 1e-6 * fabs(position[i][c]);
            float from = (float)(position[i][c] - reach), to = (float)(position[i][c] + reach);
            low = from < low ? from : low;
            high = to > high ? to : high;
        }
        node->box_min[c] = low;
        node->box_max[c] = high;
    }
}

/* Without a surface a chunk's splats are all as large as their mean, which takes no bits. */
static void level_radii(struct spl_splat *splats, uint32_t count)
{
    double sum = 0;
    for (uint32_t i = 0; i < count; i++)
        sum += splats[i].radius;
    for (uint32_t i = 0; i < count; i++)
        splats[i].radius = (float)(sum / count);
}

/* Vertices from `at` on that a chunk takes, of lines of about one width: all of a line or, where it does not fit, what
 * does; the next chunk begins with the vertex that this one ends with. */
static uint32_t cut_lines(const struct spl_node_lines *lines, size_t at)
{
    const struct spl_wire_vertex *v = lines->vertices + at;
    uint32_t count = lines->count - at < SPL_CHUNK_SPLATS ? (uint32_t)(lines->count - at) : SPL_CHUNK_SPLATS;
    for (uint32_t i = 1; i < count; i++)
        if (v[i - 1].point == SPL_WIRE_END && v[i].width > width_most * v->width)
            return i;
    bool begins = v[count - 1].point != SPL_WIRE_END && v[count - 2].point == SPL_WIRE_END;
    return begins ? count - 1 : count;
}

static void load_vertices(const struct spl_wire_vertex *from, uint32_t count, const struct spl_tree_node *node,
                          struct spl_splat *vertices, double (*position)[3])
{
    for (uint32_t i = 0; i < count; i++) {
        struct spl_splat *s = &vertices[i];
        *s = (struct spl_splat){.radius = from[i].radius, .linear = i + 1 < count && from[i].point != SPL_WIRE_END};
        for (int c = 0; c < 3; c++) {
            position[i][c] = from[i].position[c] - node->origin[c];
            s->normal[c] = from[i].normal[c];
        }
        set_color(s, from[i].color_class);
    }
}

/* Adds the node's lines, which w->lines has, to its chunks. */
static void encode_lines(struct spl_node_encoder *w, const struct spl_tree_node *node, struct spl_node *header,
                         struct spl_encoded_node *out)
{
    struct spl_node_lines *lines = &w->lines;
    struct spl_chunk_options options = *w->options;
    options.kind = SPL_CHUNK_LINES;
    for (size_t at = 0; at < lines->count;) {
        struct spl_splat vertices[SPL_CHUNK_SPLATS];
        double position[SPL_CHUNK_SPLATS][3];
        uint32_t count = cut_lines(lines, at);
        struct spl_chunk *chunk = &out->chunks[out->chunk_count++];
        load_vertices(lines->vertices + at, count, node, vertices, position);
        options.width = (double)lines->vertices[at + count / 2].width;
        uint32_t words = spl_chunk_encode(vertices, (const double(*)[3])position, count, &options, chunk,
                                          w->words + out->word_count, NULL);
        grow_box(header, vertices, position, chunk);
        chunk->geometry_word = (uint32_t)out->word_count;
        out->word_count += words;
        at += lines->vertices[at + count - 1].point == SPL_WIRE_END ? count : count - 1;
    }
}

/* Adds the node's panels to its chunks, with what their points have beside colour. */
static void add_panels(struct spl_node_encoder *w, const struct spl_node_panels *panels, struct spl_node *header,
                       struct spl_encoded_node *out)
{
    size_t first = 0;
    for (uint32_t i = 0; i < panels->chunk_count; i++) {
        uint32_t *words = w->words + out->word_count, used = spl_chunk_words(&panels->chunks[i]);
        struct spl_chunk *chunk = &out->chunks[out->chunk_count];
        *chunk = panels->chunks[i];
        memcpy(words, panels->words + chunk->geometry_word, used * sizeof *words);
        chunk->geometry_word = (uint32_t)out->word_count;
        used += spl_emitted_streams_encode_panels(w->streams, panels, first, chunk->count,
                                                  out->codes[out->chunk_count++], words + used);
        out->word_count += used;
        first += chunk->count;
    }
    for (int c = 0; c < 3; c++) {
        header->box_min[c] = fminf(header->box_min[c], panels->box_min[c]);
        header->box_max[c] = fmaxf(header->box_max[c], panels->box_max[c]);
    }
}

/* Makes room for the chunks of discs, lines and panels; each of the lines' but the last takes at least so many vertices
 * on. */
static bool reserve_chunks(struct spl_node_encoder *w, size_t discs, size_t vertices, size_t panels,
                           struct spl_encoded_node *out)
{
    size_t most = discs + vertices / (SPL_CHUNK_SPLATS - 2) + 1 + (vertices ? widths_most : 0) + panels;
    if (most > w->chunk_capacity) {
        free(w->words);
        w->chunk_capacity = 0;
        size_t words = SPL_CHUNK_WORDS_MAX + w->streams->count * SPL_STREAM_WORDS_MAX; /* of a chunk */
        w->words = spl_alloc_raw(most, words * sizeof *w->words, NULL);
        if (!w->words)
            return false;
        w->chunk_capacity = most;
    }
    out->chunks = spl_alloc_raw(most, sizeof *out->chunks, NULL);
    out->codes = spl_alloc(most, sizeof *out->codes, NULL); /* those of lines stay 0: they have no attributes */
    return out->chunks && out->codes;
}

static int compare_spacings(const void *a, const void *b)
{
    const float *x = a, *y = b;
    return (x[0] > y[0]) - (x[0] < y[0]);
}

/* The median radius of `count` discs, of which w->radii has `sample`, and of those that cells of panels stand for. */
static float median_with_panels(struct spl_node_encoder *w, uint32_t sample, uint32_t count,
                                const struct spl_node_panels *panels)
{
    double total = 0, sum = 0;
    uint32_t at = 0;
    for (uint32_t i = 0; i < sample; i++) {
        w->weighted[at][0] = w->radii[i];
        w->weighted[at++][1] = (float)count / (float)sample;
    }
    for (uint32_t i = 0; i < panels->chunk_count && i < SPL_NODE_CHUNKS_MAX; i++) {
        w->weighted[at][0] = panels->chunks[i].radius_mean;
        w->weighted[at++][1] = (float)panels->cells[i];
    }
    qsort(w->weighted, at, sizeof *w->weighted, compare_spacings);
    for (uint32_t i = 0; i < at; i++)
        total += (double)w->weighted[i][1];
    for (uint32_t i = 0; i < at; i++)
        if (2 * (sum += (double)w->weighted[i][1]) >= total)
            return w->weighted[i][0];
    return w->weighted[at - 1][0];
}

/* Where lines stand for linear splats, these have chunks of their own: a view that asks which of the node's splats are
 * soft sees by the headers of these alone whether lines may still be drawn. Returns how many they are. */
static uint32_t put_linear_first(struct spl_node_encoder *w, const struct spl_tree_node *node, uint32_t count)
{
    const struct spl_points *p = w->points;
    uint32_t linear = 0;
    for (uint32_t i = 0; i < count; i++) {
        const struct spl_cut item = w->items[i];
        if (spl_tree_node_has_points(node) ? !p->linear || !p->linear[node->begin + item.index]
                                           : !spl_inner_is_linear(&node->splats[item.index]))
            continue;
        w->items[i] = w->items[linear];
        w->items[linear++] = item;
    }
    return linear;
}

static size_t chunks_of(uint32_t count)
{
    return (count + SPL_CHUNK_SPLATS - 1) / SPL_CHUNK_SPLATS;
}

static void match_lanes(struct spl_node_encoder *w, const struct spl_tree_node *node, struct spl_cut *items,
                        uint32_t count)
{
    float radius[SPL_CHUNK_SPLATS];
    for (uint32_t i = 0; i < count; i++)
        radius[i] = spl_tree_node_has_points(node) ? w->points->radius[node->begin + items[i].index]
                                                   : node->splats[items[i].index].radius;
    spl_chunk_match_lanes(items, radius, count);
}

/* Adds items [begin, end) to the node's chunks. */
static void encode_discs(struct spl_node_encoder *w, const struct spl_tree_node *node, uint32_t begin, uint32_t end,
                         struct spl_node *header, struct spl_encoded_node *out)
{
    spl_chunks_cut(w->items + begin, end - begin);
    for (uint32_t first = begin; first < end; first += SPL_CHUNK_SPLATS) {
        struct spl_splat splats[SPL_CHUNK_SPLATS];
        double position[SPL_CHUNK_SPLATS][3];
        const uint32_t used = end - first < SPL_CHUNK_SPLATS ? end - first : SPL_CHUNK_SPLATS, c = out->chunk_count++;
        match_lanes(w, node, w->items + first, used);
        for (uint32_t i = 0; i < used; i++) {
            uint32_t at = w->items[first + i].index;
            if (spl_tree_node_has_points(node))
                load_leaf(w->points, node, at, &splats[i], position[i]);
            else
                load_inner(node, at, &splats[i], position[i]);
        }
        if (w->points->no_surface)
            level_radii(splats, used);
        struct spl_chunk_error error;
        uint32_t words = spl_chunk_encode(splats, (const double(*)[3])position, used, w->options, &out->chunks[c],
                                          w->words + out->word_count, &error);
        grow_box(header, splats, position, &out->chunks[c]);
        out->chunks[c].geometry_word = (uint32_t)out->word_count;
        out->word_count += words;
        out->word_count += spl_emitted_streams_encode(w->streams, w->points, node, w->items + first, used,
                                                      out->codes[c], w->words + out->word_count);
        out->error.position_over_radius += error.position_over_radius;
        out->error.normal_radians += error.normal_radians;
    }
}

static bool reserve_splats(struct spl_node_encoder *w, size_t splats, struct spl_error *err)
{
    if (splats <= w->capacity)
        return true;
    free(w->items);
    free(w->radii);
    w->items = spl_alloc_raw(splats, sizeof *w->items, err);
    w->radii = spl_alloc_raw(splats, sizeof *w->radii, err);
    w->capacity = w->items && w->radii ? splats : 0;
    return w->capacity;
}

bool spl_node_encode(struct spl_node_encoder *w, const struct spl_tree_node *node, struct spl_node *header,
                     struct spl_encoded_node *out)
{
    const struct spl_points *p = w->points;
    bool leaf = spl_tree_node_has_points(node);
    uint32_t count = node->splat_count;
    if (!reserve_splats(w, count, NULL))
        return false;
    for (int c = 0; c < 3; c++) {
        header->box_min[c] = INFINITY;
        header->box_max[c] = -INFINITY;
    }
    for (uint32_t i = 0, at = 0; i < count; at++) {
        if (leaf && spl_panels_has_point(p, node->begin + at))
            continue;
        float radius = leaf ? p->radius[node->begin + at] : node->splats[at].radius;
        for (int c = 0; c < 3; c++) {
            w->items[i].position[c] =
                leaf ? (float)(spl_points_at(p, c, node->begin + at) - node->origin[c]) : node->splats[at].position[c];
        }
        w->items[i].index = at;
        w->radii[i++] = radius;
    }
    uint32_t sample = count < spacing_sample ? count : spacing_sample;
    for (uint32_t i = 0; i < sample; i++)
        w->radii[i] = w->radii[(uint64_t)i * count / sample];
    header->spacing =
        (node->panels ? median_with_panels(w, sample, count, node->panels) : spl_middle(w->radii, sample)) /
        SPL_RADIUS_SPACING;

    const uint32_t linear = w->wires->with_widths ? put_linear_first(w, node, count) : 0;
    const size_t chunks = chunks_of(linear) + chunks_of(count - linear);
    if (!spl_wires_get_node(w->wires, node->begin, node->end, leaf ? 0 : header->spacing, &w->lines) ||
        !reserve_chunks(w, chunks, w->lines.count, node->panels ? node->panels->chunk_count : 0, out))
        return false;
    out->chunk_count = 0;
    encode_discs(w, node, 0, linear, header, out);
    encode_discs(w, node, linear, count, header, out);
    encode_lines(w, node, header, out);
    if (node->panels)
        add_panels(w, node->panels, header, out);
    out->words = spl_alloc_raw(out->word_count, sizeof *out->words, NULL);
    if (!out->words)
        return false;
    memcpy(out->words, w->words, out->word_count * sizeof *out->words);
    return true;
}

int spl_node_encoder_init(struct spl_node_encoder *w, size_t splats, struct spl_error *err)
{
    bool room = reserve_splats(w, splats, err);
    if (w->points->plane)
        w->weighted = spl_alloc_raw(spacing_sample + SPL_NODE_CHUNKS_MAX, sizeof *w->weighted, err);
    return room && (w->weighted || !w->points->plane) ? 0 : SPL_E_NOMEM;
}

void spl_node_encoder_finish(struct spl_node_encoder *w)
{
    free(w->items);
    free(w->radii);
    free(w->weighted);
    free(w->words);
    spl_node_lines_finish(&w->lines);
    *w = (struct spl_node_encoder){0};
}

void spl_encoded_node_finish(struct spl_encoded_node *encoded)
{
    free(encoded->words);
    free(encoded->chunks);
    free(encoded->codes);
    *encoded = (struct spl_encoded_node){0};
}
