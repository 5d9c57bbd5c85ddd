/* COPC: a LAZ file each of whose chunks is a node of an octree, coarse levels first. The chunks are read as any others;
 * the hierarchy is there to take some of them. */
#ifndef SPL_CLOUD_COPC_H
#define SPL_CLOUD_COPC_H

#include "cloud/las_records.h"
#include "cloud/laz/stream.h"

enum { SPL_COPC_LEVELS = 32, SPL_COPC_INFO_BYTES = 160 };

struct spl_copc_levels {
    uint8_t *level; // owned; of each chunk of the table
    uint64_t points[SPL_COPC_LEVELS];
};

/* Reads the hierarchy whose record "copc" has the content `info`, at byte `info_at`. Each chunk of `table` must be a
 * node, with its points and bytes, and no node anything else. What is not so is SPL_E_INPUT with `fault` filled (its
 * offset counts from the file's first byte) and `err` left alone. On failure nothing is held. Blocks. */
int spl_copc_read_levels(struct spl_copc_levels *levels, const struct spl_source *source,
                         const uint8_t info[SPL_COPC_INFO_BYTES], uint64_t info_at, const struct spl_laz_table *table,
                         struct spl_laz_fault *fault, struct spl_error *err);

void spl_copc_levels_finish(struct spl_copc_levels *levels);

/* Makes of a COPC file's stream the coarsest levels that have at most `most` points in all, the first one at least, and
 * sets *points to how many those are. A file that is no COPC, and one with a hierarchy that is wrong (which is said the
 * first time that it is opened), is left as it is. `most` 0: no part is wanted, the hierarchy is only looked at. */
int spl_copc_take_levels(struct spl_cloud *cloud, struct spl_las_record records, struct spl_laz_stream *stream,
                         uint64_t most, uint64_t *points, struct spl_error *err);

#endif
