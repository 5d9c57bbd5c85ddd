/* Tables of pages in memory: how large, how they are laid out, and reading them; see tables.h. Opening reads all of
 * them where they fit, on all cores, one after the other into arrays of the whole dataset; else the root's page's, and
 * of a dataset that is verified the others in passing. The opener's thread for that, any for the rest. */
#include "dataset/tables.h"

#include <pthread.h>
#include <stdatomic.h>
#include <stdlib.h>

#include <xxhash.h>

#include "base/memory.h"
#include "base/parallel.h"
#include "dataset/counts.h"
#include "dataset/head.h"
#include "dataset/open.h"
#include "dataset/tiles.h"

/* Of a collection, which keeps all of its own, whatever --tables says. */
static const uint64_t coarse_bytes_max = 1u << 30;

/* Numbers and sizes as the directory says; arrays still to be set. */
static struct spl_tables describe(const struct spl_dataset *dataset, uint32_t page)
{
    const struct spl_page_row *row = &dataset->rows[page];
    return (struct spl_tables){
        .page = page,
        .node_count = (uint32_t)(row[1].first_node - row->first_node), // a head has room for no more
        .chunk_count = (uint32_t)(row[1].first_chunk - row->first_chunk),
        .stream_count = dataset->info.stream_count,
        .first_node = row->first_node,
        .first_chunk = row->first_chunk,
    };
}

static uint64_t table_bytes(const struct spl_dataset *dataset, uint64_t nodes, uint64_t chunks)
{
    uint64_t of_chunk = sizeof(struct spl_chunk) + SPL_STREAM_CHUNK_BYTES * dataset->info.stream_count +
                        (dataset->textures ? sizeof(uint32_t) : 0) +
                        (dataset->maps ? sizeof(struct spl_chunk_stations) : 0);
    return sizeof(struct spl_tables) + nodes * sizeof(struct spl_node) + chunks * of_chunk;
}

size_t spl_dataset_get_tables_bytes(const struct spl_dataset *dataset, uint32_t page)
{
    spl_assert(page < dataset->info.pages);
    const struct spl_tables tables = describe(dataset, page);
    return table_bytes(dataset, tables.node_count, tables.chunk_count);
}

uint64_t spl_dataset_get_all_tables_bytes(const struct spl_dataset *dataset)
{
    return table_bytes(dataset, dataset->info.nodes, dataset->info.chunks) +
           (dataset->info.pages - 1) * sizeof(struct spl_tables);
}

uint64_t spl_dataset_get_tables_limit(const struct spl_dataset *dataset)
{
    return dataset->tables_limit;
}

/* The arrays behind each other in one block, those of items of 8, 4 and 1 byte in turn. */
static void lay_out(struct spl_tables *tables, bool textured, bool mapped, void *memory)
{
    tables->nodes = memory;
    tables->chunks = (struct spl_chunk *)(tables->nodes + tables->node_count);
    uint32_t *words = (uint32_t *)(tables->chunks + tables->chunk_count);
    tables->textures = textured ? words : NULL;
    words += textured ? tables->chunk_count : 0;
    tables->stations = mapped ? (struct spl_chunk_stations *)(void *)words : NULL;
    words += mapped ? tables->chunk_count * sizeof *tables->stations / sizeof *words : 0;
    for (uint32_t s = 0; s < tables->stream_count; s++, words += tables->chunk_count)
        tables->base[s] = words;
    uint8_t *widths = (uint8_t *)words;
    for (uint32_t s = 0; s < tables->stream_count; s++, widths += tables->chunk_count)
        tables->width[s] = widths;
}

/* A head being read, its checksum with it. */
struct reader {
    const struct spl_dataset *dataset;
    uint64_t offset;
    XXH3_state_t *hash;
    char *block; /* room for some nodes or chunks, which are longer in memory */
};

enum { block_items = 4096, block_bytes = block_items * SPL_CHUNK_BYTES };
_Static_assert(SPL_NODE_BYTES <= SPL_CHUNK_BYTES, "nodes fit the block, too");

