/* The records of a LAZ file in order, whatever its chunks are: many are decoded at a time on all cores, in bounded
 * memory; those without a sound table, and those too large for that, one slice after the other. Owned by the cloud's
 * thread. */
#ifndef SPL_CLOUD_LAZ_STREAM_H
#define SPL_CLOUD_LAZ_STREAM_H

#include <stdatomic.h>

#include "cloud/laz/decoder.h"
#include "cloud/laz/table.h"
#include "cloud/source.h"

struct spl_laz_stream;

/* `points` records lie from byte `points_at` on. A table of chunks that is missing, or wrong where it can be done
 * without, is no error: spl_laz_stream_get_warning() tells the latter. `threads`: 0 = all cores. On success the caller
 * owns *out; `source` and `cancelled`, which may be NULL, are borrowed. */
int spl_laz_stream_open(struct spl_laz_stream **out, struct spl_source *source, const struct spl_laz_format *format,
                        uint64_t points_at, uint64_t points, unsigned threads, const atomic_bool *cancelled,
                        struct spl_error *err);

/* What is wrong with the table, at an offset of the file, so that chunks are read one by one; NULL: nothing. */
const struct spl_laz_fault *spl_laz_stream_get_warning(const struct spl_laz_stream *stream);

/* NULL-safe. */
void spl_laz_stream_destroy(struct spl_laz_stream *stream);

/* The table of chunks, NULL where there is none that can be trusted. Valid until the next call. */
const struct spl_laz_table *spl_laz_stream_get_table(const struct spl_laz_stream *stream);

/* Before the first read: leaves only the chunks with wanted[i] != 0 of its table; points are numbered anew. */
void spl_laz_stream_choose(struct spl_laz_stream *stream, const uint8_t *wanted);

/* The next 1 to `most` records, record_bytes each, valid until the next call; *count 0 at the end. Of layers only the
 * `wanted` ones (enum spl_laz_want); those may change after a seek alone. SPL_E_CANCELLED some ten
 * thousand points after it was asked for. */
int spl_laz_stream_read(struct spl_laz_stream *stream, uint32_t wanted, const uint8_t **records, size_t most,
                        size_t *count, struct spl_error *err);

/* Goes to a point. Where only `few` are wanted from there, no whole chunks of a large file are
 * decoded. */
void spl_laz_stream_seek(struct spl_laz_stream *stream, uint64_t point, bool few);

#endif
