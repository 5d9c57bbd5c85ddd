/* spl_merge(): a collection and its tiles as one file. The tree is the one that views walk: below each leaf of the
 * collection hangs its tile. Splats, chunks and nodes are copied bit for bit; what is new is their order, breadth first
 * over all tiles, and where pages are cut. In that order each tile's nodes of a level follow each other, so a page is
 * read once, and once more where two levels share it; one is in memory at a time. The caller's thread. */
#include "pack/collect/merge.h"

#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <unistd.h>

#include "base/file.h"
#include "base/memory.h"
#include "base/parallel.h"
#include "base/sized.h"
#include "dataset/chunk.h"
#include "dataset/dataset.h"
#include "dataset/remote_url.h"
#include "dataset/writer.h"
#include "pack/inputs.h"
#include "pack/stage.h"

struct merge {
    const struct spl_dataset *from;
    const struct spl_dataset_info *info; /* of it */
    struct spl_dataset_writer *writer;
    uint64_t *order;        /* numbers of the nodes in `from`, as the new file has them; `queued` of them are known */
    struct spl_node *nodes; /* of the new file, as the next three; info->nodes of them, info->chunks */
    struct spl_chunk *chunks;
    struct spl_stream streams[SPL_STREAMS_MAX];
    uint32_t *base[SPL_STREAMS_MAX];
    uint8_t *width[SPL_STREAMS_MAX];
    uint64_t queued, node_count, chunk_count;
    /* The page at hand. */
    uint32_t page; /* UINT32_MAX = none yet */
    const struct spl_tables *tables;
    struct spl_tables *read; // owned; may be NULL
    uint32_t *words, *node_words; /* room for as many as the largest page has */
};

static int fail_tree(const struct merge *m, struct spl_error *err)
{
    return spl_fail_field(err, SPL_E_CORRUPT, "collection",
                          "%s: page %u does not fit the others of the collection: \"splatd info\" says which file is "
                          "damaged",
                          m->info->id, m->page);
}

static int load_page(struct merge *m, uint32_t page, struct spl_error *err)
{
    if (page == m->page)
        return SPL_OK;
    free(m->read);
    m->read = NULL;
    m->page = UINT32_MAX;
    m->tables = spl_dataset_borrow_tables(m->from, page, &m->read, err);
    if (!m->tables)
        return err->code;
    int rc = spl_dataset_read_page(m->from, page, m->words, err);
    m->page = rc ? UINT32_MAX : page;
    return rc;
}

/* Chunk `index` of the page's tables, its words behind the `used` ones of the node. */
static int copy_chunk(struct merge *m, uint64_t index, size_t *used, struct spl_error *err)
{
    const struct spl_tables *tables = m->tables;
    const size_t room = spl_dataset_get_page_bytes(m->from, m->page) / sizeof *m->words;
    struct spl_chunk *chunk = &m->chunks[m->chunk_count];
    *chunk = tables->chunks[index];
    const size_t words = spl_chunk_words(chunk) +
                         (size_t)spl_tables_get_stream_words(tables, tables->stream_count, (uint32_t)index);
    if (chunk->geometry_word + words > room || *used + words > room)
        return fail_tree(m, err);
    memcpy(m->node_words + *used, m->words + chunk->geometry_word, words * sizeof *m->words);
    chunk->geometry_word = (uint32_t)*used;
    *used += words;
    for (uint32_t s = 0; s < tables->stream_count; s++) {
        m->base[s][m->chunk_count] = tables->base[s][index];
        m->width[s][m->chunk_count] = tables->width[s][index];
    }
    m->chunk_count++;
    return SPL_OK;
}

/* The next node of the order, whose children are queued. */
static int write_node(struct merge *m, uint64_t *splats, struct spl_error *err)
{
    const uint64_t number = m->order[m->node_count];
    int rc = load_page(m, spl_dataset_find_page_of_node(m->from, number), err);
    if (rc)
        return rc;
    struct spl_node *node = &m->nodes[m->node_count];
    *node = m->tables->nodes[number - m->tables->first_node];
    const uint64_t first = node->first_chunk - m->tables->first_chunk;
    if (m->queued + node->child_count > m->info->nodes || m->chunk_count + node->chunk_count > m->info->chunks ||
        first + node->chunk_count > m->tables->chunk_count ||
        (node->child_count && node->first_child + node->child_count > m->info->nodes))
        return fail_tree(m, err);
    node->first_chunk = m->chunk_count;
    for (uint32_t c = 0; c < node->child_count; c++)
        m->order[m->queued++] = node->first_child + c;
    struct spl_chunk *chunks = &m->chunks[m->chunk_count];
    size_t used = 0;
    for (uint32_t c = 0; c < node->chunk_count && !rc; c++) {
        *splats += m->tables->chunks[first + c].count;
        rc = copy_chunk(m, first + c, &used, err);
    }
    if (!rc)
        rc = spl_dataset_writer_add_node(m->writer, m->node_words, used, chunks, node->chunk_count, &node->page, err);
    m->node_count++;
    return rc;
}

