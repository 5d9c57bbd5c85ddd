/* Maps of stations without scans: what each direction gives is a function's, on any dataset. Anything that goes wrong
 * ends the test program. */
#ifndef TEST_SUPPORT_MAPPED_DATASET_H
#define TEST_SUPPORT_MAPPED_DATASET_H

#include <stdbool.h>
#include <stdint.h>

#include <splatd/dataset.h>

#include "dataset/map.h"

struct make_map {
    struct spl_map_row row;
    /* Of unit direction `d` of the station's frame: its colour, 0..255, and its range: INFINITY = nothing came back,
     * NaN = not scanned. */
    void (*look)(const struct make_map *map, const double d[3], double color[3], double *range);
    const void *context;
};

/* A row at `position`, turned about some axis by `turn` radians. */
struct spl_map_row mapped_row(const double position[3], double turn, uint32_t side, uint32_t levels,
                                uint32_t range_side);

/* From world to the station's frame. */
void mapped_local(const struct spl_map_row *row, const double world[3], double local[3]);

/* `from` with maps, as an open, verified dataset whose file is gone already. Each chunk has the stations that `seen`
 * (by chunk, of which there are as many as `from` has) says. */
struct spl_dataset *make_mapped(const struct spl_dataset *from, const struct make_map *maps, uint32_t count,
                                const struct spl_chunk_stations *seen);

/* The same where every chunk is seen by the same stations, the first four: its own is one of them in turn, which trims
 * it where `trims`. */
struct spl_dataset *make_mapped_alike(const struct spl_dataset *from, const struct make_map *maps, uint32_t count,
                                      bool trims);

/* That as a file. */
void write_mapped_alike(const struct spl_dataset *from, const struct make_map *maps, uint32_t count, bool trims,
                        const char *path);

#endif
