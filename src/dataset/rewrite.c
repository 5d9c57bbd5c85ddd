/* Container to container, a node at a time; see rewrite.h. Where no node is dropped, ids and the order of nodes and
 * chunks stay, so that what a caller knows by splat or chunk holds in both files; only pages may be cut at other nodes.
 * Where some are, the rest keep their order, which is still breadth first. The caller's thread. */
#include "dataset/rewrite.h"

#include <stdlib.h>
#include <string.h>

#include "base/memory.h"
#include "dataset/chunk.h"
#include "dataset/panels.h"
#include "dataset/texture.h"
#include "dataset/writer.h"

/* Radii of the new leaves are counted by the first 15 bits of their floats, which rise with them. */
enum { radius_shift = 16, radius_bins = 1 << (31 - radius_shift) };

struct pass {
    const struct spl_rewrite *what;
    struct spl_dataset_writer *writer;
    uint64_t node_count, chunk_count; /* of the new file, so far; its arrays have room for all of the old one's */
    struct spl_node *nodes;
    struct spl_chunk *chunks;
    struct spl_chunk_stations *stations;
    struct spl_stream streams[SPL_STREAMS_MAX];
    uint32_t *base[SPL_STREAMS_MAX], stream_count;
    uint8_t *width[SPL_STREAMS_MAX];
    bool *dropped;                  /* by node of the old one */
    uint32_t *page, *page_textures; /* of it; the latter where they stay */
    uint32_t page_index;            /* UINT32_MAX = none yet */
    uint32_t *words, *texture_words, *chunk_texture; /* of the node's chunks */
    uint32_t *map;
    uint64_t *radii, leaf_splats; /* of the new leaves: radius_bins, and their sum; where nodes may be dropped */
    uint32_t levels;
};

static int grow(uint32_t **block, size_t bytes, struct spl_error *err)
{
    uint32_t *grown = spl_realloc(*block, bytes, 1, err);
    *block = grown ? grown : *block;
    return grown ? SPL_OK : SPL_E_NOMEM;
}

static int load_page(struct pass *p, uint32_t index, struct spl_error *err)
{
    const struct spl_dataset *from = p->what->from;
    if (index == p->page_index)
        return SPL_OK;
    p->page_index = UINT32_MAX;
    int rc = grow(&p->page, spl_dataset_get_page_bytes(from, index), err);
    if (!rc)
        rc = spl_dataset_read_page(from, index, p->page, err);
    if (!rc && p->what->dictionary && !p->what->code_chunk) {
        rc = grow(&p->page_textures, spl_dataset_get_texture_bytes(from, index), err);
        if (!rc)
            rc = spl_dataset_read_textures(from, index, p->page_textures, err);
    }
    p->page_index = rc ? UINT32_MAX : index;
    return rc;
}

/* The words of chunk `index` of the old file with the colours wanted, and its header; returns how many it appended. */
static uint32_t copy_chunk(struct pass *p, uint64_t index, struct spl_chunk *chunk, uint32_t *words)
{
    uint64_t count;
    const struct spl_chunk *from = &spl_dataset_get_chunks(p->what->from, &count)[index];
    uint32_t own = spl_chunk_words(from), used = own,
             streams = spl_dataset_get_stream_words(p->what->from, p->stream_count, index);
    const uint32_t *old = p->page + from->geometry_word;
    *chunk = *from;
    if (p->what->colors && spl_kind_has_panels(spl_chunk_kind(from)))
        used = spl_panels_recolor(from, p->page, p->what->colors + p->what->first_cell[index], chunk, words);
    else if (p->what->colors)
        used = spl_chunk_recolor(from, p->page, p->what->colors + from->first_id, chunk, words);
    else
        memcpy(words, old, own * sizeof *words);
    memcpy(words + used, old + own, streams * sizeof *words);
    return used + streams;
}

/* What the new head has of it beside the header. */
static void copy_tables(struct pass *p, uint64_t index, uint64_t to)
{
    uint32_t count;
    const struct spl_stream *streams = spl_dataset_get_streams(p->what->from, &count);
    for (uint32_t s = 0; s < count; s++) {
        p->base[s][to] = streams[s].base[index];
        p->width[s][to] = streams[s].width[index];
    }
    if (p->what->maps)
        p->stations[to] = p->what->stations[index];
}

