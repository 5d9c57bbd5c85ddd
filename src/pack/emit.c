/* Nodes are cut, ordered and encoded in parallel, a batch at a time, and written in order by the calling thread: the
 * file is the same for any number of threads. Nodes go out breadth first, so the coarse levels share the first pages.
 */
#include "pack/emit.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "base/array.h"
#include "base/memory.h"
#include "base/parallel.h"
#include "pack/chunks.h"
#include "pack/median.h"

enum { batch_nodes = 256, spacing_sample = 1023 };
static const float width_most = 1.4f; /* of a chunk's lines, as a multiple of the least */
enum { widths_most = 36 };            /* chunks that begin for another width: lines are sorted by theirs */

struct encoded { /* one node of the batch; owned by the batch */
    uint32_t *words;
    struct spl_chunk *chunks;
    struct spl_stream_code (*codes)[SPL_STREAMS_MAX]; /* by chunk */
    size_t word_count;
    uint32_t chunk_count;
    struct spl_chunk_error error;
};

struct scratch { /* of one worker, for the largest node */
    struct spl_cut *items;
    uint32_t *words;
    size_t chunk_capacity; /* of `words` */
    float *radii;
    float (*weighted)[2]; /* radii and how many have them, where there are panels */
    struct spl_node_lines lines;
};

struct emit {
    const struct spl_tree *tree;
    const struct spl_points *points;
    const struct spl_wires *wires;
    const struct spl_chunk_options *options;
    struct spl_stage *stage;
    struct scratch *scratch;
    struct encoded *batch;
    struct spl_node *nodes;
    const struct spl_emitted *out;
    size_t first; /* node of the batch's first element */
    atomic_bool failed;
};

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
        position[c] = p->axis[c][i] - node->origin[c];
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
    s->linear = from->linear;
    set_color(s, from->color_class);
}

/* The discs as they decode: codes may stand out by a step. */
static void grow_box(struct spl_node *node, const struct spl_splat *splats, double (*position)[3],
                     const struct spl_chunk *chunk)
{
    double slack = 1.001 * ((double)chunk->step + chunk->radius_step);
    for (uint32_t i = 0; i < chunk->count; i++)
        for (int c = 0; c < 3; c++) {
            double reach =
                fmax(splats[i].radius, spl_chunk_line_width(chunk) / 2) + slack + 1e-6 * fabs(position[i][c]);
            node->box_min[c] = fminf(node->box_min[c], (float)(position[i][c] - reach));
            node->box_max[c] = fmaxf(node->box_max[c], (float)(position[i][c] + reach));
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
        *s = (struct spl_splat){.radius = from[i].radius,
                                .linear = i + 1 < count && from[i].point != SPL_WIRE_END};
        for (int c = 0; c < 3; c++) {
            position[i][c] = from[i].position[c] - node->origin[c];
            s->normal[c] = from[i].normal[c];
        }
        set_color(s, from[i].color_class);
    }
}

