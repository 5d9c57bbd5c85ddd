/* Writing a .spld file: pages go out as they fill, everything that describes them follows (a directory, and a head of
 * each page), the header comes last, over the zeroes at the file's start. Until the rename all of it lies in
 * PATH.part-PID; the header is missing there until everything else is written, so that even a stray part file never
 * opens as a dataset. One page is held in memory. Owned by one thread at a time. */
#include "dataset/writer.h"

#include <stdlib.h>
#include <string.h>

#include <xxhash.h>

#include "base/memory.h"
#include "dataset/atoms.h"
#include "dataset/counts.h"
#include "dataset/dictionary.h"
#include "dataset/head.h"
#include "dataset/part_file.h"

enum { section_alignment = 64 };

/* Words of the section being filled. */
struct words {
    uint32_t *at;
    size_t capacity, used; /* the tail not counted */
};

struct spl_dataset_writer {
    struct spl_part_file file;
    uint64_t offset;                         /* where the file ends so far */
    struct words page;                       /* the page being filled */
    struct words textures;                   /* of its chunks */
    struct words chunk_textures;             /* one of each chunk of the dataset */
    const struct spl_dictionary *dictionary; /* NULL = no textures */
    const struct spl_stream *streams;        /* of all chunks */
    uint32_t stream_count;
    const struct spl_map_row *maps;          /* NULL = none */
    const struct spl_chunk_stations *stations;
    uint32_t map_count, maps_added;
    size_t page_nodes, page_chunks; /* of the page being filled */
    struct spl_section *sections;
    size_t section_count, section_capacity;
    uint32_t page_count;
    size_t page_limit; /* bytes that a page is to have at most; one with a larger node has more */
};

static uint64_t align(uint64_t offset, uint64_t alignment)
{
    return (offset + alignment - 1) / alignment * alignment;
}

static int add_section(struct spl_dataset_writer *writer, uint32_t type, uint32_t index, const void *data, size_t bytes,
                       struct spl_error *err)
{
    if (writer->section_count == writer->section_capacity) {
        size_t capacity = writer->section_capacity ? 2 * writer->section_capacity : 16;
        struct spl_section *grown = spl_realloc(writer->sections, capacity, sizeof *grown, err);
        if (!grown)
            return SPL_E_NOMEM;
        writer->sections = grown;
        writer->section_capacity = capacity;
    }
    struct spl_section section = {
        .type = type,
        .index = index,
        .offset = align(writer->offset, type == SPL_SECTION_PAGE ? SPL_FILE_ALIGNMENT : section_alignment),
        .bytes = bytes,
        .hash = XXH3_64bits(data, bytes),
    };
    int rc = spl_part_file_write(&writer->file, section.offset, data, bytes, err);
    if (rc)
        return rc;
    writer->sections[writer->section_count++] = section;
    writer->offset = section.offset + bytes;
    return SPL_OK;
}

static size_t page_bytes(size_t used_words, size_t tail_words)
{
    return align((used_words + tail_words) * sizeof(uint32_t), section_alignment);
}

static int flush_words(struct spl_dataset_writer *writer, uint32_t type, struct words *words, struct spl_error *err)
{
    size_t tail = type == SPL_SECTION_TEXTURES ? SPL_TEXTURE_TAIL_WORDS : SPL_PAGE_TAIL_WORDS;
    size_t bytes = page_bytes(words->used, tail), used = words->used * sizeof(uint32_t);
    memset((char *)words->at + used, 0, bytes - used);
    words->used = 0;
    return add_section(writer, type, writer->page_count, words->at, bytes, err);
}

/* Writes the page being filled, where there is one. */
static int flush_page(struct spl_dataset_writer *writer, struct spl_error *err)
{
    if (!writer->page_nodes)
        return SPL_OK;
    int rc = flush_words(writer, SPL_SECTION_PAGE, &writer->page, err);
    if (!rc && writer->dictionary)
        rc = flush_words(writer, SPL_SECTION_TEXTURES, &writer->textures, err);
    writer->page_count++;
    writer->page_nodes = writer->page_chunks = 0;
    return rc;
}

