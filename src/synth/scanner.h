/* A terrestrial laser scanner: a spherical grid of rays around each of a scene's stations, azimuth × elevation from
 * straight below the horizon's 60 degrees up to the zenith, gaussian noise along the ray. */
#ifndef SPL_SYNTH_SCANNER_H
#define SPL_SYNTH_SCANNER_H

#include "synth/scene.h"

struct spl_scan_grid {
    uint64_t columns, rows;      /* azimuths, elevations; the same at every station */
    uint64_t expected;           /* returns over all stations */
};

struct spl_return {
    bool hit;                    /* false: sky, and nothing else is set */
    double local[3], world[3];   /* in the station's frame; in the scene's */
    float intensity;             /* 0..1 */
    uint8_t color[3];
};

/* The grid whose number of returns comes within 2 % of `points` (1e3 .. 1e10), found by casting it, or a coarse one
 * where it is fine enough for that to tell. Uses `threads` threads (0 = all cores); the result does not depend on
 * them. */
struct spl_scan_grid spl_scanner_fit(const struct spl_scene *scene, uint64_t points, unsigned threads);

/* The cell's measurement. The noise depends on (seed, station, column, row) alone. Any thread. */
struct spl_return spl_scanner_cast(const struct spl_scene *scene, const struct spl_scan_grid *grid, size_t station,
                                   uint64_t column, uint64_t row, double sigma, uint64_t seed);

#endif