static int write_nodes(struct merge *m, struct spl_stage *stage, struct spl_error *err)
{
    int rc = SPL_OK;
    m->order[m->queued++] = 0;
    spl_stage_begin(stage, "merging", "splats", m->info->ids);
    while (!rc && m->node_count < m->queued) {
        uint64_t splats = 0;
        rc = write_node(m, &splats, err);
        spl_stage_add(stage, splats, 0);
        if (!rc)
            rc = spl_stage_check(stage, err);
    }
    spl_stage_end(stage);
    return rc || (m->node_count == m->info->nodes && m->chunk_count == m->info->chunks) ? rc : fail_tree(m, err);
}

static int allocate(struct merge *m, struct spl_error *err)
{
    size_t room = 1;
    uint32_t stream_count;
    const struct spl_stream *streams = spl_dataset_get_streams(m->from, &stream_count);
    for (uint32_t p = 0; p < m->info->pages; p++)
        room = spl_dataset_get_page_bytes(m->from, p) > room ? spl_dataset_get_page_bytes(m->from, p) : room;
    bool failed = !(m->order = spl_alloc_raw(m->info->nodes, sizeof *m->order, err)) ||
                  !(m->nodes = spl_alloc_raw(m->info->nodes, sizeof *m->nodes, err)) ||
                  !(m->chunks = spl_alloc_raw(m->info->chunks, sizeof *m->chunks, err)) ||
                  !(m->words = spl_alloc_raw(room, 1, err)) || !(m->node_words = spl_alloc_raw(room, 1, err));
    for (uint32_t s = 0; s < stream_count && !failed; s++) {
        failed = !(m->base[s] = spl_alloc_raw(m->info->chunks, sizeof *m->base[s], err)) ||
                 !(m->width[s] = spl_alloc_raw(m->info->chunks, sizeof *m->width[s], err));
        m->streams[s] = streams[s];
        m->streams[s].base = m->base[s];
        m->streams[s].width = m->width[s];
    }
    spl_dataset_writer_set_streams(m->writer, m->streams, stream_count);
    return failed ? SPL_E_NOMEM : SPL_OK;
}

/* META of the collection, in which the tiles' leaves are the file's own; NULL: no memory. */
static json_t *describe(const struct merge *m, const struct spl_merge_of *of)
{
    static const char *const of_tiles[] = {"tiles", "tile_values", "bits"};
    json_t *meta = json_copy((json_t *)spl_dataset_get_meta(m->from));
    if (!meta)
        return NULL;
    for (size_t i = 0; i < sizeof of_tiles / sizeof *of_tiles; i++)
        json_object_del(meta, of_tiles[i]);
    if (!json_object_set_new(meta, "points", json_integer((json_int_t)m->info->points)) &&
        !json_object_set_new(meta, "leaf_splats", json_integer((json_int_t)m->info->leaf_splats)) &&
        !json_object_set_new(meta, "levels", json_integer(m->info->levels)) &&
        !json_object_set_new(meta, "splat_radius", json_real(m->info->splat_radius)) &&
        !json_object_set_new(meta, "merged", json_integer(m->info->tiles)) &&
        (!of->sources || !json_object_set(meta, "sources", (json_t *)of->sources)) &&
        (!of->skipped || !json_object_set(meta, "skipped", (json_t *)of->skipped)))
        return meta;
    json_decref(meta);
    return NULL;
}

/* What is read would be gone once the output has taken its place. */
static int check_output(const struct spl_merge_options *o, const char *beside, const struct spl_dataset *from,
                        struct spl_error *err)
{
    const int folder = (int)(spl_input_name(beside) - beside);
    const json_t *tiles = json_object_get(spl_dataset_get_meta(from), "tiles"), *tile;
    struct stat output;
    size_t i;
    if (stat(o->output, &output))
        return SPL_OK;
    if (!S_ISREG(output.st_mode))
        return spl_fail_field(err, SPL_E_USAGE, "output", "%.300s exists and is no file", o->output);
    if (spl_dataset_is_remote(from))
        return SPL_OK;
    bool same = spl_file_is_same(o->collection, o->output);
    if (same)
        return spl_fail_field(err, SPL_E_USAGE, "output",
                              "%.300s is the collection, which is read: choose another name", o->output);
    json_array_foreach(tiles, i, tile)
    {
        char *path = NULL;
        if (asprintf(&path, "%.*s%s", folder, beside, json_string_value(json_object_get(tile, "file"))) < 0)
            return spl_fail(err, SPL_E_NOMEM, "out of memory for the names of tiles");
        same = spl_file_is_same(path, o->output);
        free(path);
        if (same)
            return spl_fail_field(err, SPL_E_USAGE, "output",
                                  "%.300s is a tile of %.300s, which is read: choose another name", o->output,
                                  o->collection);
    }
    return SPL_OK;
}