/* Makes room for `count` more words and the longer tail. */
static int reserve(struct words *words, size_t count, struct spl_error *err)
{
    size_t wanted = page_bytes(words->used + count, SPL_TEXTURE_TAIL_WORDS) / sizeof *words->at;
    if (wanted <= words->capacity)
        return SPL_OK;
    wanted = wanted > 2 * words->capacity ? wanted : 2 * words->capacity;
    uint32_t *grown = spl_realloc(words->at, wanted, sizeof *grown, err);
    if (!grown)
        return SPL_E_NOMEM;
    words->at = grown;
    words->capacity = wanted;
    return SPL_OK;
}

int spl_dataset_writer_create(const char *path, struct spl_dataset_writer **out, struct spl_error *err)
{
    *out = NULL;
    struct spl_dataset_writer *writer = spl_alloc(1, sizeof *writer, err);
    if (!writer)
        return SPL_E_NOMEM;
    writer->offset = sizeof(struct spl_file_header);
    writer->page_limit = SPL_PAGE_BYTES;
    int rc = reserve(&writer->page, SPL_PAGE_BYTES / sizeof(uint32_t) - SPL_PAGE_TAIL_WORDS, err);
    if (!rc)
        rc = spl_part_file_init(&writer->file, path, err);
    if (rc)
        spl_dataset_writer_destroy(writer);
    else
        *out = writer;
    return rc;
}

void spl_dataset_writer_set_page_bytes(struct spl_dataset_writer *writer, size_t bytes)
{
    spl_assert(bytes <= SPL_PAGE_BYTES_MAX);
    writer->page_limit = bytes;
}

int spl_dataset_writer_set_dictionary(struct spl_dataset_writer *writer, const struct spl_dictionary *dictionary,
                                      struct spl_error *err)
{
    spl_assert(!writer->page_count && !writer->page.used && dictionary->count);
    uint64_t bytes = spl_dictionary_expanded_bytes(dictionary->count, dictionary->size);
    if (bytes > SPL_DICTIONARY_BYTES_MAX)
        return spl_fail(err, SPL_E_LIMIT,
                        "%s: a dictionary of %u atoms of %u x %u takes %llu MiB on a device, more than its %u; "
                        "take fewer or smaller atoms",
                        writer->file.path, dictionary->count, dictionary->size, dictionary->size,
                        (unsigned long long)(bytes >> 20), SPL_DICTIONARY_BYTES_MAX >> 20);
    writer->dictionary = dictionary;
    return reserve(&writer->textures, 0, err);
}

/* Notes the words at which the chunks' codes lie in the page, and appends the codes. */
static int add_textures(struct spl_dataset_writer *writer, const struct spl_node_textures *textures, size_t chunk_count,
                        struct spl_error *err)
{
    struct words *to = &writer->textures, *of = &writer->chunk_textures;
    if (reserve(to, textures->word_count, err) || reserve(of, chunk_count, err))
        return SPL_E_NOMEM;
    for (size_t i = 0; i < chunk_count; i++) {
        uint32_t texture = textures->chunk_texture[i];
        of->at[of->used++] = texture ? texture + (uint32_t)to->used : 0;
    }
    memcpy(to->at + to->used, textures->words, textures->word_count * sizeof *to->at);
    to->used += textures->word_count;
    return SPL_OK;
}

