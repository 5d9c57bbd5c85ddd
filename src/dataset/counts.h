/* What a dataset has altogether, added up page by page: the writer puts it into META, so that opening need not read
 * every page's tables to know it; whoever does read them all holds it against them. Pure functions; any thread. */
#ifndef SPL_DATASET_COUNTS_H
#define SPL_DATASET_COUNTS_H

#include <jansson.h>

#include "dataset/tables.h"

struct spl_counts {
    uint64_t splats, leaf_splats, pieces; /* as in struct spl_dataset_info */
    uint64_t linear_chunks;               /* of discs, that have linear splats */
    uint64_t panels, panel_points, meshes, mesh_points; /* the same; 0 where META says nothing */
    uint32_t levels;
    uint64_t bits[SPL_ATTRIBUTE_COUNT]; /* without textures and dictionary, which follow from their sections */
    uint64_t stream_bits[SPL_STREAMS_MAX];
};

void spl_counts_add_tables(struct spl_counts *counts, const struct spl_tables *tables);
void spl_counts_add(struct spl_counts *counts, const struct spl_counts *other);

/* META's "counts": all but leaf_splats and levels, which have keys of their own. NULL when memory is refused. */
json_t *spl_counts_to_json(const struct spl_counts *counts, uint32_t streams);

/* Reads it: false where a number is missing, or cannot be. */
bool spl_counts_from_json(const json_t *json, uint32_t streams, struct spl_counts *counts);

/* The first key of META whose numbers differ; NULL: they are the same. */
const char *spl_counts_compare(const struct spl_counts *a, const struct spl_counts *b);

#endif
