/* Pages of the hierarchy, each a list of nodes and of further pages. Files lie about it, are edited by programs that
 * know only LAZ, and may be made to lead in circles: so it counts only as far as the table of chunks says the same,
 * chunk by chunk, and nothing is allocated by what it says alone.
 *
 * Invariant: a hierarchy that was read has each chunk once. Owned by the cloud's thread. */
#include "cloud/copc.h"

#include <stdlib.h>
#include <string.h>

#include "base/array.h"
#include "base/log.h"
#include "base/memory.h"
#include "cloud/laz/items.h"

enum { record_id = 1, root_at = 40, entry_bytes = 32, no_level = 0xff };
/* An inner node without points is rare, and a page saves a request for many nodes. */
enum { entries_a_chunk = 16, entries_spare = 1024 };

struct page {
    uint64_t at, bytes, said_at; /* where it lies, and where that is said */
};

struct walk {
    const struct spl_source *source;
    const struct spl_laz_table *table;
    struct spl_copc_levels *levels;
    struct spl_laz_fault *fault;
    struct page *pages; // owned; a stack
    size_t count, capacity;
    uint64_t entries_left;
    size_t chunks_left; /* that no node has named yet */
};

static const struct spl_laz_chunk *find_chunk(const struct spl_laz_table *table, uint64_t at)
{
    size_t low = 0, high = table->count;
    while (low < high) {
        size_t middle = low + (high - low) / 2;
        if (table->chunks[middle].at < at)
            low = middle + 1;
        else
            high = middle;
    }
    return low < table->count && table->chunks[low].at == at ? &table->chunks[low] : NULL;
}

static int take_node(struct walk *w, const uint8_t *entry, uint64_t at)
{
    uint32_t level = spl_le_get32(entry), bytes = spl_le_get32(entry + 24), points = spl_le_get32(entry + 28);
    uint64_t offset = spl_le_get64(entry + 16);
    const struct spl_laz_chunk *chunk = find_chunk(w->table, offset);
    if (level >= SPL_COPC_LEVELS)
        return spl_laz_fail(w->fault, SPL_E_INPUT, at, "COPC hierarchy", "a node of level %d; 0 to %d are known",
                            (int32_t)level, SPL_COPC_LEVELS - 1);
    if (!chunk || chunk->bytes != bytes || chunk->points != points)
        return spl_laz_fail(w->fault, SPL_E_INPUT, at + 16, "COPC hierarchy",
                            "a node of %u points in %u bytes at %llu, where there is no such chunk", points, bytes,
                            (unsigned long long)offset);
    uint8_t *known = &w->levels->level[chunk - w->table->chunks];
    if (*known != no_level)
        return spl_laz_fail(w->fault, SPL_E_INPUT, at + 16, "COPC hierarchy",
                            "the chunk at %llu is named twice: pages lead in a circle, or overlap",
                            (unsigned long long)offset);
    *known = (uint8_t)level;
    w->levels->points[level] += points;
    w->chunks_left--;
    return SPL_OK;
}

static int add_page(struct walk *w, uint64_t at, uint64_t bytes, uint64_t said_at, struct spl_error *err)
{
    if (bytes == 0 || bytes % entry_bytes || at > w->source->size || bytes > w->source->size - at)
        return spl_laz_fail(w->fault, SPL_E_INPUT, said_at, "COPC hierarchy",
                            "a page of %llu bytes at %llu; the file has %llu, and a node %d", (unsigned long long)bytes,
                            (unsigned long long)at, (unsigned long long)w->source->size, entry_bytes);
    if (bytes / entry_bytes > w->entries_left)
        return spl_laz_fail(w->fault, SPL_E_INPUT, said_at, "COPC hierarchy",
                            "far more nodes than the %zu chunks: pages lead in a circle, or overlap", w->table->count);
    if (spl_array_reserve(w->pages, w->capacity, w->count + 1, err))
        return SPL_E_NOMEM;
    w->entries_left -= bytes / entry_bytes;
    w->pages[w->count++] = (struct page){at, bytes, said_at};
    return SPL_OK;
}