int spl_dataset_writer_add_textured_node(struct spl_dataset_writer *writer, const uint32_t *words, size_t word_count,
                                         struct spl_chunk *chunks, size_t chunk_count,
                                         const struct spl_node_textures *textures, uint32_t *page,
                                         struct spl_error *err)
{
    struct words *to = &writer->page;
    size_t larger = word_count > textures->word_count ? word_count : textures->word_count;
    if (larger > SPL_PAGE_BYTES_MAX / sizeof(uint32_t) ||
        page_bytes(larger, SPL_TEXTURE_TAIL_WORDS) > SPL_PAGE_BYTES_MAX)
        return spl_fail(err, SPL_E_LIMIT, "%s: a node of %zu bytes is larger than a page can be (%u)",
                        writer->file.path, larger * sizeof(uint32_t), SPL_PAGE_BYTES_MAX);
    spl_assert(!writer->maps_added);
    if (writer->page_nodes &&
        (spl_head_bytes(writer->page_nodes + 1, writer->page_chunks + chunk_count, SPL_STREAMS_MAX, true,
                        writer->maps) > SPL_HEAD_BYTES_MAX ||
         page_bytes(to->used + word_count, SPL_PAGE_TAIL_WORDS) > writer->page_limit ||
         page_bytes(writer->textures.used + textures->word_count, SPL_TEXTURE_TAIL_WORDS) > writer->page_limit)) {
        int rc = flush_page(writer, err);
        if (rc)
            return rc;
    }
    int rc = reserve(to, word_count, err);
    if (!rc && writer->dictionary)
        rc = add_textures(writer, textures, chunk_count, err);
    if (rc)
        return rc;
    memcpy(to->at + to->used, words, word_count * sizeof *words);
    for (size_t i = 0; i < chunk_count; i++)
        chunks[i].geometry_word += (uint32_t)to->used;
    to->used += word_count;
    writer->page_nodes++;
    writer->page_chunks += chunk_count;
    *page = writer->page_count;
    return SPL_OK;
}

int spl_dataset_writer_add_node(struct spl_dataset_writer *writer, const uint32_t *words, size_t word_count,
                                struct spl_chunk *chunks, size_t chunk_count, uint32_t *page, struct spl_error *err)
{
    spl_assert(!writer->dictionary);
    return spl_dataset_writer_add_textured_node(writer, words, word_count, chunks, chunk_count,
                                                &(struct spl_node_textures){0}, page, err);
}

int spl_dataset_writer_set_maps(struct spl_dataset_writer *writer, const struct spl_map_row *rows, uint32_t count,
                                const struct spl_chunk_stations *stations, struct spl_error *err)
{
    spl_assert(!writer->page_count && !writer->page_nodes && count);
    if (count > SPL_MAPS_MAX)
        return spl_fail(err, SPL_E_LIMIT, "%s: maps of %u stations, and a file has those of %u at most",
                        writer->file.path, count, SPL_MAPS_MAX);
    for (uint32_t i = 0; i < count; i++) {
        const char *what = spl_map_judge(&rows[i]);
        if (what)
            return spl_fail(err, SPL_E_LIMIT, "%s: the map of station %u %s", writer->file.path, i, what);
    }
    writer->maps = rows;
    writer->map_count = count;
    writer->stations = stations;
    return SPL_OK;
}

int spl_dataset_writer_add_map(struct spl_dataset_writer *writer, const uint32_t *words, struct spl_error *err)
{
    spl_assert(writer->maps_added < writer->map_count);
    int rc = flush_page(writer, err);
    if (rc)
        return rc;
    uint32_t index = writer->maps_added++;
    return add_section(writer, SPL_SECTION_MAP, index, words, spl_map_words(&writer->maps[index]) * sizeof *words, err);
}

void spl_dataset_writer_set_streams(struct spl_dataset_writer *writer, const struct spl_stream *streams, uint32_t count)
{
    spl_assert(count <= SPL_STREAMS_MAX);
    writer->streams = streams;
    writer->stream_count = count;
}

