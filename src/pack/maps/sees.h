/* What a finished map says of a point: dropped, or seen. The kernels' rule (shaders/common), in doubles. */
#ifndef SPL_PACK_MAPS_SEES_H
#define SPL_PACK_MAPS_SEES_H

#include "dataset/map.h"
#include "pack/maps/stations.h"

/* A map's ranges and whose they are. */
struct spl_map_sight {
    const struct spl_map_row *row;
    const uint32_t *codes; /* spl_map_range_words() */
};

/* By how much ranges may differ from a point's, which lies on a disc of `radius` that is seen at `cosine`. */
double spl_map_tolerance(const struct spl_map_row *row, double range, double radius, double cosine);

/* `own` (the station's frame) is dropped: what came back around it came from beyond it, or nothing did. */
bool spl_map_drops(const struct spl_map_sight *map, const double own[3], double radius, double cosine);

/* What share of the four texels around it says that the point is what the station saw. */
double spl_map_shows(const struct spl_map_sight *map, const double own[3], double radius, double cosine);

/* The stations of each chunk, and what share of it some map shows. `row_of` each station's row + 1, 0 = it has no map;
 * `maps` by row. Parallel. */
int spl_map_find_chunks(const struct spl_splats *splats, const struct spl_stations *stations, const uint16_t *row_of,
                        const struct spl_map_sight *maps, struct spl_stage *stage, struct spl_chunk_stations *out,
                        float *seen, struct spl_error *err);

#endif
