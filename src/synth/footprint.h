/* The colour that a scanner's camera sees of a point: not that of the point itself but the mean over the patch of
 * surface that the point stands for, as far as the next pulses. A scan of colours that are finer than its points would
 * alias. */
#ifndef SPL_SYNTH_FOOTPRINT_H
#define SPL_SYNTH_FOOTPRINT_H

#include "synth/scanner.h"

/* The mean in linear light, rounded to sRGB levels. `hit` is where the pulse of (pass, column, row) ends. Any thread.
 */
void spl_footprint_color(const struct spl_scene *scene, const struct spl_scan_grid *grid, size_t pass, uint64_t column,
                         uint64_t row, const struct spl_hit *hit, uint8_t color[3]);

#endif
