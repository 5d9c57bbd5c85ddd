/* Container to container, a node at a time; see retexture.h. Ids and the order of nodes and chunks stay, so that what a
 * caller knows by splat or chunk holds in both files; only pages may be cut at other nodes. The caller's thread. */
#include "dataset/retexture.h"

#include <stdlib.h>
#include <string.h>

#include "base/memory.h"
#include "dataset/chunk.h"
#include "dataset/texture.h"
#include "dataset/writer.h"

struct pass {
    const struct spl_retexture *what;
    struct spl_dataset_writer *writer;
    struct spl_node *nodes; /* of the new file */
    struct spl_chunk *chunks;
    uint32_t *page;      /* of the old one */
    uint32_t page_index; /* UINT32_MAX = none yet */
    uint32_t *words;     /* of the node's chunks */
    uint32_t stream_count;
    uint32_t *texture_words, *chunk_texture;
};

static int load_page(struct pass *p, uint32_t index, struct spl_error *err)
{
    if (index == p->page_index)
        return SPL_OK;
    uint32_t *page = spl_realloc(p->page, spl_dataset_get_page_bytes(p->what->from, index), 1, err);
    if (!page)
        return SPL_E_NOMEM;
    p->page = page;
    p->page_index = index;
    return spl_dataset_read_page(p->what->from, index, page, err);
}

/* The words of chunk `index` with the colours wanted; returns how many were appended. */
static uint32_t copy_chunk(struct pass *p, uint64_t index, uint32_t *words)
{
    struct spl_chunk from = p->chunks[index];
    uint32_t own = spl_chunk_words(&from),
             streams = spl_dataset_get_stream_words(p->what->from, p->stream_count, index);
    const uint32_t *page = p->page + from.geometry_word;
    if (!p->what->colors) {
        memcpy(words, page, (own + streams) * sizeof *words);
        return own + streams;
    }
    uint32_t used = spl_chunk_recolor(&from, p->page, p->what->colors + from.first_id, &p->chunks[index], words);
    memcpy(words + used, page + own, streams * sizeof *words);
    return used + streams;
}

static int write_node(struct pass *p, struct spl_node *node, struct spl_error *err)
{
    struct spl_chunk *chunks = p->chunks + node->first_chunk;
    const struct spl_dictionary *dictionary = p->what->dictionary;
    struct spl_node_textures textures = {.words = p->texture_words, .chunk_texture = p->chunk_texture};
    size_t used = 0;
    int rc = load_page(p, node->page, err);
    for (uint32_t i = 0; i < node->chunk_count && !rc; i++) {
        uint32_t count = copy_chunk(p, node->first_chunk + i, p->words + used);
        chunks[i].geometry_word = (uint32_t)used;
        used += count;
        if (!dictionary)
            continue;
        struct spl_chunk_code code = {0};
        rc = p->what->code_chunk(p->what->context, node->first_chunk + i, &code, err);
        if (rc)
            break;
        spl_assert(code.splats == chunks[i].count);
        count = spl_texture_encode(&code, p->texture_words + textures.word_count);
        p->chunk_texture[i] = count ? (uint32_t)textures.word_count | code.planes << SPL_CHUNK_TEXTURE_PLANES : 0;
        textures.word_count += count;
    }
    return rc ? rc
              : spl_dataset_writer_add_textured_node(p->writer, p->words, used, chunks, node->chunk_count, &textures,
                                                     &node->page, err);
}

/* META of the old file, in which the splats now have a colour. */
static json_t *make_meta(const struct spl_retexture *what)
{
    json_t *meta = json_deep_copy(spl_dataset_get_meta(what->from));
    if (meta && what->colors)
        json_object_set_new(json_object_get(meta, "attributes"), "color", json_true());
    if (meta && what->color_source)
        json_array_insert(json_object_get(meta, "color"), 0, (json_t *)what->color_source);
    json_object_del(meta, "textures");
    if (meta && what->textures)
        json_object_set(meta, "textures", (json_t *)what->textures);
    return meta;
}

static int allocate(struct pass *p, uint64_t node_count, uint64_t chunk_count, struct spl_error *err)
{
    size_t most = 0;
    for (uint64_t i = 0; i < node_count; i++)
        most = p->nodes[i].chunk_count > most ? p->nodes[i].chunk_count : most;
    size_t texture_words = p->what->dictionary ? most * SPL_TEXTURE_WORDS_MAX : 1;
    const struct spl_chunk *chunks = spl_dataset_get_chunks(p->what->from, &chunk_count);
    p->chunks = spl_alloc_raw(chunk_count, sizeof *p->chunks, err);
    p->words =
        spl_alloc_raw(most * (SPL_CHUNK_WORDS_MAX + p->stream_count * SPL_STREAM_WORDS_MAX), sizeof *p->words, err);
    p->texture_words = spl_alloc_raw(texture_words, sizeof *p->texture_words, err);
    p->chunk_texture = spl_alloc_raw(most, sizeof *p->chunk_texture, err);
    if (!p->chunks || !p->words || !p->texture_words || !p->chunk_texture)
        return SPL_E_NOMEM;
    memcpy(p->chunks, chunks, chunk_count * sizeof *chunks);
    return SPL_OK;
}

int spl_dataset_retexture(const struct spl_retexture *retexture, const char *path, struct spl_error *err)
{
    struct spl_retexture what = *retexture;
    if (what.dictionary && !what.dictionary->count)
        what.dictionary = NULL;
    struct pass p = {.what = &what, .page_index = UINT32_MAX};
    uint64_t node_count, chunk_count = spl_dataset_get_info(what.from)->chunks;
    const struct spl_node *nodes = spl_dataset_get_nodes(what.from, &node_count);
    const struct spl_stream *streams = spl_dataset_get_streams(what.from, &p.stream_count);
    json_t *meta = make_meta(&what);
    p.nodes = spl_alloc_raw(node_count, sizeof *nodes, err);
    int rc = SPL_E_NOMEM;
    if (!meta)
        spl_fail(err, rc, "out of memory for the description of %s", path);
    if (!meta || !p.nodes)
        goto done;
    memcpy(p.nodes, nodes, node_count * sizeof *nodes);
    if ((rc = allocate(&p, node_count, chunk_count, err)) || (rc = spl_dataset_writer_create(path, &p.writer, err)))
        goto done;
    if (what.page_bytes)
        spl_dataset_writer_set_page_bytes(p.writer, what.page_bytes);
    spl_dataset_writer_set_streams(p.writer, streams, p.stream_count);
    if (what.dictionary)
        rc = spl_dataset_writer_set_dictionary(p.writer, what.dictionary, err);
    for (uint64_t i = 0; i < node_count && !rc; i++)
        rc = write_node(&p, &p.nodes[i], err);
    if (!rc)
        rc = spl_dataset_writer_finish(p.writer, p.nodes, node_count, p.chunks, chunk_count, meta, err);
done:
    spl_dataset_writer_destroy(p.writer);
    json_decref(meta);
    free(p.nodes);
    free(p.chunks);
    free(p.page);
    free(p.words);
    free(p.texture_words);
    free(p.chunk_texture);
    return rc;
}