/* The codes wanted of chunk `index`: the caller's, or those that it has. */
static int get_code(struct pass *p, uint64_t index, uint32_t splats, struct spl_chunk_code *code,
                    struct spl_error *err)
{
    if (p->what->code_chunk)
        return p->what->code_chunk(p->what->context, index, code, err);
    uint32_t texture = spl_dataset_get_chunk_textures(p->what->from)[index];
    spl_texture_decode(p->page_textures + spl_texture_word(texture), spl_texture_planes(texture), splats, code);
    return SPL_OK;
}

/* Discs of a node that is a leaf from now on. */
static void scale_radii(const struct pass *p, struct spl_chunk *chunk)
{
    if (spl_chunk_kind(chunk) != SPL_CHUNK_DISCS || !(p->what->leaf_radius > 0))
        return;
    chunk->radius_min *= p->what->leaf_radius;
    chunk->radius_step *= p->what->leaf_radius;
}

static void count_radii(struct pass *p, float radius, uint32_t count)
{
    uint32_t bits;
    memcpy(&bits, &radius, sizeof bits); // > 0
    p->radii[bits >> radius_shift] += count;
    p->leaf_splats += count;
}

/* A leaf's splats, whose words are still the node's, and what its panels are worth of them. */
static void count_leaf(struct pass *p, const struct spl_chunk *chunks, uint32_t chunk_count)
{
    for (uint32_t c = 0; c < chunk_count; c++) {
        if (spl_kind_has_panels(spl_chunk_kind(&chunks[c])))
            count_radii(p, chunks[c].radius_min, spl_panels_get_points(&chunks[c]));
        for (uint32_t i = 0; i < chunks[c].count && spl_chunk_kind(&chunks[c]) == SPL_CHUNK_DISCS; i++) {
            struct spl_splat splat;
            spl_chunk_decode(&chunks[c], p->words, i, &splat);
            count_radii(p, splat.radius, 1);
        }
    }
}

static int write_node(struct pass *p, const struct spl_node *old, bool leaf, struct spl_error *err)
{
    struct spl_node *node = &p->nodes[p->node_count];
    struct spl_chunk *chunks = p->chunks + p->chunk_count;
    struct spl_node_textures textures = {.words = p->texture_words, .chunk_texture = p->chunk_texture};
    size_t used = 0;
    int rc = load_page(p, old->page, err);
    *node = *old;
    node->first_chunk = p->chunk_count;
    node->child_count = leaf ? 0 : old->child_count;
    for (uint32_t i = 0; i < node->chunk_count && !rc; i++) {
        uint32_t count = copy_chunk(p, old->first_chunk + i, &chunks[i], p->words + used);
        copy_tables(p, old->first_chunk + i, node->first_chunk + i);
        if (leaf)
            scale_radii(p, &chunks[i]);
        chunks[i].geometry_word = (uint32_t)used;
        used += count;
        if (leaf && spl_kind_has_panels(spl_chunk_kind(&chunks[i])))
            spl_panels_set_points(&chunks[i], spl_panels_count_discs(&chunks[i], p->words));
        if (!p->what->dictionary)
            continue;
        struct spl_chunk_code code = {0};
        rc = get_code(p, old->first_chunk + i, chunks[i].count, &code, err);
        if (rc)
            break;
        spl_assert(code.splats == chunks[i].count);
        count = spl_texture_encode(&code, p->texture_words + textures.word_count);
        p->chunk_texture[i] = count ? (uint32_t)textures.word_count | code.planes << SPL_CHUNK_TEXTURE_PLANES : 0;
        textures.word_count += count;
    }
    if (!rc && p->what->leaf && !node->child_count)
        count_leaf(p, chunks, node->chunk_count);
    p->levels = node->depth + 1u > p->levels ? node->depth + 1u : p->levels;
    if (!rc)
        rc = spl_dataset_writer_add_textured_node(p->writer, p->words, used, chunks, node->chunk_count, &textures,
                                                  &node->page, err);
    p->node_count++;
    p->chunk_count += node->chunk_count;
    return rc;
}

