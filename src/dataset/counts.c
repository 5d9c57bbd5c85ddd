/* Sums over tables, and as META has them; see counts.h. Bits of attributes are summed from what headers say, so no page
 * is looked at. Pure functions; any thread. */
#include "dataset/counts.h"

#include <string.h>

#include "dataset/panels.h"
#include "dataset/streams.h"

enum { counted_attributes = SPL_ATTRIBUTE_CHUNK + 1 }; // those before textures

static void add_chunk(struct spl_counts *counts, const struct spl_chunk *chunk)
{
    bool discs = spl_chunk_kind(chunk) == SPL_CHUNK_DISCS;
    spl_chunk_add_bits(chunk, counts->bits);
    counts->splats += discs ? chunk->count : 0;
    counts->pieces += spl_chunk_count_pieces(chunk);
    counts->panels += spl_chunk_kind(chunk) == SPL_CHUNK_PANELS ? chunk->count : 0;
    counts->meshes += spl_chunk_kind(chunk) == SPL_CHUNK_MESHES ? chunk->count : 0;
    counts->linear_chunks += discs && chunk->geometry_bits >> SPL_GEOMETRY_LINEAR != 0;
}

static void add_leaf_chunk(struct spl_counts *counts, const struct spl_chunk *chunk)
{
    uint32_t kind = spl_chunk_kind(chunk), points = spl_kind_has_panels(kind) ? spl_panels_get_points(chunk) : 0;
    counts->leaf_splats += kind == SPL_CHUNK_DISCS ? chunk->count : points; // 0 of lines
    counts->panel_points += kind == SPL_CHUNK_PANELS ? points : 0;
    counts->mesh_points += kind == SPL_CHUNK_MESHES ? points : 0;
}

void spl_counts_add_tables(struct spl_counts *counts, const struct spl_tables *tables)
{
    uint64_t header_bits = 8ull * SPL_NODE_BYTES * tables->node_count;
    for (uint32_t c = 0; c < tables->chunk_count; c++)
        add_chunk(counts, &tables->chunks[c]);
    for (uint32_t s = 0; s < tables->stream_count; s++) {
        uint64_t bits = 0, words = 0;
        for (uint32_t c = 0; c < tables->chunk_count; c++) {
            uint32_t of_chunk = tables->width[s][c] * tables->chunks[c].count;
            bits += of_chunk;
            words += (of_chunk + 31) / 32;
        }
        counts->stream_bits[s] += bits;
        header_bits += 32 * words - bits + 8ull * SPL_STREAM_CHUNK_BYTES * tables->chunk_count;
    }
    header_bits += tables->stations ? 8ull * sizeof *tables->stations * tables->chunk_count : 0;
    counts->bits[SPL_ATTRIBUTE_CHUNK] += header_bits;
    for (uint32_t n = 0; n < tables->node_count; n++) {
        const struct spl_node *node = &tables->nodes[n];
        const struct spl_chunk *chunks = tables->chunks + (node->first_chunk - tables->first_chunk);
        counts->levels = node->depth + 1u > counts->levels ? node->depth + 1u : counts->levels;
        for (uint32_t c = 0; c < node->chunk_count && !node->child_count; c++)
            add_leaf_chunk(counts, &chunks[c]);
    }
}

void spl_counts_add(struct spl_counts *counts, const struct spl_counts *other)
{
    counts->splats += other->splats;
    counts->leaf_splats += other->leaf_splats;
    counts->pieces += other->pieces;
    counts->linear_chunks += other->linear_chunks;
    counts->panels += other->panels;
    counts->panel_points += other->panel_points;
    counts->meshes += other->meshes;
    counts->mesh_points += other->mesh_points;
    counts->levels = other->levels > counts->levels ? other->levels : counts->levels;
    for (int a = 0; a < SPL_ATTRIBUTE_COUNT; a++)
        counts->bits[a] += other->bits[a];
    for (int s = 0; s < SPL_STREAMS_MAX; s++)
        counts->stream_bits[s] += other->stream_bits[s];
}