static int take(struct reader *reader, void *out, size_t bytes, struct spl_error *err)
{
    int rc = spl_dataset_read(reader->dataset, reader->offset, out, bytes, err);
    reader->offset += bytes;
    if (!rc)
        XXH3_64bits_update(reader->hash, out, bytes);
    return rc;
}

static int take_all(struct reader *reader, struct spl_tables *tables, struct spl_error *err)
{
    const size_t words = tables->chunk_count * sizeof(uint32_t);
    int rc = SPL_OK;
    for (uint32_t n = 0, count; !rc && n < tables->node_count; n += count) {
        count = tables->node_count - n < block_items ? tables->node_count - n : block_items;
        if (!(rc = take(reader, reader->block, (size_t)count * SPL_NODE_BYTES, err)))
            spl_head_read_nodes(reader->block, &tables->nodes[n], count);
    }
    for (uint32_t c = 0, count; !rc && c < tables->chunk_count; c += count) {
        count = tables->chunk_count - c < block_items ? tables->chunk_count - c : block_items;
        if (!(rc = take(reader, reader->block, (size_t)count * SPL_CHUNK_BYTES, err)))
            spl_head_read_chunks(reader->block, &tables->chunks[c], count);
    }
    if (!rc && tables->textures)
        rc = take(reader, tables->textures, words, err);
    if (!rc && tables->stations)
        rc = take(reader, tables->stations, tables->chunk_count * sizeof *tables->stations, err);
    for (uint32_t s = 0; s < tables->stream_count && !rc; s++)
        rc = take(reader, tables->base[s], words, err);
    for (uint32_t s = 0; s < tables->stream_count && !rc; s++)
        rc = take(reader, tables->width[s], tables->chunk_count, err);
    return rc;
}

/* Reads a head to where `tables` has its arrays. */
static int read_head(const struct spl_dataset *dataset, struct spl_tables *tables, struct spl_error *err)
{
    const struct spl_section *section = dataset->found[SPL_KIND_HEADS].at[tables->page];
    struct reader reader = {dataset, section->offset, XXH3_createState(), spl_alloc_raw(block_bytes, 1, err)};
    int rc = reader.block ? SPL_OK : SPL_E_NOMEM;
    if (!reader.hash)
        rc = spl_fail(err, SPL_E_NOMEM, "out of memory for checksums");
    else
        XXH3_64bits_reset(reader.hash);
    if (!rc)
        rc = take_all(&reader, tables, err);
    if (!rc && XXH3_64bits_digest(reader.hash) != section->hash)
        rc = spl_fail(err, SPL_E_CORRUPT,
                      dataset->opened ? "%s: section HEAD %u fails its checksum: it is damaged, or was overwritten "
                                        "while in use; put the dataset back under another name and rename it"
                                      : "%s: section HEAD %u fails its checksum; copy or pack the dataset again",
                      spl_dataset_get_name(dataset), tables->page);
    XXH3_freeState(reader.hash);
    free(reader.block);
    return rc ? rc : spl_dataset_judge_head(dataset, tables, err);
}

int spl_dataset_read_tables(const struct spl_dataset *dataset, uint32_t page, void *block, struct spl_error *err)
{
    struct spl_tables *tables = block;
    spl_assert(page < dataset->info.pages);
    if (spl_tiles_find(dataset, page))
        return spl_tiles_read_tables(dataset, page, block, err);
    *tables = describe(dataset, page);
    lay_out(tables, dataset->textures, dataset->maps, tables + 1);
    struct spl_error why = {0};
    int rc = read_head(dataset, tables, &why);
    if (rc == SPL_E_CORRUPT && spl_dataset_forget(dataset, dataset->found[SPL_KIND_HEADS].at[page])) {
        why = (struct spl_error){0};
        rc = read_head(dataset, tables, &why);
    }
    return rc ? spl_fail_field(err, rc, why.field, "%s", why.message) : SPL_OK;
}

