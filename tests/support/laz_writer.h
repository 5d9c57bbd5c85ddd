/* Chunks of LAZ from records, for every item and version: what decoders are tested with where there are no scans.
 * Written after the format and not after the decoder: straight through, all fields of a record in turn. */
#ifndef SPL_TEST_LAZ_WRITER_H
#define SPL_TEST_LAZ_WRITER_H

#include "cloud/laz/format.h"
#include "support/laz_coder.h"

/* The format of point format `points` with `extra` bytes, all items of `version` (1 to 4; wave packets of 1 and 2 have
 * only 1). */
struct spl_laz_format laz_format(unsigned points, unsigned extra, unsigned version, uint32_t chunk_points);

/* A chunk of `count` records, at least one. `seed` chooses among the ways in which a GPS time can be written. The bytes
 * are the caller's. */
struct laz_out laz_write_chunk(const struct spl_laz_format *format, const uint8_t *records, size_t count,
                               uint32_t seed);

/* Records that use all there is: returns, channels, jumps, steady times and wild ones. The caller's. */
uint8_t *laz_make_records(const struct spl_laz_format *format, size_t count, uint32_t seed);

/* A whole file of LAS 1.4 whose chunks have `chunks` points, ending with a 0; the table has their sizes (format's
 * chunk_points 0) or not. `table`: where its offset lies. The bytes are the caller's. */
enum laz_table { LAZ_TABLE_USUAL, LAZ_TABLE_AT_END, LAZ_TABLE_MISSING };
struct laz_out laz_write_file(const struct spl_laz_format *format, unsigned points, const uint8_t *records,
                              const uint32_t *chunks, enum laz_table table);

#endif