/* Of primitives that the dataset has none of nothing is said: files are what they were before there were any. */
static bool is_said(const struct spl_counts *counts, int attribute)
{
    return attribute == SPL_ATTRIBUTE_PANELS   ? counts->panels > 0
           : attribute == SPL_ATTRIBUTE_MESHES ? counts->meshes > 0
                                               : true;
}

json_t *spl_counts_to_json(const struct spl_counts *counts, uint32_t streams)
{
    json_t *bits = json_object(), *stream_bits = json_array();
    int failed = 0;
    for (int a = 0; a < counted_attributes; a++)
        if (is_said(counts, a))
            failed |= json_object_set_new(bits, spl_attribute_name((enum spl_attribute)a),
                                          json_integer((json_int_t)counts->bits[a]));
    for (uint32_t s = 0; s < streams; s++)
        failed |= json_array_append_new(stream_bits, json_integer((json_int_t)counts->stream_bits[s]));
    json_t *json = json_pack("{s:I, s:I, s:I, s:o, s:o}", "splats", (json_int_t)counts->splats, "pieces",
                             (json_int_t)counts->pieces, "linear_chunks", (json_int_t)counts->linear_chunks, "bits",
                             bits, "stream_bits", stream_bits);
    if (counts->panels)
        failed |= json_object_set_new(json, "panels", json_integer((json_int_t)counts->panels)) |
                  json_object_set_new(json, "panel_points", json_integer((json_int_t)counts->panel_points));
    if (counts->meshes)
        failed |= json_object_set_new(json, "meshes", json_integer((json_int_t)counts->meshes)) |
                  json_object_set_new(json, "mesh_points", json_integer((json_int_t)counts->mesh_points));
    if (!failed)
        return json;
    json_decref(json);
    return NULL;
}

static bool get(const json_t *value, uint64_t *out)
{
    *out = (uint64_t)json_integer_value(value);
    return json_is_integer(value) && json_integer_value(value) >= 0;
}

/* The same, 0 where there is none. */
static bool get_if(const json_t *value, uint64_t *out)
{
    *out = 0;
    return !value || get(value, out);
}

bool spl_counts_from_json(const json_t *json, uint32_t streams, struct spl_counts *counts)
{
    const json_t *bits = json_object_get(json, "bits"), *stream_bits = json_object_get(json, "stream_bits");
    bool good = get(json_object_get(json, "splats"), &counts->splats) &&
                get(json_object_get(json, "pieces"), &counts->pieces) &&
                get(json_object_get(json, "linear_chunks"), &counts->linear_chunks) &&
                get_if(json_object_get(json, "panels"), &counts->panels) &&
                get_if(json_object_get(json, "panel_points"), &counts->panel_points) &&
                get_if(json_object_get(json, "meshes"), &counts->meshes) &&
                get_if(json_object_get(json, "mesh_points"), &counts->mesh_points) &&
                json_array_size(stream_bits) == streams;
    for (int a = 0; a < counted_attributes && good; a++) {
        const json_t *value = json_object_get(bits, spl_attribute_name((enum spl_attribute)a));
        good = is_said(counts, a) ? get(value, &counts->bits[a]) : get_if(value, &counts->bits[a]);
    }
    for (uint32_t s = 0; s < streams && good; s++)
        good = get(json_array_get(stream_bits, s), &counts->stream_bits[s]);
    return good;
}

const char *spl_counts_compare(const struct spl_counts *a, const struct spl_counts *b)
{
    if (a->leaf_splats != b->leaf_splats)
        return "leaf_splats";
    if (a->levels != b->levels)
        return "levels";
    bool same = a->splats == b->splats && a->pieces == b->pieces && a->linear_chunks == b->linear_chunks &&
                a->panels == b->panels && a->panel_points == b->panel_points && a->meshes == b->meshes &&
                a->mesh_points == b->mesh_points && !memcmp(a->bits, b->bits, sizeof a->bits) &&
                !memcmp(a->stream_bits, b->stream_bits, sizeof a->stream_bits);
    return same ? NULL : "counts";
}
