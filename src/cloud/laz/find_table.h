/* Where a LAZ file has its table of chunks. */
#ifndef SPL_CLOUD_LAZ_FIND_TABLE_H
#define SPL_CLOUD_LAZ_FIND_TABLE_H

#include "cloud/laz/table.h"
#include "cloud/source.h"

struct spl_laz_found_table {
    struct spl_laz_table table;   // owned by the caller, where has_table
    bool has_table;
    uint64_t begin;               /* offset of the first chunk */
    struct spl_laz_fault warning; /* why there is none, where one was to be; field NULL: nothing is wrong */
};

/* Reads the table of a file whose points begin at `points_at`, where it lies, if it lies anywhere. One that is wrong is
 * done without where chunks are of one size, else SPL_E_INPUT says what is wrong with it. *out is filled in any case.
 * Blocks on disk. */
int spl_laz_table_find(struct spl_source *source, const struct spl_laz_format *format, uint64_t points_at,
                       uint64_t points, struct spl_laz_found_table *out, struct spl_error *err);

#endif