const struct spl_tables *spl_dataset_get_tables(const struct spl_dataset *dataset, uint32_t page)
{
    spl_assert(page < dataset->info.pages);
    return page < dataset->kept_tables ? &dataset->tables[page] : NULL;
}

const struct spl_tables *spl_dataset_borrow_tables(const struct spl_dataset *dataset, uint32_t page,
                                                   struct spl_tables **read, struct spl_error *err)
{
    const struct spl_tables *kept = spl_dataset_get_tables(dataset, page);
    *read = kept ? NULL : spl_alloc_raw(spl_dataset_get_tables_bytes(dataset, page), 1, err);
    if (!*read)
        return kept;
    if (!spl_dataset_read_tables(dataset, page, *read, err))
        return *read;
    free(*read);
    *read = NULL;
    return NULL;
}

/* Arrays of the whole dataset, each page's part in its place. */
static int allocate_whole(struct spl_dataset *dataset, struct spl_error *err)
{
    const struct spl_dataset_info *info = &dataset->info;
    struct spl_tables all = {.node_count = 0, .stream_count = info->stream_count};
    dataset->tables = spl_alloc(info->pages, sizeof *dataset->tables, err);
    dataset->whole.nodes = spl_alloc_raw(info->nodes, sizeof *dataset->whole.nodes, err);
    dataset->whole.chunks = spl_alloc_raw(info->chunks, sizeof *dataset->whole.chunks, err);
    bool refused = !dataset->tables || !dataset->whole.nodes || !dataset->whole.chunks;
    if (!refused && dataset->textures)
        refused = !(dataset->whole.textures = spl_alloc_raw(info->chunks, sizeof *dataset->whole.textures, err));
    if (!refused && dataset->maps)
        refused = !(dataset->whole.stations = spl_alloc_raw(info->chunks, sizeof *dataset->whole.stations, err));
    for (uint32_t s = 0; s < all.stream_count && !refused; s++) {
        dataset->streams[s].base = dataset->whole.base[s] = spl_alloc_raw(info->chunks, sizeof(uint32_t), err);
        dataset->streams[s].width = dataset->whole.width[s] = spl_alloc_raw(info->chunks, 1, err);
        refused = !dataset->whole.base[s] || !dataset->whole.width[s];
    }
    if (refused)
        return SPL_E_NOMEM;
    for (uint32_t page = 0; page < info->pages; page++) {
        struct spl_tables *tables = &dataset->tables[page];
        *tables = describe(dataset, page);
        tables->nodes = dataset->whole.nodes + tables->first_node;
        tables->chunks = dataset->whole.chunks + tables->first_chunk;
        tables->textures = dataset->textures ? dataset->whole.textures + tables->first_chunk : NULL;
        tables->stations = dataset->maps ? dataset->whole.stations + tables->first_chunk : NULL;
        for (uint32_t s = 0; s < all.stream_count; s++) {
            tables->base[s] = dataset->whole.base[s] + tables->first_chunk;
            tables->width[s] = dataset->whole.width[s] + tables->first_chunk;
        }
    }
    dataset->kept_tables = info->pages;
    return SPL_OK;
}

struct reading {
    const struct spl_dataset *dataset;
    atomic_bool stopped;
    pthread_mutex_t mutex;
    uint32_t failed; /* guarded by: mutex, as all below; the least page whose head is refused */
    struct spl_error err;
    struct spl_counts counts;
};

static int read_and_count(struct spl_dataset *dataset, uint32_t page, struct spl_counts *counts, struct spl_error *err)
{
    struct spl_tables *passing = NULL;
    const struct spl_tables *tables = spl_dataset_get_tables(dataset, page);
    int rc = spl_dataset_check_cancelled(dataset, err);
    if (rc)
        return rc;
    if (tables)
        rc = read_head(dataset, &dataset->tables[page], err);
    else if (!(tables = spl_dataset_borrow_tables(dataset, page, &passing, err)))
        return err->code;
    if (!rc)
        spl_counts_add_tables(counts, tables);
    free(passing);
    return rc;
}

