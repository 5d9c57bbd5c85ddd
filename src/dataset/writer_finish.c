/* What describes the pages of a file that is being written: META, the directory, a head of each page, the dictionary of
 * textures, and the header, which makes it a dataset. The caller's nodes and chunks are cut into pages here, and sums
 * are taken over them in their order. Owned by the writer's thread. */
#include <stdlib.h>
#include <string.h>

#include <xxhash.h>

#include "base/memory.h"
#include "dataset/atoms.h"
#include "dataset/counts.h"
#include "dataset/dataset.h"
#include "dataset/head.h"
#include "dataset/values.h"
#include "dataset/writer_parts.h"

/* META as the caller has it, "streams", "heights" and "counts"; NULL where memory is refused. */
static char *describe(const struct spl_dataset_writer *writer, const struct spl_counts *counts,
                      const struct spl_stream_values *values, const struct spl_stream_values *heights,
                      const json_t *meta)
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
        if (values[s].count)
            failed |= json_object_set_new(row, "values", spl_values_to_json(&values[s])) != 0;
        json_array_append_new(streams, row);
    }
    failed |= json_array_size(streams) != writer->stream_count;
    failed |= json_object_set_new(whole, "streams", streams) != 0;
    json_object_del(whole, "heights"); // of the file that this one is made of
    if (heights->count)
        failed |= json_object_set_new(whole, "heights", spl_values_to_json(heights)) != 0;
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
    int rc = spl_writer_add_section(writer, SPL_SECTION_ATOMS, 0, bytes, sizeof header + stream, err);
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
    int rc = spl_writer_add_section(writer, SPL_SECTION_HEAD, tables->page, bytes, size, err);
    free(bytes);
    return rc;
}

static int write_rest(struct spl_dataset_writer *writer, const struct described *what, const char *meta,
                      struct spl_error *err)
{
    int rc = spl_writer_add_section(writer, SPL_SECTION_META, 0, meta, strlen(meta), err);
    if (!rc)
        rc = spl_writer_add_section(writer, SPL_SECTION_DIRECTORY, 0, what->rows,
                                    (writer->page_count + 1ull) * sizeof *what->rows, err);
    if (!rc && writer->maps)
        rc = spl_writer_add_section(writer, SPL_SECTION_STATIONS, 0, writer->maps,
                                    writer->map_count * sizeof *writer->maps, err);
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
        .table_offset = spl_align(writer->offset, SPL_SECTION_ALIGNMENT),
        .section_count = (uint32_t)writer->section_count,
        .table_hash = XXH3_64bits(writer->sections, table_bytes),
    };
    header.file_bytes = header.table_offset + table_bytes;
    header.header_hash = XXH3_64bits(&header, offsetof(struct spl_file_header, header_hash));
    rc = spl_part_file_write(&writer->file, header.table_offset, writer->sections, table_bytes, err);
    return rc ? rc : spl_part_file_write(&writer->file, 0, &header, sizeof header, err);
}

static int check(const struct spl_dataset_writer *writer, struct spl_error *err)
{
    struct spl_dataset_source source;
    struct spl_dataset *dataset = NULL;
    struct spl_error why = {0};
    int rc = spl_dataset_source_open_file(writer->file.part_path, &source, err);
    if (rc)
        return rc;
    if ((rc = spl_dataset_open_source(&source, "it", false, NULL, &dataset, &why)))
        spl_dataset_source_close(&source);
    spl_dataset_close(dataset);
    return rc ? spl_fail_field(err, rc, why.field, "%s is not written, as what it is made of does not fit: %s",
                               writer->file.path, why.message)
              : SPL_OK;
}

static int finish(struct spl_dataset_writer *writer, const struct described *what, const json_t *meta,
                  struct spl_error *err)
{
    struct spl_stream_values *values = spl_alloc(SPL_STREAMS_MAX + 1, sizeof *values, err);
    struct spl_stream_values *heights = values + SPL_STREAMS_MAX;
    int gathered = values ? spl_writer_gather_values(writer, what->pages, values, heights, err) : SPL_E_NOMEM;
    if (gathered) {
        free(values);
        return gathered;
    }
    char *text = describe(writer, &what->counts, values, heights, meta);
    free(values);
    if (!text)
        return spl_fail(err, SPL_E_NOMEM, "out of memory for the description of %s", writer->file.path);
    int rc = strlen(text) > SPL_META_BYTES_MAX
                 ? spl_fail(err, SPL_E_LIMIT, "what describes the dataset has %zu bytes, a file takes %u", strlen(text),
                            SPL_META_BYTES_MAX)
                 : write_rest(writer, what, text, err);
    if (!rc && writer->checked)
        rc = check(writer, err);
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
    int rc = spl_writer_flush_page(writer, err);
    if (!rc)
        rc = cut_into_pages(writer, nodes, node_count, chunks, chunk_count, &what, err);
    if (!rc)
        rc = finish(writer, &what, meta, err);
    free(what.pages);
    free(what.rows);
    return rc;
}