static int take_page(struct walk *w, struct page page, struct spl_error *err)
{
    uint8_t *bytes = spl_alloc_raw((size_t)page.bytes, 1, err);
    int code = bytes ? spl_source_read_at(w->source, page.at, bytes, (size_t)page.bytes, err) : SPL_E_NOMEM;
    for (size_t i = 0; code == SPL_OK && i < page.bytes; i += entry_bytes) {
        const uint8_t *entry = bytes + i;
        int32_t points = (int32_t)spl_le_get32(entry + 28);
        uint64_t at = page.at + i;
        if (points < -1)
            code = spl_laz_fail(w->fault, SPL_E_INPUT, at + 28, "COPC hierarchy", "a node of %d points", points);
        else if (points > 0)
            code = take_node(w, entry, at);
        else if (points == -1)
            code = add_page(w, spl_le_get64(entry + 16), spl_le_get32(entry + 24), at + 16, err);
    }
    free(bytes);
    return code;
}

int spl_copc_read_levels(struct spl_copc_levels *levels, const struct spl_source *source,
                         const uint8_t info[SPL_COPC_INFO_BYTES], uint64_t info_at, const struct spl_laz_table *table,
                         struct spl_laz_fault *fault, struct spl_error *err)
{
    struct walk w = {.source = source,
                     .table = table,
                     .levels = levels,
                     .fault = fault,
                     .entries_left = (uint64_t)table->count * entries_a_chunk + entries_spare};
    *levels = (struct spl_copc_levels){.level = spl_alloc_raw(table->count, 1, err)};
    if (!levels->level)
        return SPL_E_NOMEM;
    memset(levels->level, no_level, table->count);
    for (size_t i = 0; i < table->count; i++)
        w.chunks_left += table->chunks[i].points > 0;
    int code = add_page(&w, spl_le_get64(info + root_at), spl_le_get64(info + root_at + 8), info_at + root_at, err);
    while (code == SPL_OK && w.count > 0)
        code = take_page(&w, w.pages[--w.count], err);
    if (code == SPL_OK && w.chunks_left > 0)
        code = spl_laz_fail(fault, SPL_E_INPUT, info_at + root_at, "COPC hierarchy",
                            "%zu of %zu chunks are no node's: points were added by a program that does not know it",
                            w.chunks_left, table->count);
    free(w.pages);
    if (code < 0)
        spl_copc_levels_finish(levels);
    return code;
}

void spl_copc_levels_finish(struct spl_copc_levels *levels)
{
    free(levels->level);
    *levels = (struct spl_copc_levels){0};
}

/* Levels up to the one whose points no longer fit. */
static void choose(struct spl_laz_stream *stream, const struct spl_copc_levels *levels, uint64_t most, uint64_t *points)
{
    unsigned count = 0;
    uint64_t sum = 0;
    while (count < SPL_COPC_LEVELS && (sum == 0 || levels->points[count] <= most - sum) && (sum < most || sum == 0))
        sum += levels->points[count++];
    if (sum == 0)
        return;
    for (size_t i = 0; i < spl_laz_stream_get_table(stream)->count; i++)
        levels->level[i] = levels->level[i] < count;
    spl_laz_stream_choose(stream, levels->level);
    *points = sum;
}

int spl_copc_take_levels(struct spl_cloud *cloud, struct spl_las_record records, struct spl_laz_stream *stream,
                         uint64_t most, uint64_t *points, struct spl_error *err)
{
    const struct spl_laz_table *table = spl_laz_stream_get_table(stream);
    struct spl_copc_levels levels = {0};
    struct spl_laz_fault fault = {0};
    const uint8_t *bytes;
    uint8_t info[SPL_COPC_INFO_BYTES];
    size_t available;
    bool found, first = !cloud->options->colors;
    int code = spl_las_find(cloud, &records, "copc", record_id, &found, err);
    if (code < 0 || !found || !table || records.bytes < sizeof info || !(first || most))
        return code;
    spl_source_seek(&cloud->source, records.content);
    if ((code = spl_source_peek(&cloud->source, sizeof info, &bytes, &available, err)) < 0)
        return code;
    if (available < sizeof info)
        return SPL_OK;
    memcpy(info, bytes, sizeof info);
    code = spl_copc_read_levels(&levels, &cloud->source, info, records.content, table, &fault, err);
    if (code == SPL_E_INPUT && fault.field) {
        if (first)
            spl_log_warn("%s: offset %llu: %s: %s; points are read in the file's order", cloud->source.path,
                         (unsigned long long)fault.at, fault.field, fault.reason);
        return SPL_OK;
    }
    if (code == SPL_OK && most && most < *points)
        choose(stream, &levels, most, points);
    spl_copc_levels_finish(&levels);
    return code;
}
