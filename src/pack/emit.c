/* Nodes are encoded in parallel, a batch at a time, and written in order by the calling thread: the file is the same
 * for any number of threads. Nodes go out breadth first, so the coarse levels share the first pages. */
#include "pack/emit.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "base/array.h"
#include "base/memory.h"
#include "base/parallel.h"
#include "pack/early.h"
#include "pack/emit_node.h"

enum { nodes_a_worker = 16 }; /* of a batch: few are waited for at its end, little lies in memory */

struct emit {
    struct spl_tree *tree;
    struct spl_stage *stage;
    struct spl_node_encoder *encoders; /* by worker */
    struct spl_encoded_node *batch;
    size_t batch_nodes;
    struct spl_node *nodes;
    size_t first; /* node of the batch's first element */
    atomic_bool failed;
};

static void encode_nodes(void *context, size_t begin, size_t end, unsigned worker)
{
    struct emit *e = context;
    for (size_t i = begin; i < end; i++) {
        if (e->tree->early && spl_early_get(e->tree->early, e->first + i))
            continue;
        if (!spl_node_encode(&e->encoders[worker], &e->tree->nodes[e->first + i], &e->nodes[e->first + i],
                             &e->batch[i]))
            atomic_store(&e->failed, true);
        if (atomic_load(&e->failed))
            return;
        spl_tree_drop_splats(e->tree, (uint32_t)(e->first + i));
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

static int write_node(struct emit *e, size_t index, struct spl_encoded_node *encoded, struct spl_dataset_writer *writer,
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

/* Node `i` of the batch, encoded now or before. */
static int write_made(struct emit *e, size_t i, struct spl_dataset_writer *writer, size_t *chunk_capacity,
                      struct spl_emitted *out, struct spl_error *err)
{
    const size_t index = e->first + i;
    struct spl_encoded_node *before = e->tree->early ? spl_early_get(e->tree->early, index) : NULL;
    int rc = write_node(e, index, before ? before : &e->batch[i], writer, chunk_capacity, out, err);
    if (before) {
        spl_early_give(e->tree->early, index);
        spl_stage_add(e->stage, e->tree->nodes[index].splat_count, 0);
    }
    return rc;
}

void spl_emitted_hold_box(struct spl_node *node, const struct spl_node *child)
{
    for (int c = 0; c < 3; c++) {
        double shift = child->origin[c] - node->origin[c];
        float low = nextafterf((float)(shift + child->box_min[c]), -INFINITY);
        float high = nextafterf((float)(shift + child->box_max[c]), INFINITY);
        node->box_min[c] = fminf(node->box_min[c], low);
        node->box_max[c] = fmaxf(node->box_max[c], high);
    }
}

void spl_emitted_unite_boxes(struct spl_node *nodes, uint32_t count)
{
    for (uint32_t i = count; i-- > 0;)
        for (uint32_t k = 0; k < nodes[i].child_count; k++)
            spl_emitted_hold_box(&nodes[i], &nodes[nodes[i].first_child + k]);
}

static int allocate(struct emit *e, const struct spl_node_encoder *encoder, struct spl_emitted *out,
                    struct spl_error *err)
{
    size_t largest = 1; /* there may be panels alone */
    for (uint32_t i = 0; i < e->tree->count; i++)
        largest = e->tree->nodes[i].splat_count > largest ? e->tree->nodes[i].splat_count : largest;
    size_t chunks = (largest + SPL_CHUNK_SPLATS - 1) / SPL_CHUNK_SPLATS;
    spl_assert(chunks <= SPL_NODE_CHUNKS_MAX);
    if (!out->nodes)
        out->nodes = spl_alloc(e->tree->count, sizeof *out->nodes, err);
    e->nodes = out->nodes;
    e->batch = spl_alloc(e->batch_nodes, sizeof *e->batch, err);
    e->encoders = spl_alloc(e->stage->threads, sizeof *e->encoders, err);
    if (!e->nodes || !e->batch || !e->encoders)
        return SPL_E_NOMEM;
    int rc = 0;
    for (unsigned t = 0; !rc && t < e->stage->threads; t++) {
        e->encoders[t] = *encoder;
        rc = spl_node_encoder_init(&e->encoders[t], largest, err);
    }
    return rc;
}

static void clear_batch(struct emit *e)
{
    for (size_t i = 0; i < e->batch_nodes; i++)
        spl_encoded_node_finish(&e->batch[i]);
}

int spl_emit(struct spl_tree *tree, const struct spl_points *points, const struct spl_wires *wires,
             const struct spl_chunk_options *options, struct spl_dataset_writer *writer, struct spl_stage *stage,
             struct spl_emitted *out, struct spl_error *err)
{
    struct emit e = {.tree = tree, .stage = stage, .batch_nodes = nodes_a_worker * (size_t)stage->threads};
    const struct spl_node_encoder encoder = {
        .points = points, .wires = wires, .options = options, .streams = &out->streams};
    size_t chunk_capacity = 0, splats = 0;
    for (uint32_t i = 0; i < tree->count; i++)
        splats += tree->nodes[i].splat_count;
    spl_stage_begin(stage, "encoding", "splats", splats);
    if (!tree->early)
        spl_emitted_streams_init(&out->streams, points);
    int rc = allocate(&e, &encoder, out, err);
    for (e.first = 0; !rc && e.first < tree->count; e.first += e.batch_nodes) {
        size_t count = tree->count - e.first < e.batch_nodes ? tree->count - e.first : e.batch_nodes;
        spl_parallel_for(stage->threads, count, 1, encode_nodes, &e);
        if (atomic_load(&e.failed))
            rc = spl_fail(err, SPL_E_NOMEM, "out of memory while encoding %zu splats", splats);
        for (size_t i = 0; !rc && i < count; i++)
            rc = write_made(&e, i, writer, &chunk_capacity, out, err);
        clear_batch(&e);
        if (!rc)
            rc = spl_stage_check(stage, err);
    }
    if (!rc) {
        spl_emitted_unite_boxes(out->nodes, tree->count);
        out->bits[SPL_ATTRIBUTE_CHUNK] += (uint64_t)tree->count * SPL_NODE_BYTES * 8;
        spl_dataset_writer_set_streams(writer, out->streams.list, out->streams.count);
        spl_stage_end(stage);
    }
    for (unsigned t = 0; e.encoders && t < stage->threads; t++)
        spl_node_encoder_finish(&e.encoders[t]);
    if (e.batch)
        clear_batch(&e);
    free(e.batch);
    free(e.encoders);
    return rc;
}

void spl_emitted_finish(struct spl_emitted *emitted)
{
    free(emitted->nodes);
    free(emitted->chunks);
    spl_emitted_streams_finish(&emitted->streams);
    *emitted = (struct spl_emitted){0};
}