/* META as the caller has it, "streams" and "counts"; NULL where memory is refused. */
static char *describe(const struct spl_dataset_writer *writer, const struct spl_counts *counts, const json_t *meta)
{
    json_t *whole = json_copy((json_t *)meta), *streams = json_array();
    bool failed = false;
    for (uint32_t s = 0; s < writer->stream_count; s++) {
        const struct spl_stream *stream = &writer->streams[s];
        json_t *row = json_pack("{s:s, s:s, s:s}", "name", stream->name, "type", stream->type, "unit", stream->unit);
        if (spl_stream_type_from_name(stream->type) == SPL_STREAM_STEPS) {
            failed |= json_object_set_new(row, "first", json_real(stream->first)) != 0;
            failed |= json_object_set_new(row, "steps_a_unit", json_real(stream->steps_a_unit)) != 0;
        }
        json_array_append_new(streams, row);
    }
    failed |= json_array_size(streams) != writer->stream_count;
    failed |= json_object_set_new(whole, "streams", streams) != 0;
    failed |= json_object_set_new(whole, "counts", spl_counts_to_json(counts, writer->stream_count)) != 0;
    char *text = failed ? NULL : json_dumps(whole, JSON_INDENT(1) | JSON_REAL_PRECISION(17));
    json_decref(whole);
    return text;
}

static int write_dictionary(struct spl_dataset_writer *writer, struct spl_error *err)
{
    const struct spl_dictionary *from = writer->dictionary;
    struct spl_atoms_header header = {.count = from->count, .size = from->size};
    spl_assert(from->coefficients);
    size_t stream = spl_atoms_write(from, NULL);
    uint8_t *bytes = spl_alloc_raw(sizeof header + stream, 1, err);
    if (!bytes)
        return SPL_E_NOMEM;
    memcpy(bytes, &header, sizeof header);
    spl_atoms_write(from, bytes + sizeof header);
    int rc = add_section(writer, SPL_SECTION_ATOMS, 0, bytes, sizeof header + stream, err);
    free(bytes);
    return rc;
}

/* What the caller has said of nodes and chunks, cut into pages. */
struct described {
    struct spl_tables *pages;
    struct spl_page_row *rows; /* and one that closes them */
    struct spl_counts counts;
};

/* Sums over the nodes in their order, and each page's part of the arrays, which are borrowed. */
static int cut_into_pages(struct spl_dataset_writer *writer, const struct spl_node *nodes, size_t node_count,
                          const struct spl_chunk *chunks, size_t chunk_count, struct described *out,
                          struct spl_error *err)
{
    struct spl_page_row row = {.first_child = 1};
    size_t n = 0;
    out->pages = spl_alloc(writer->page_count, sizeof *out->pages, err);
    out->rows = spl_alloc(writer->page_count + 1ull, sizeof *out->rows, err);
    if (!out->pages || !out->rows)
        return SPL_E_NOMEM;
    for (uint32_t page = 0; page < writer->page_count; page++) {
        struct spl_tables *tables = &out->pages[page];
        *tables = (struct spl_tables){.page = page,
                                      .stream_count = writer->stream_count,
                                      .first_node = row.first_node,
                                      .first_chunk = row.first_chunk,
                                      .nodes = (struct spl_node *)nodes + n,
                                      .chunks = (struct spl_chunk *)chunks + row.first_chunk};
        tables->textures = writer->dictionary ? writer->chunk_textures.at + row.first_chunk : NULL;
        tables->stations = writer->maps ? (struct spl_chunk_stations *)writer->stations + row.first_chunk : NULL;
        for (uint32_t s = 0; s < writer->stream_count; s++) {
            tables->base[s] = (uint32_t *)writer->streams[s].base + row.first_chunk;
            tables->width[s] = (uint8_t *)writer->streams[s].width + row.first_chunk;
        }
        out->rows[page] = row;
        for (; n < node_count && nodes[n].page == page; n++) {
            row.first_child += nodes[n].child_count;
            row.first_chunk += nodes[n].chunk_count;
        }
        row.first_node = n;
        tables->node_count = (uint32_t)(n - tables->first_node);
        tables->chunk_count = (uint32_t)(row.first_chunk - tables->first_chunk);
        spl_assert(row.first_chunk <= chunk_count);
        for (uint32_t c = 0; c < tables->chunk_count; c++)
            row.first_id += tables->chunks[c].count;
        spl_counts_add_tables(&out->counts, tables);
    }
    out->rows[writer->page_count] = row;
    spl_assert(n == node_count && row.first_chunk == chunk_count); /* pages rise */
    spl_assert(!writer->dictionary || writer->chunk_textures.used == chunk_count);
    spl_assert(writer->maps_added == writer->map_count);
    return SPL_OK;
}

