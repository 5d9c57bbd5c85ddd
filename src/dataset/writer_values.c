/* What META says of the values of optional attributes, and of heights, from the codes of the leaves as they were
 * written: they are read again page by page, so whoever writes a file, of whatever was packed, pruned or coloured, has
 * them right. Each attribute's are added in the order of the leaves, several attributes at once. */
#include <stdlib.h>

#include "base/memory.h"
#include "base/parallel.h"
#include "dataset/chunk.h"
#include "dataset/codec.h"
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

/* A page at work: each stream's values, and heights, are a task, so that sums are taken in the order of the items. */
struct gather {
    const struct spl_dataset_writer *writer;
    const struct spl_tables *tables;
    const uint32_t *page;
    uint64_t page_words;
    struct spl_values values[SPL_STREAMS_MAX + 1]; /* the last: heights */
    int rc[SPL_STREAMS_MAX + 1];
};

static int add_heights(struct spl_values *values, const struct spl_chunk *chunk, const uint32_t *page, double origin)
{
    int rc = SPL_OK;
    for (uint32_t i = 0; i < chunk->count && !rc; i++) {
        struct spl_splat splat; /* of a panel the one that it is from afar */
        if (spl_chunk_kind(chunk) == SPL_CHUNK_DISCS)
            spl_discs_decode_position(chunk, page, i, splat.position);
        else
            spl_chunk_decode(chunk, page, i, &splat);
        rc = spl_values_add(values, origin + (double)splat.position[2], weight_of(chunk, i), NULL);
    }
    return rc;
}

static int add_stream(const struct gather *g, uint32_t stream, struct spl_values *values, uint32_t index,
                      const uint32_t *words)
{
    const struct spl_tables *tables = g->tables;
    const struct spl_chunk *chunk = &tables->chunks[index];
    const struct spl_stream_code code = {tables->base[stream][index], tables->width[stream][index]};
    int rc = SPL_OK;
    for (uint32_t s = 0; s < stream; s++)
        words += spl_stream_words(tables->width[s][index], chunk->count);
    for (uint32_t i = 0; i < chunk->count && !rc; i++)
        rc = spl_values_add(values, spl_stream_decode(&g->writer->streams[stream], code, words, i), weight_of(chunk, i),
                            NULL);
    return rc;
}

static int add_chunk(const struct gather *g, uint32_t task, struct spl_values *values, uint32_t index, double origin)
{
    const struct spl_chunk *chunk = &g->tables->chunks[index];
    const uint64_t first = (uint64_t)chunk->geometry_word + spl_chunk_words(chunk);
    const uint32_t streams = g->writer->stream_count;
    if (spl_chunk_kind(chunk) == SPL_CHUNK_LINES) /* vertices have none */
        return SPL_OK;
    if (first + spl_tables_get_stream_words(g->tables, streams, index) + SPL_PAGE_TAIL_WORDS > g->page_words)
        return SPL_OK; /* no chunk of that page: whoever opens the file refuses it */
    return task < streams ? add_stream(g, task, values, index, g->page + first)
                          : add_heights(values, chunk, g->page, origin);
}

static void add_page(void *context, size_t begin, size_t end, unsigned worker)
{
    struct gather *g = context;
    (void)worker;
    for (size_t task = begin; task < end; task++) {
        struct spl_values *values = &g->values[task < g->writer->stream_count ? task : SPL_STREAMS_MAX];
        uint32_t chunk = 0;
        for (uint32_t n = 0; n < g->tables->node_count; n++)
            for (uint32_t c = 0; c < g->tables->nodes[n].chunk_count; c++, chunk++)
                if (!g->tables->nodes[n].child_count && !g->rc[task])
                    g->rc[task] = add_chunk(g, (uint32_t)task, values, chunk, g->tables->nodes[n].origin[2]);
    }
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
    struct gather g = {.writer = writer, .values[SPL_STREAMS_MAX].too_many_kinds = true};
    uint32_t *words = NULL;
    uint64_t room = 0;
    size_t at = 0;
    int rc = SPL_OK;
    for (uint32_t page = 0; page < writer->page_count && !rc; page++) {
        const struct spl_section *section = find_page(writer, page, &at);
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
        g.tables = &pages[page];
        g.page = words;
        g.page_words = section->bytes / sizeof *words;
        if (!rc)
            spl_parallel_for(writer->threads, writer->stream_count + 1, 1, add_page, &g);
        for (uint32_t task = 0; task <= writer->stream_count && !rc; task++)
            if (g.rc[task])
                rc = spl_fail(err, g.rc[task], "out of memory for the values of attributes");
    }
    for (uint32_t s = 0; s < writer->stream_count; s++)
        spl_values_sum_up(&g.values[s], &out[s]);
    spl_values_sum_up(&g.values[SPL_STREAMS_MAX], out_heights);
    for (uint32_t s = 0; s <= SPL_STREAMS_MAX; s++)
        spl_values_finish(&g.values[s]);
    free(words);
    return rc;
}
