/* The table of chunks of a LAZ file: where each begins and how many points it has. Pure. */
#ifndef SPL_CLOUD_LAZ_TABLE_H
#define SPL_CLOUD_LAZ_TABLE_H

#include "cloud/laz/format.h"

struct spl_laz_chunk {
    uint64_t at, first; /* in the file; the number of its first point */
    uint32_t bytes, points;
};

struct spl_laz_table {
    struct spl_laz_chunk *chunks; // owned
    size_t count;
};

/* Reads the table from its bytes: chunks lie one behind the other from `begin` to `end`, where the table is, and have
 * `points` points in all. What does not agree with that is a fault: its offset counts from the table's first byte. On
 * failure nothing is held. */
int spl_laz_table_read(struct spl_laz_table *table, const uint8_t *bytes, size_t length,
                       const struct spl_laz_format *format, uint64_t begin, uint64_t end, uint64_t points,
                       struct spl_laz_fault *fault, struct spl_error *err);

void spl_laz_table_finish(struct spl_laz_table *table);

#endif
