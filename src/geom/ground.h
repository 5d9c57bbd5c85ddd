/* Where the pixels of a plan lie on the ground: of orthographic views straight down. Pure functions; any thread. */
#ifndef SPL_GEOM_GROUND_H
#define SPL_GEOM_GROUND_H

#include <stdbool.h>

#include <splatd/camera.h>
#include <splatd/image.h>

#include "base/error.h"

/* Are rows along x and columns down -y, as maps have them? */
bool spl_ground_is_north_up(const struct spl_ground *ground);

/* The six lines of a world file: steps of a column, and of a row, and the middle of the first pixel. Returns `text`. */
enum { SPL_WORLD_FILE_BYTES = 192 };
const char *spl_ground_print_world_file(const struct spl_ground *ground, char text[SPL_WORLD_FILE_BYTES]);

/* What a world file beside a picture ends in: ".jgw", ".pgw"; NULL of formats that have none. */
const char *spl_format_world_file(enum spl_format format);

/* The number in EPSG's list of a coordinate system's text, horizontal part: "EPSG:2994", "EPSG:2994+5703", or a WKT
 * whose projected, else geographic system says its own. 0 where it says none. */
uint32_t spl_epsg_from_text(const char *text);

#endif
