/* How far a station sees in each direction: the ranges of its map. */
#ifndef SPL_PACK_MAPS_RANGES_H
#define SPL_PACK_MAPS_RANGES_H

#include "dataset/map.h"
#include "pack/maps/hits.h"

/* Ranges as the map has them: an atlas of `side` texels and an apron of SPL_MAP_RANGE_APRON. NaN not scanned, INFINITY
 * nothing came back. */
struct spl_ranges {
    uint32_t side;
    float *texels;      // owned
    double near; /* as of struct spl_map_row: one hit of some thousands is nearer */
};

/* Of `side_max` texels (>= 4) at most, fewer where the hits are too far apart for it: nine texels of ten within what
 * was scanned are hit. Parallel; blocks. Uses hits->texel. On failure nothing is held. */
int spl_ranges_init(struct spl_ranges *ranges, struct spl_hits *hits, uint32_t side_max, unsigned threads,
                    struct spl_error *err);
void spl_ranges_finish(struct spl_ranges *ranges);

/* 1 / range in that direction (unit, the station's frame), between texels; 0 where nothing came back. What was not
 * scanned is as far as the nearest that was. */
struct spl_inverse_ranges {
    uint32_t side;
    float *texels; /* as of struct spl_ranges; owned */
};
int spl_inverse_ranges_init(struct spl_inverse_ranges *inverse, const struct spl_ranges *ranges, struct spl_error *err);
void spl_inverse_ranges_finish(struct spl_inverse_ranges *inverse);
double spl_inverse_ranges_get(const struct spl_inverse_ranges *inverse, const double direction[3]);

#endif
