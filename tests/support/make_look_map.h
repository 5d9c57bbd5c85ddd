/* Maps without panoramas: of one station, from a function of direction, on any dataset. */
#ifndef TEST_SUPPORT_MAKE_LOOK_MAP_H
#define TEST_SUPPORT_MAKE_LOOK_MAP_H

#include <stdint.h>

#include <splatd/dataset.h>

#include "dataset/map.h"

/* What the station sees in a direction of its own frame, of any length above 0: a colour, and a range, INFINITY where
 * nothing comes back, NAN where it did not look. */
typedef void make_look(const double direction[3], uint8_t color[3], double *range);

/* An upright station with all levels that its side has. */
struct spl_map_row make_look_row(const double position[3], uint32_t side, uint32_t range_side);

/* The words of its map, spl_map_words() of them, each block of two colours at most; the caller frees them. */
uint32_t *make_look_words(const struct spl_map_row *row, make_look *look);

/* Writes `from` with that map to `path`: every chunk is the station's own and trimmed by it. */
void make_look_file(const struct spl_dataset *from, const struct spl_map_row *row, make_look *look, const char *path);

#endif