/* Nodes come before their children, so one walk finds all that lies below a leaf. */
static int write_nodes(struct pass *p, struct spl_error *err)
{
    uint64_t count;
    const struct spl_node *nodes = spl_dataset_get_nodes(p->what->from, &count);
    int rc = SPL_OK;
    for (uint64_t n = 0; n < count && !rc; n++) {
        bool leaf = p->dropped[n] || (p->what->leaf && p->what->leaf[n]);
        for (uint32_t c = 0; c < nodes[n].child_count && leaf; c++)
            p->dropped[nodes[n].first_child + c] = true;
        if (!p->dropped[n])
            rc = write_node(p, &nodes[n], leaf, err);
    }
    return rc;
}

static int write_maps(struct pass *p, struct spl_error *err)
{
    const struct spl_rewrite *what = p->what;
    int rc = SPL_OK;
    for (uint32_t i = 0; i < what->map_count && !rc; i++) {
        const uint32_t *words;
        if (what->get_map) {
            rc = what->get_map(what->context, i, &words, err);
        } else if (!(rc = grow(&p->map, spl_dataset_get_map_bytes(what->from, i), err))) {
            rc = spl_dataset_read_map(what->from, i, p->map, err);
            words = p->map;
        }
        if (!rc)
            rc = spl_dataset_writer_add_map(p->writer, words, err);
    }
    return rc;
}

/* The median of what was counted, to half a bin: 0.4 %. */
static double median_radius(const struct pass *p)
{
    uint64_t before = 0;
    uint32_t bin = 0;
    while (2 * (before += p->radii[bin]) < p->leaf_splats)
        bin++;
    uint32_t bits = bin << radius_shift | 1u << radius_shift >> 1;
    float radius;
    memcpy(&radius, &bits, sizeof radius);
    return (double)radius;
}

/* META of a file that has lost nodes. */
static int describe_pruned(const struct pass *p, json_t *meta, struct spl_error *err)
{
    const struct spl_dataset_info *old = spl_dataset_get_info(p->what->from);
    if (!p->leaf_splats)
        return spl_fail(err, SPL_E_INPUT, "%s: no splat would be left of it, but lines alone", old->id);
    bool failed = json_object_set_new(meta, "leaf_splats", json_integer((json_int_t)p->leaf_splats)) ||
                  json_object_set_new(meta, "levels", json_integer(p->levels)) ||
                  json_object_set_new(meta, "splat_radius", json_real(median_radius(p)));
    if (!json_object_get(meta, "pruned")) // of a dataset that was pruned before, it says of how many in all
        failed |= json_object_set_new(meta, "pruned", json_pack("{s:I}", "of", (json_int_t)old->leaf_splats)) != 0;
    json_object_del(meta, "bits");
    return failed ? spl_fail(err, SPL_E_NOMEM, "out of memory for the description of the dataset") : SPL_OK;
}

/* A key of META that goes with what is written anew. */
static int replace(json_t *meta, const char *key, bool stays, const json_t *value)
{
    if (!stays)
        json_object_del(meta, key);
    return value ? json_object_set(meta, key, (json_t *)value) : 0;
}

/* META of the old file, in which the splats now have a colour; `asked` is what the caller says, before defaults. */
static json_t *make_meta(const struct pass *p, const struct spl_rewrite *asked, struct spl_error *err)
{
    json_t *meta = json_deep_copy(spl_dataset_get_meta(asked->from));
    int failed = !meta;
    if (meta && asked->colors)
        failed |= json_object_set_new(json_object_get(meta, "attributes"), "color", json_true());
    if (meta && asked->color_source)
        json_array_insert(json_object_get(meta, "color"), 0, (json_t *)asked->color_source);
    failed |= meta && replace(meta, "textures", !asked->dictionary, asked->textures);
    failed |= meta && replace(meta, "maps", !asked->maps, asked->about_maps);
    int rc = failed ? spl_fail(err, SPL_E_NOMEM, "out of memory for the description of the dataset") : SPL_OK;
    if (!rc && p->node_count < spl_dataset_get_info(asked->from)->nodes)
        rc = describe_pruned(p, meta, err);
    if (!rc)
        return meta;
    json_decref(meta);
    return NULL;
}

