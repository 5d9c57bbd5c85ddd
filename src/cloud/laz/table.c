/* The table of chunks: version, number, then each chunk's points (where they vary) and bytes, coded as integers that
 * the ones before predict.
 *
 * Invariant: a table that was read has as many points as the file and none of its chunks leaves the point data. */
#include "cloud/laz/table.h"

#include <stdlib.h>

#include "base/array.h"
#include "base/memory.h"
#include "cloud/laz/integer.h"
#include "cloud/little.h"

enum { head_bytes = 8, context_points = 0, context_bytes = 1 };

static int check_sums(const struct spl_laz_table *table, uint64_t bytes, uint64_t room, uint64_t points,
                      uint64_t expected, bool variable, struct spl_laz_fault *fault)
{
    if (bytes > room)
        return spl_laz_fail(fault, SPL_E_INPUT, head_bytes, "chunk table",
                            "%zu chunks take %llu bytes, but the points have %llu", table->count,
                            (unsigned long long)bytes, (unsigned long long)room);
    if (variable ? points != expected : points < expected)
        return spl_laz_fail(fault, SPL_E_INPUT, head_bytes, "chunk table",
                            "%zu chunks have %llu points, but the file has %llu", table->count,
                            (unsigned long long)points, (unsigned long long)expected);
    return SPL_OK;
}

int spl_laz_table_read(struct spl_laz_table *table, const uint8_t *bytes, size_t length,
                       const struct spl_laz_format *format, uint64_t begin, uint64_t end, uint64_t points,
                       struct spl_laz_fault *fault, struct spl_error *err)
{
    *table = (struct spl_laz_table){0};
    if (length < head_bytes)
        return spl_laz_fail(fault, SPL_E_INPUT, 0, "chunk table", "%zu bytes are fewer than its head of %d", length,
                            head_bytes);
    uint32_t version = spl_le_get32(bytes), count = spl_le_get32(bytes + 4);
    if (version != 0)
        return spl_laz_fail(fault, SPL_E_INPUT, 0, "chunk table", "version %u is not known here (0 is)", version);
    /* a chunk has a record, at least */
    if (count > (end - begin) / format->record_bytes)
        return spl_laz_fail(fault, SPL_E_INPUT, 4, "chunk table", "%u chunks do not fit %llu bytes", count,
                            (unsigned long long)(end - begin));
    size_t room = spl_laz_integer_bytes(32, 2), capacity = 0;
    struct spl_laz_arena arena = {.bytes = spl_alloc_raw(room, 1, err), .capacity = room};
    struct spl_laz_integer integer;
    struct spl_laz_coder coder;
    uint64_t at = begin, sum = 0;
    bool variable = format->chunk_points == 0;
    uint32_t of_points = 0, of_bytes = 0;
    int code = arena.bytes ? SPL_OK : SPL_E_NOMEM;
    spl_laz_integer_init(&integer, 32);
    spl_laz_coder_begin(&coder, bytes + head_bytes, length - head_bytes);
    for (uint32_t i = 0; code == SPL_OK && i < count; i++) {
        of_points =
            variable ? spl_laz_integer_read(&integer, &coder, &arena, of_points, context_points) : format->chunk_points;
        of_bytes = spl_laz_integer_read(&integer, &coder, &arena, of_bytes, context_bytes);
        if (spl_laz_coder_is_over(&coder))
            code =
                spl_laz_fail(fault, SPL_E_INPUT, head_bytes, "chunk table", "it ends inside chunk %u of %u", i, count);
        else
            code = spl_array_reserve(table->chunks, capacity, table->count + 1, err);
        if (code < 0)
            break;
        table->chunks[table->count++] =
            (struct spl_laz_chunk){.at = at, .first = sum, .bytes = of_bytes, .points = of_points};
        at += of_bytes;
        sum += of_points;
    }
    if (code == SPL_OK)
        code = check_sums(table, at - begin, end - begin, sum, points, variable, fault);
    if (code == SPL_OK && !variable && table->count > 0) {
        uint64_t before = (uint64_t)format->chunk_points * (table->count - 1);
        if (before >= points)
            code = spl_laz_fail(fault, SPL_E_INPUT, 4, "chunk table", "%zu chunks are more than %llu points need",
                                table->count, (unsigned long long)points);
        else
            table->chunks[table->count - 1].points = (uint32_t)(points - before);
    }
    free(arena.bytes);
    if (code < 0)
        spl_laz_table_finish(table);
    return code;
}

void spl_laz_table_finish(struct spl_laz_table *table)
{
    free(table->chunks);
    *table = (struct spl_laz_table){0};
}
