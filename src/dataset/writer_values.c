/* What META says of the values of optional attributes, and of heights, from the codes of the leaves as they were
 * written: they are read again page by page, so whoever writes a file, of whatever was packed, pruned or coloured, has
 * them right. Owned by the writer's thread. */
#include <stdlib.h>

#include "base/memory.h"
#include "dataset/chunk.h"
#include "dataset/panels.h"
#include "dataset/values.h"
#include "dataset/writer_parts.h"

/* Leaf splats that item `i` of a chunk stands for: of panels an even part of the points of all. */
static uint64_t weight_of(const struct spl_chunk *chunk, uint32_t i)
{
    if (!spl_kind_has_panels(spl_chunk_kind(chunk)))
        return 1;
    const uint64_t points = spl_panels_get_points(chunk);
    return points * (i + 1) / chunk->count - points * i / chunk->count;
}

static int add_chunk(const struct spl_dataset_writer *writer, const struct spl_tables *tables, uint32_t index,
                     double origin, const uint32_t *page, uint64_t page_words, struct spl_values *values,
                     struct spl_values *heights, struct spl_error *err)
{
    const struct spl_chunk *chunk = &tables->chunks[index];
    const uint64_t first = (uint64_t)chunk->geometry_word + spl_chunk_words(chunk);
    const uint32_t *words = page + first;
    int rc = SPL_OK;
    if (spl_chunk_kind(chunk) == SPL_CHUNK_LINES) /* vertices have none */
        return SPL_OK;
    if (first + spl_tables_get_stream_words(tables, writer->stream_count, index) + SPL_PAGE_TAIL_WORDS > page_words)
        return SPL_OK; /* no chunk of that page: whoever opens the file refuses it */
    for (uint32_t i = 0; i < chunk->count && !rc; i++) {
        struct spl_splat splat; /* of a panel the one that it is from afar */
        spl_chunk_decode(chunk, page, i, &splat);
        rc = spl_values_add(heights, origin + (double)splat.position[2], weight_of(chunk, i), err);
    }
    for (uint32_t s = 0; s < writer->stream_count && !rc; s++) {
        const struct spl_stream_code code = {tables->base[s][index], tables->width[s][index]};
        for (uint32_t i = 0; i < chunk->count && !rc; i++)
            rc = spl_values_add(&values[s], spl_stream_decode(&writer->streams[s], code, words, i),
                                weight_of(chunk, i), err);
        words += spl_stream_words(code.width, chunk->count);
    }
    return rc;
}

/* The section of a page, from `*at` on: they lie in their order. */
static const struct spl_section *find_page(const struct spl_dataset_writer *writer, uint32_t page, size_t *at)
{
    while (writer->sections[*at].type != SPL_SECTION_PAGE || writer->sections[*at].index != page)
        spl_assert(++*at < writer->section_count);
    return &writer->sections[*at];
}

int spl_writer_gather_values(struct spl_dataset_writer *writer, const struct spl_tables *pages,
                             struct spl_stream_values *out, struct spl_stream_values *out_heights,
                             struct spl_error *err)
{
    struct spl_values values[SPL_STREAMS_MAX] = {0}, heights = {.too_many_kinds = true};
    uint32_t *words = NULL;
    uint64_t room = 0;
    size_t at = 0;
    int rc = SPL_OK;
    for (uint32_t page = 0; page < writer->page_count && !rc; page++) {
        const struct spl_tables *tables = &pages[page];
        const struct spl_section *section = find_page(writer, page, &at);
        uint32_t chunk = 0;
        if (section->bytes > room) {
            uint32_t *larger = spl_realloc(words, section->bytes, 1, err);
            if (!larger) {
                rc = SPL_E_NOMEM;
                break;
            }
            words = larger;
            room = section->bytes;
        }
        rc = spl_part_file_read(&writer->file, section->offset, words, section->bytes, err);
        for (uint32_t n = 0; n < tables->node_count; n++)
            for (uint32_t c = 0; c < tables->nodes[n].chunk_count; c++, chunk++)
                if (!tables->nodes[n].child_count && !rc)
                    rc = add_chunk(writer, tables, chunk, tables->nodes[n].origin[2], words,
                                   section->bytes / sizeof *words, values, &heights, err);
    }
    spl_values_sum_up(&heights, out_heights);
    spl_values_finish(&heights);
    for (uint32_t s = 0; s < writer->stream_count; s++) {
        spl_values_sum_up(&values[s], &out[s]);
        spl_values_finish(&values[s]);
    }
    free(words);
    return rc;
}