static int allocate(struct pass *p, struct spl_error *err)
{
    uint64_t node_count, chunk_count, most = 0;
    const struct spl_node *nodes = spl_dataset_get_nodes(p->what->from, &node_count);
    const struct spl_stream *streams = spl_dataset_get_streams(p->what->from, &p->stream_count);
    spl_dataset_get_chunks(p->what->from, &chunk_count);
    for (uint64_t i = 0; i < node_count; i++)
        most = nodes[i].chunk_count > most ? nodes[i].chunk_count : most;
    size_t node_words = most * (SPL_CHUNK_WORDS_MAX + p->stream_count * SPL_STREAM_WORDS_MAX);
    size_t texture_words = p->what->dictionary ? most * SPL_TEXTURE_WORDS_MAX : 1;
    bool failed = !(p->nodes = spl_alloc_raw(node_count, sizeof *p->nodes, err)) ||
                  !(p->dropped = spl_alloc(node_count, sizeof *p->dropped, err)) ||
                  !(p->chunks = spl_alloc_raw(chunk_count, sizeof *p->chunks, err)) ||
                  !(p->stations = spl_alloc_raw(p->what->maps ? chunk_count : 1, sizeof *p->stations, err)) ||
                  !(p->words = spl_alloc_raw(node_words, sizeof *p->words, err)) ||
                  !(p->texture_words = spl_alloc_raw(texture_words, sizeof *p->texture_words, err)) ||
                  !(p->chunk_texture = spl_alloc_raw(most, sizeof *p->chunk_texture, err)) ||
                  !(p->radii = spl_alloc(radius_bins, sizeof *p->radii, err));
    for (uint32_t s = 0; s < p->stream_count && !failed; s++) {
        failed = !(p->base[s] = spl_alloc_raw(chunk_count, sizeof *p->base[s], err)) ||
                 !(p->width[s] = spl_alloc_raw(chunk_count, 1, err));
        p->streams[s] = streams[s];
        p->streams[s].base = p->base[s];
        p->streams[s].width = p->width[s];
    }
    return failed ? SPL_E_NOMEM : SPL_OK;
}

static int write_all(struct pass *p, const struct spl_rewrite *asked, struct spl_error *err)
{
    const struct spl_rewrite *what = p->what;
    if (what->page_bytes)
        spl_dataset_writer_set_page_bytes(p->writer, what->page_bytes);
    spl_dataset_writer_set_streams(p->writer, p->streams, p->stream_count);
    int rc = what->dictionary ? spl_dataset_writer_set_dictionary(p->writer, what->dictionary, err) : SPL_OK;
    if (!rc && what->maps)
        rc = spl_dataset_writer_set_maps(p->writer, what->maps, what->map_count, p->stations, err);
    if (!rc)
        rc = write_nodes(p, err);
    if (!rc)
        rc = write_maps(p, err);
    if (rc)
        return rc;
    struct spl_error why = {0};
    json_t *meta = make_meta(p, asked, &why);
    rc = meta ? spl_dataset_writer_finish(p->writer, p->nodes, p->node_count, p->chunks, p->chunk_count, meta, err)
              : spl_fail(err, why.code, "%s", why.message);
    json_decref(meta);
    return rc;
}

/* What is not said anew, as the dataset has it: the callbacks stay NULL then. */
static struct spl_rewrite with_defaults(const struct spl_rewrite *asked)
{
    struct spl_rewrite what = *asked;
    if (!what.dictionary) {
        what.dictionary = spl_dataset_get_dictionary(what.from);
        what.code_chunk = NULL;
    }
    if (!what.maps) {
        what.maps = spl_dataset_get_maps(what.from, &what.map_count);
        what.stations = spl_dataset_get_chunk_stations(what.from);
        what.get_map = NULL;
    }
    what.dictionary = what.dictionary->count ? what.dictionary : NULL;
    what.maps = what.map_count ? what.maps : NULL;
    return what;
}

int spl_dataset_rewrite(const struct spl_rewrite *rewrite, const char *path, struct spl_error *err)
{
    const struct spl_rewrite what = with_defaults(rewrite);
    struct pass p = {.what = &what, .page_index = UINT32_MAX};
    int rc = allocate(&p, err);
    if (!rc)
        rc = spl_dataset_writer_create(path, &p.writer, err);
    if (!rc)
        rc = write_all(&p, rewrite, err);
    spl_dataset_writer_destroy(p.writer);
    for (uint32_t s = 0; s < p.stream_count; s++) {
        free(p.base[s]);
        free(p.width[s]);
    }
    free(p.nodes);
    free(p.dropped);
    free(p.chunks);
    free(p.stations);
    free(p.page);
    free(p.page_textures);
    free(p.words);
    free(p.texture_words);
    free(p.chunk_texture);
    free(p.map);
    free(p.radii);
    return rc;
}
