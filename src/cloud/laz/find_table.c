/* The table of chunks where it lies: its offset stands before the first chunk, or, of writers that could not go back,
 * in the file's last eight bytes. A writer that was interrupted left none.
 *
 * Nothing of the file is trusted: no more is read of a table than its chunks can need, each of which has a point that
 * is stored as it is. The cloud's thread. */
#include "cloud/laz/find_table.h"

#include <stdlib.h>

#include "base/memory.h"
#include "cloud/little.h"

enum { table_entry_bytes = 24 };

int spl_laz_table_find(struct spl_source *source, const struct spl_laz_format *format, uint64_t points_at,
                       uint64_t points, struct spl_laz_found_table *out, struct spl_error *err)
{
    struct spl_laz_fault fault = {0};
    uint8_t bytes[8];
    uint64_t at, size = source->size;
    *out = (struct spl_laz_found_table){.begin = points_at};
    if (size - points_at < sizeof bytes)
        return spl_source_fail_at(source, points_at, "chunk table", err, "the file ends before the table's offset");
    int code = spl_source_read_at(source, points_at, bytes, sizeof bytes, err);
    if (code == SPL_OK && spl_le_get64(bytes) == UINT64_MAX)
        code = spl_source_read_at(source, size - sizeof bytes, bytes, sizeof bytes, err);
    if (code < 0)
        return code;
    out->begin = points_at + sizeof bytes;
    at = spl_le_get64(bytes);
    bool interrupted = at == out->begin || at == points_at;
    if (!interrupted && at > out->begin && at < size) {
        uint64_t left = size - at, most = 8 + table_entry_bytes * ((at - out->begin) / format->record_bytes + 1);
        size_t length = (size_t)(left < most ? left : most);
        uint8_t *table = spl_alloc_raw(length, 1, err);
        code = table ? spl_source_read_at(source, at, table, length, err) : SPL_E_NOMEM;
        if (code == SPL_OK)
            code = spl_laz_table_read(&out->table, table, length, format, out->begin, at, points, &fault, err);
        free(table);
        out->has_table = code == SPL_OK;
        if (code != SPL_E_INPUT || (err && err->code))
            return code;
    } else {
        spl_laz_fail(&fault, SPL_E_INPUT, 0, "chunk table", "it is missing, since its writer was interrupted");
        if (!interrupted)
            spl_laz_fail(&fault, SPL_E_INPUT, points_at - at, "chunk table",
                         "its offset %llu lies outside the points and the file's %llu bytes", (unsigned long long)at,
                         (unsigned long long)size);
    }
    if (format->chunk_points == 0)
        return spl_source_fail_at(source, at + fault.at, fault.field, err, "%s; chunks of varying size need one",
                                  fault.reason);
    fault.at += at;
    if (!interrupted)
        out->warning = fault;
    return SPL_OK;
}