static int check_room(const struct merge *m, const char *output, struct spl_error *err)
{
    const uint64_t bytes = m->info->tile_bytes, free_bytes = spl_file_get_free(output);
    return bytes <= free_bytes
               ? SPL_OK
               : spl_fail_field(err, SPL_E_IO, "output",
                                "%.300s will have %.1f MB, and %.1f MB are free there: make room, or write it to "
                                "another disk",
                                output, (double)bytes / 1e6, (double)free_bytes / 1e6);
}

static int merge(struct merge *m, const struct spl_merge_options *o, const struct spl_merge_of *of,
                 struct spl_stage *stage, struct spl_error *err)
{
    int rc = spl_dataset_writer_create(o->output, &m->writer, err);
    if (rc)
        return rc;
    spl_dataset_writer_set_threads(m->writer, stage->threads);
    spl_dataset_writer_check_what_is_written(m->writer);
    if ((rc = allocate(m, err)) || (rc = write_nodes(m, stage, err)))
        return rc;
    json_t *meta = describe(m, of);
    if (!meta)
        return spl_fail(err, SPL_E_NOMEM, "out of memory for the description of %.300s", o->output);
    spl_stage_begin(stage, "writing", NULL, 0);
    rc = spl_dataset_writer_finish(m->writer, m->nodes, m->node_count, m->chunks, m->chunk_count, meta, err);
    spl_stage_end(stage);
    json_decref(meta);
    return rc;
}

static void finish(struct merge *m)
{
    spl_dataset_writer_destroy(m->writer);
    free(m->order);
    free(m->nodes);
    free(m->chunks);
    free(m->read);
    free(m->words);
    free(m->node_words);
    for (uint32_t s = 0; s < SPL_STREAMS_MAX; s++) {
        free(m->base[s]);
        free(m->width[s]);
    }
}

static int open_collection(const struct spl_merge_options *o, const struct spl_merge_of *of,
                           struct spl_dataset_opening *how, struct spl_dataset **out, struct spl_error *err)
{
    struct spl_dataset_source source;
    if (!of->beside)
        return spl_dataset_open_as(o->collection, how, out, err);
    how->beside = of->beside;
    int rc = spl_dataset_source_open_file(o->collection, &source, err);
    if (!rc && (rc = spl_dataset_open_source_as(&source, "parts", how, out, err)))
        spl_dataset_source_close(&source);
    unlink(o->collection); /* what is open of it stays until it is closed */
    return rc;
}

int spl_merge_of(const struct spl_merge_options *options, const struct spl_merge_of *of, struct spl_error *err)
{
    struct spl_stage stage = {.callback = options->progress,
                              .context = options->progress_context,
                              .threads = spl_thread_count(options->threads),
                              .cancelled = spl_cancel_get_flag(options->cancel)};
    struct spl_dataset_opening how = {.verify = true, .tables_bytes = 1, .cancelled = stage.cancelled};
    struct spl_dataset *from = NULL;
    struct merge m = {.page = UINT32_MAX};
    struct spl_error why = {0};
    if (!options->collection || !*options->collection)
        return spl_fail_field(err, SPL_E_USAGE, "collection", "name the collection to merge, such as city.spld");
    if (!options->output || !*spl_input_name(options->output))
        return spl_fail_field(err, SPL_E_USAGE, "output", "name the dataset to write, such as whole.spld");
    int rc = open_collection(options, of, &how, &from, &why);
    if (rc)
        return spl_fail_field(err, rc, "collection", "%s", why.message);
    m.from = from;
    m.info = spl_dataset_get_info(from);
    rc = m.info->tiles ? check_output(options, of->beside ? of->beside : options->collection, from, &why)
                       : spl_fail_field(&why, SPL_E_INPUT, "collection",
                                        "%.300s: it is no collection, but a dataset of one file already",
                                        options->collection);
    if (!rc)
        rc = check_room(&m, options->output, &why);
    if (!rc)
        rc = merge(&m, options, of, &stage, &why);
    finish(&m);
    spl_dataset_close(from);
    return rc ? spl_fail_field(err, rc, why.field, "%s", why.message) : SPL_OK;
}

int spl_merge(const struct spl_merge_options *options, struct spl_error *err)
{
    struct spl_merge_options known = {0};
    int rc = spl_sized_read(options, &known, sizeof known, "spl_merge_options", err);
    return rc ? rc : spl_merge_of(&known, &(struct spl_merge_of){0}, err);
}
