/* Simulated laser scanners: which pulses they send, what comes back, and how fine they must scan for so many points.
 *
 * A scan is a grid of pulses for each of the scene's stations (`pass`): columns of rows. What a column is depends on
 * the scanner: an azimuth, a revolution of the head, a line across the swath, a part of the sweep. All randomness is a
 * function of (seed, pass, column, row), so a scan does not depend on the number of threads. Any thread. */
#ifndef SPL_SYNTH_SCANNER_H
#define SPL_SYNTH_SCANNER_H

#include "synth/scene.h"

struct spl_scan_grid {
    uint64_t columns, rows;      /* the same for every pass */
    uint64_t expected;           /* returns over all passes */
};

/* What is wrong with a scan; zeroed is a perfect one. */
struct spl_scan_faults {
    uint64_t seed;
    double noise;                /* sigma of the range, metres */
    double mixed;                /* share of the pulses on an edge whose range lies between both surfaces */
    double dropout; /* share S of returns that are lost where a surface of mid-grey is hit square on within the
                       scanner's range; in general 1 - (1 - S)^w, w = w_colour w_angle w_range, each at least
                       1: 0.5 / albedo, 1 / cos(incidence), (distance / range)^2 */
    double misregister;          /* metres by which each pass's pose is off, in a direction of its own */
};

/* One beam; scene coordinates but `local`. */
struct spl_pulse {
    double origin[3], direction[3], local[3]; /* directions are unit; local is in the frame of the station or head */
};

struct spl_return {
    bool hit;                    /* false: sky, and nothing else is set */
    double local[3], scene[3];   /* in the station's frame; in the scene's, moved by what the pose is off by */
    float intensity;             /* 0..1 */
    uint8_t color[3];
    uint8_t class;               /* as spl_scene_class(), of the surface that the central ray meets, or the nearest */
    uint8_t number, of;          /* 1 .. returns of its pulse */
    uint16_t pass;
    uint64_t pulse;              /* its index in the pass */
};

void spl_scanner_pulse(const struct spl_scene *scene, const struct spl_scan_grid *grid, size_t pass, uint64_t column,
                       uint64_t row, struct spl_pulse *pulse);

/* Of a sweep, whose neighbours in the grid are not neighbours on the surface: steps of a square patch as large as a
 * pulse's share of the area, along and across the sweep. */
void spl_scanner_spacing(const struct spl_scene *scene, const struct spl_scan_grid *grid, size_t pass, uint64_t column,
                         uint64_t row, double steps[2][3]);

/* The measurement of one pulse: the number of returns, nearest first; 0 for sky. Without faults and for scanners of one
 * return the beam is its central ray. Else it is seven rays over the footprint: surfaces more than half a metre apart
 * are separate returns of a scanner that has several; where rays of one return hit two surfaces more than two
 * footprints apart, a share `mixed` of them lies anywhere between, with a colour between. All lie on the central ray.
 * Colours are means over the surface between a pulse and the next ones (footprint.h). `returns` may be NULL: they are
 * counted. */
unsigned spl_scanner_cast(const struct spl_scene *scene, const struct spl_scan_grid *grid,
                          const struct spl_scan_faults *faults, size_t pass, uint64_t column, uint64_t row,
                          struct spl_return returns[SPL_SCANNER_RETURNS_MAX]);

/* By what the pose of that pass is off: scene coordinates, of length faults->misregister. */
void spl_scanner_displacement(const struct spl_scan_faults *faults, size_t pass, double out[3]);

/* The grid whose number of returns comes within 2 % of `points` (1e3 .. 1e10), found by casting it, or a coarse one
 * where it is fine enough for that to tell. Uses `threads` threads (0 = all cores); the result does not depend on
 * them. */
struct spl_scan_grid spl_scanner_fit(const struct spl_scene *scene, const struct spl_scan_faults *faults,
                                     uint64_t points, unsigned threads);

#endif