static int write_head(struct spl_dataset_writer *writer, const struct spl_tables *tables, struct spl_error *err)
{
    size_t size = spl_head_bytes(tables->node_count, tables->chunk_count, tables->stream_count, tables->textures,
                                 tables->stations);
    char *bytes = spl_alloc_raw(size, 1, err);
    if (!bytes)
        return SPL_E_NOMEM;
    spl_head_write(tables, bytes);
    int rc = add_section(writer, SPL_SECTION_HEAD, tables->page, bytes, size, err);
    free(bytes);
    return rc;
}

static int write_rest(struct spl_dataset_writer *writer, const struct described *what, const char *meta,
                      struct spl_error *err)
{
    int rc = add_section(writer, SPL_SECTION_META, 0, meta, strlen(meta), err);
    if (!rc)
        rc = add_section(writer, SPL_SECTION_DIRECTORY, 0, what->rows, (writer->page_count + 1ull) * sizeof *what->rows,
                         err);
    if (!rc && writer->maps)
        rc = add_section(writer, SPL_SECTION_STATIONS, 0, writer->maps, writer->map_count * sizeof *writer->maps, err);
    for (uint32_t page = 0; page < writer->page_count && !rc; page++)
        rc = write_head(writer, &what->pages[page], err);
    if (!rc && writer->dictionary)
        rc = write_dictionary(writer, err);
    if (rc)
        return rc;
    size_t table_bytes = writer->section_count * sizeof *writer->sections;
    struct spl_file_header header = {
        .magic = SPL_FILE_MAGIC,
        .version = SPL_FILE_VERSION,
        .header_bytes = sizeof header,
        .table_offset = align(writer->offset, section_alignment),
        .section_count = (uint32_t)writer->section_count,
        .table_hash = XXH3_64bits(writer->sections, table_bytes),
    };
    header.file_bytes = header.table_offset + table_bytes;
    header.header_hash = XXH3_64bits(&header, offsetof(struct spl_file_header, header_hash));
    rc = spl_part_file_write(&writer->file, header.table_offset, writer->sections, table_bytes, err);
    return rc ? rc : spl_part_file_write(&writer->file, 0, &header, sizeof header, err);
}

static int finish(struct spl_dataset_writer *writer, const struct described *what, const json_t *meta,
                  struct spl_error *err)
{
    char *text = describe(writer, &what->counts, meta);
    if (!text)
        return spl_fail(err, SPL_E_NOMEM, "out of memory for the description of %s", writer->file.path);
    int rc = strlen(text) > SPL_META_BYTES_MAX
                 ? spl_fail(err, SPL_E_LIMIT, "what describes the dataset has %zu bytes, a file takes %u", strlen(text),
                            SPL_META_BYTES_MAX)
                 : write_rest(writer, what, text, err);
    if (!rc)
        rc = spl_part_file_commit(&writer->file, err);
    free(text);
    return rc;
}

int spl_dataset_writer_finish(struct spl_dataset_writer *writer, const struct spl_node *nodes, size_t node_count,
                              const struct spl_chunk *chunks, size_t chunk_count, const json_t *meta,
                              struct spl_error *err)
{
    struct described what = {0};
    spl_assert(!writer->file.committed && node_count && chunk_count);
    int rc = flush_page(writer, err);
    if (!rc)
        rc = cut_into_pages(writer, nodes, node_count, chunks, chunk_count, &what, err);
    if (!rc)
        rc = finish(writer, &what, meta, err);
    free(what.pages);
    free(what.rows);
    return rc;
}

void spl_dataset_writer_destroy(struct spl_dataset_writer *writer)
{
    if (!writer)
        return;
    spl_part_file_finish(&writer->file);
    free(writer->sections);
    free(writer->page.at);
    free(writer->textures.at);
    free(writer->chunk_textures.at);
    free(writer);
}