static void read_heads(void *context, size_t begin, size_t end, unsigned worker)
{
    (void)worker;
    struct reading *reading = context;
    for (size_t page = begin; page < end; page++) {
        struct spl_counts counts = {0};
        struct spl_error why = {0};
        if (reading->dataset->source.far && atomic_load(&reading->stopped))
            return; // a server that fails would be asked for each of them
        int rc = read_and_count((struct spl_dataset *)reading->dataset, (uint32_t)page, &counts, &why);
        if (rc)
            atomic_store(&reading->stopped, true);
        pthread_mutex_lock(&reading->mutex);
        if (!rc) {
            spl_counts_add(&reading->counts, &counts);
        } else if (page < reading->failed) {
            reading->failed = (uint32_t)page;
            reading->err = why;
        }
        pthread_mutex_unlock(&reading->mutex);
    }
}

/* All of them, kept or in passing, against what META says. */
static int read_all(struct spl_dataset *dataset, struct spl_error *err)
{
    struct reading reading = {.dataset = dataset, .failed = UINT32_MAX};
    pthread_mutex_init(&reading.mutex, NULL);
    spl_parallel_for(0, dataset->info.pages, 1, read_heads, &reading);
    pthread_mutex_destroy(&reading.mutex);
    if (reading.failed != UINT32_MAX)
        return spl_fail(err, reading.err.code, "%s", reading.err.message);
    const char *key = spl_counts_compare(&reading.counts, &dataset->counts);
    return key ? spl_fail_field(err, SPL_E_CORRUPT, key,
                                "%s: section META: \"%s\" is not what the nodes and chunks hold; pack the dataset "
                                "again",
                                dataset->name, key)
               : SPL_OK;
}

/* The root's page alone. */
static int keep_first(struct spl_dataset *dataset, struct spl_error *err)
{
    struct spl_tables *first = spl_alloc_raw(spl_dataset_get_tables_bytes(dataset, 0), 1, err);
    int rc = first ? spl_dataset_read_tables(dataset, 0, first, err) : SPL_E_NOMEM;
    dataset->tables = first;
    dataset->kept_tables = rc ? 0 : 1;
    return rc;
}

/* Of a tile none is kept: who wants them reads them. */
int spl_dataset_check_heads(struct spl_dataset *dataset, struct spl_error *err)
{
    const bool collection = json_object_get(dataset->meta, "tiles"); /* whose leaves get what hangs there */
    if (dataset->how->expected) {
        dataset->how->expected->differs = collection ? "is a collection itself" : NULL;
        return collection ? spl_fail(err, SPL_E_CORRUPT, "%s is a collection itself", dataset->name) : SPL_OK;
    }
    if (collection && spl_dataset_get_all_tables_bytes(dataset) > coarse_bytes_max)
        return spl_fail(err, SPL_E_LIMIT,
                        "%s: it is a collection, of whose coarse levels the tables take more than %d "
                        "MiB",
                        dataset->name, (int)(coarse_bytes_max >> 20));
    const uint64_t limit = dataset->tables_limit, most = limit < UINT64_MAX ? SPL_TABLES_WHOLE : limit;
    bool whole = collection || spl_dataset_get_all_tables_bytes(dataset) <= (limit < most ? limit : most);
    int rc = whole ? allocate_whole(dataset, err) : keep_first(dataset, err);
    if (whole && dataset->info.pages)
        spl_dataset_expect(dataset, dataset->found[SPL_KIND_HEADS].at[0],
                           dataset->found[SPL_KIND_HEADS].at[dataset->info.pages - 1]);
    if (!rc && (whole || (dataset->verified && !dataset->lazily)))
        rc = read_all(dataset, err);
    if (!rc && whole)
        rc = spl_dataset_check_children(dataset, err);
    return rc ? rc : spl_dataset_check_tiles(dataset, err);
}