/* Adds the node's lines, which w->lines has, to its chunks. */
static void encode_lines(struct emit *e, struct scratch *w, const struct spl_tree_node *node, struct spl_node *header,
                         struct encoded *out)
{
    struct spl_node_lines *lines = &w->lines;
    struct spl_chunk_options options = *e->options;
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
static void add_panels(const struct emit *e, const struct spl_node_panels *panels, struct scratch *w,
                       struct spl_node *header, struct encoded *out)
{
    size_t first = 0;
    for (uint32_t i = 0; i < panels->chunk_count; i++) {
        uint32_t *words = w->words + out->word_count, used = spl_chunk_words(&panels->chunks[i]);
        struct spl_chunk *chunk = &out->chunks[out->chunk_count];
        *chunk = panels->chunks[i];
        memcpy(words, panels->words + chunk->geometry_word, used * sizeof *words);
        chunk->geometry_word = (uint32_t)out->word_count;
        used += spl_emitted_streams_encode_panels(&e->out->streams, panels, first, chunk->count,
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
static bool reserve_chunks(struct scratch *w, size_t discs, size_t vertices, size_t panels, uint32_t streams,
                           struct encoded *out)
{
    size_t most = discs + vertices / (SPL_CHUNK_SPLATS - 2) + 1 + (vertices ? widths_most : 0) + panels;
    if (most > w->chunk_capacity) {
        free(w->words);
        w->chunk_capacity = 0;
        size_t words = SPL_CHUNK_WORDS_MAX + streams * SPL_STREAM_WORDS_MAX; /* of a chunk */
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
static float median_with_panels(struct scratch *w, uint32_t sample, uint32_t count,
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

static bool encode_node(struct emit *e, struct scratch *w, size_t index, struct encoded *out)
{
    const struct spl_tree_node *node = &e->tree->nodes[index];
    const struct spl_points *p = e->points;
    struct spl_node *header = &e->nodes[index];
    bool leaf = !node->child_count;
    uint32_t count = node->splat_count;
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
                leaf ? (float)(p->axis[c][node->begin + at] - node->origin[c]) : node->splats[at].position[c];
        }
        w->items[i].index = at;
        w->radii[i++] = radius;
    }
    uint32_t sample = count < spacing_sample ? count : spacing_sample;
    for (uint32_t i = 0; i < sample; i++)
        w->radii[i] = w->radii[(uint64_t)i * count / sample];
    header->spacing =
        (node->panels ? median_with_panels(w, sample, count, node->panels) : spl_median(w->radii, sample)) /
        SPL_RADIUS_SPACING;

    spl_chunks_cut(w->items, count);
    out->chunk_count = (count + SPL_CHUNK_SPLATS - 1) / SPL_CHUNK_SPLATS;
    if (!spl_wires_get_node(e->wires, node->begin, node->end, leaf ? 0 : header->spacing, &w->lines) ||
        !reserve_chunks(w, out->chunk_count, w->lines.count, node->panels ? node->panels->chunk_count : 0,
                        e->out->streams.count, out))
        return false;
    for (uint32_t c = 0; c < out->chunk_count; c++) {
        struct spl_splat splats[SPL_CHUNK_SPLATS];
        double position[SPL_CHUNK_SPLATS][3];
        uint32_t first = c * SPL_CHUNK_SPLATS;
        uint32_t used = count - first < SPL_CHUNK_SPLATS ? count - first : SPL_CHUNK_SPLATS;
        for (uint32_t i = 0; i < used; i++) {
            uint32_t at = w->items[first + i].index;
            if (leaf)
                load_leaf(p, node, at, &splats[i], position[i]);
            else
                load_inner(node, at, &splats[i], position[i]);
        }
        if (p->no_surface)
            level_radii(splats, used);
        struct spl_chunk_error error;
        uint32_t words = spl_chunk_encode(splats, (const double(*)[3])position, used, e->options, &out->chunks[c],
                                          w->words + out->word_count, &error);
        grow_box(header, splats, position, &out->chunks[c]);
        out->chunks[c].geometry_word = (uint32_t)out->word_count;
        out->word_count += words;
        out->word_count += spl_emitted_streams_encode(&e->out->streams, p, node, w->items + first, used, out->codes[c],
                                                      w->words + out->word_count);
        out->error.position_over_radius += error.position_over_radius;
        out->error.normal_radians += error.normal_radians;
    }
    encode_lines(e, w, node, header, out);
    if (node->panels)
        add_panels(e, node->panels, w, header, out);
    out->words = spl_alloc_raw(out->word_count, sizeof *out->words, NULL);
    if (!out->words)
        return false;
    memcpy(out->words, w->words, out->word_count * sizeof *out->words);
    return true;
}

static void encode_nodes(void *context, size_t begin, size_t end, unsigned worker)
{
    struct emit *e = context;
    for (size_t i = begin; i < end; i++) {
        if (!encode_node(e, &e->scratch[worker], e->first + i, &e->batch[i]))
            atomic_store(&e->failed, true);
        if (atomic_load(&e->failed))
            return;
        spl_stage_add(e->stage, e->tree->nodes[e->first + i].splat_count, worker);
    }
}

/* Room for `wanted` chunks and their streams' codes. */
static int reserve(struct spl_emitted *out, size_t wanted, size_t *capacity, struct spl_error *err)
{
    size_t before = *capacity;
    if (spl_array_reserve(out->chunks, *capacity, wanted, err))
        return SPL_E_NOMEM;
    return *capacity > before ? spl_emitted_streams_reserve(&out->streams, *capacity, err) : SPL_OK;
}

static void add_panel_chunk(struct spl_emitted *out, const struct spl_chunk *chunk, bool leaf)
{
    bool mesh = spl_chunk_kind(chunk) == SPL_CHUNK_MESHES;
    if (!spl_kind_has_panels(spl_chunk_kind(chunk)))
        return;
    *(mesh ? &out->meshes : &out->panels) += chunk->count;
    *(mesh ? &out->mesh_points : &out->panel_points) += leaf ? spl_panels_get_points(chunk) : 0;
}

static int write_node(struct emit *e, size_t index, struct encoded *encoded, struct spl_dataset_writer *writer,
                      size_t *chunk_capacity, struct spl_emitted *out, struct spl_error *err)
{
    const struct spl_tree_node *from = &e->tree->nodes[index];
    struct spl_node *node = &e->nodes[index];
    for (uint32_t c = 0; c < encoded->chunk_count; c++) {
        encoded->chunks[c].first_id = out->ids;
        out->ids += encoded->chunks[c].count;
        out->splats += spl_chunk_kind(&encoded->chunks[c]) == SPL_CHUNK_DISCS ? encoded->chunks[c].count : 0;
        out->pieces += spl_chunk_count_pieces(&encoded->chunks[c]);
        add_panel_chunk(out, &encoded->chunks[c], !from->child_count);
        spl_chunk_add_bits(&encoded->chunks[c], out->bits);
    }
    if (from->depth > UINT8_MAX)
        return spl_fail(err, SPL_E_LIMIT,
                        "more than %d levels; points lie closer together than the scan is wide by more than floats "
                        "can say",
                        UINT8_MAX + 1);
    int rc = reserve(out, out->chunk_count + encoded->chunk_count, chunk_capacity, err);
    if (!rc)
        rc = spl_dataset_writer_add_node(writer, encoded->words, encoded->word_count, encoded->chunks,
                                         encoded->chunk_count, &node->page, err);
    if (rc)
        return rc;
    spl_emitted_streams_keep(&out->streams, out->chunk_count, encoded->chunks, encoded->codes, encoded->chunk_count,
                             &out->bits[SPL_ATTRIBUTE_CHUNK]);
    memcpy(out->chunks + out->chunk_count, encoded->chunks, encoded->chunk_count * sizeof *out->chunks);
    for (int c = 0; c < 3; c++)
        node->origin[c] = from->origin[c];
    node->size = (float)from->size;
    node->first_child = from->first_child;
    node->child_count = (uint8_t)from->child_count;
    node->depth = (uint8_t)from->depth;
    node->first_chunk = out->chunk_count;
    node->chunk_count = (uint16_t)encoded->chunk_count;
    out->chunk_count += encoded->chunk_count;
    out->pages = node->page + 1;
    out->error.position_over_radius += encoded->error.position_over_radius;
    out->error.normal_radians += encoded->error.normal_radians;
    return 0;
}

/* A node's box holds its descendants' too; rounded outwards where origins differ. */
static void unite_boxes(struct spl_node *nodes, uint32_t count)
{
    for (uint32_t i = count; i-- > 0;)
        for (uint32_t k = 0; k < nodes[i].child_count; k++) {
            const struct spl_node *child = &nodes[nodes[i].first_child + k];
            for (int c = 0; c < 3; c++) {
                double shift = child->origin[c] - nodes[i].origin[c];
                float low = nextafterf((float)(shift + child->box_min[c]), -INFINITY);
                float high = nextafterf((float)(shift + child->box_max[c]), INFINITY);
                nodes[i].box_min[c] = fminf(nodes[i].box_min[c], low);
                nodes[i].box_max[c] = fmaxf(nodes[i].box_max[c], high);
            }
        }
}

static int allocate(struct emit *e, struct spl_emitted *out, struct spl_error *err)
{
    size_t largest = 1; /* there may be panels alone */
    for (uint32_t i = 0; i < e->tree->count; i++)
        largest = e->tree->nodes[i].splat_count > largest ? e->tree->nodes[i].splat_count : largest;
    size_t chunks = (largest + SPL_CHUNK_SPLATS - 1) / SPL_CHUNK_SPLATS;
    spl_assert(chunks <= SPL_NODE_CHUNKS_MAX);
    e->nodes = out->nodes = spl_alloc(e->tree->count, sizeof *out->nodes, err);
    e->batch = spl_alloc(batch_nodes, sizeof *e->batch, err);
    e->scratch = spl_alloc(e->stage->threads, sizeof *e->scratch, err);
    if (!e->nodes || !e->batch || !e->scratch)
        return SPL_E_NOMEM;
    for (unsigned t = 0; t < e->stage->threads; t++) {
        struct scratch *w = &e->scratch[t];
        w->items = spl_alloc_raw(largest, sizeof *w->items, err);
        w->radii = spl_alloc_raw(largest, sizeof *w->radii, err);
        if (e->points->plane)
            w->weighted = spl_alloc_raw(spacing_sample + SPL_NODE_CHUNKS_MAX, sizeof *w->weighted, err);
        if (!w->items || !w->radii || (e->points->plane && !w->weighted))
            return SPL_E_NOMEM;
    }
    return 0;
}

static void clear_batch(struct encoded *batch)
{
    for (size_t i = 0; i < batch_nodes; i++) {
        free(batch[i].words);
        free(batch[i].chunks);
        free(batch[i].codes);
        batch[i] = (struct encoded){0};
    }
}

int spl_emit(const struct spl_tree *tree, const struct spl_points *points, const struct spl_wires *wires,
             const struct spl_chunk_options *options, struct spl_dataset_writer *writer, struct spl_stage *stage,
             struct spl_emitted *out, struct spl_error *err)
{
    struct emit e = {
        .tree = tree, .points = points, .wires = wires, .options = options, .stage = stage, .out = out};
    size_t chunk_capacity = 0, splats = 0;
    for (uint32_t i = 0; i < tree->count; i++)
        splats += tree->nodes[i].splat_count;
    spl_stage_begin(stage, "encoding", "splats", splats);
    spl_emitted_streams_init(&out->streams, points);
    int rc = allocate(&e, out, err);
    for (e.first = 0; !rc && e.first < tree->count; e.first += batch_nodes) {
        size_t count = tree->count - e.first < batch_nodes ? tree->count - e.first : batch_nodes;
        spl_parallel_for(stage->threads, count, 1, encode_nodes, &e);
        if (atomic_load(&e.failed))
            rc = spl_fail(err, SPL_E_NOMEM, "out of memory while encoding %zu splats", splats);
        for (size_t i = 0; !rc && i < count; i++)
            rc = write_node(&e, e.first + i, &e.batch[i], writer, &chunk_capacity, out, err);
        clear_batch(e.batch);
        if (!rc)
            rc = spl_stage_check(stage, err);
    }
    if (!rc) {
        unite_boxes(out->nodes, tree->count);
        out->bits[SPL_ATTRIBUTE_CHUNK] += (uint64_t)tree->count * SPL_NODE_BYTES * 8;
        spl_dataset_writer_set_streams(writer, out->streams.list, out->streams.count);
        spl_stage_end(stage);
    }
    for (unsigned t = 0; e.scratch && t < stage->threads; t++) {
        free(e.scratch[t].items);
        free(e.scratch[t].radii);
        free(e.scratch[t].weighted);
        free(e.scratch[t].words);
        spl_node_lines_finish(&e.scratch[t].lines);
    }
    if (e.batch)
        clear_batch(e.batch);
    free(e.batch);
    free(e.scratch);
    return rc;
}

void spl_emitted_finish(struct spl_emitted *emitted)
{
    free(emitted->nodes);
    free(emitted->chunks);
    spl_emitted_streams_finish(&emitted->streams);
    *emitted = (struct spl_emitted){0};
}
