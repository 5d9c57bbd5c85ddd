/* Horizontal coordinates of one coordinate system of EPSG's list to those of a dataset's, and back: the only way to
 * PROJ. A build without it has the same calls, which refuse. */
#ifndef SPL_SERVICE_TRANSFORM_H
#define SPL_SERVICE_TRANSFORM_H

#include <stdbool.h>
#include <stdint.h>

#include "base/error.h"

struct spl_transform;

extern const bool spl_transform_is_built;

/* From EPSG:`asked` to `world`: EPSG:`world_epsg`, or the WKT `world_wkt` where that is not 0. Axes are longitude and
 * latitude, in degrees, or east and north, whatever order the systems themselves have. Reads PROJ's database, which
 * takes tens of milliseconds; no network, no grid that is not on this machine. Any thread; a transform is one thread's
 * at a time. SPL_E_INPUT, field "crs"; SPL_E_UNSUPPORTED without PROJ or its database. */
int spl_transform_create(uint32_t asked, uint32_t world_epsg, const char *world_wkt, struct spl_transform **out,
                         struct spl_error *err);
void spl_transform_destroy(struct spl_transform *transform); /* NULL-safe */

/* False where the point has no image; what comes out is finite otherwise. */
bool spl_transform_apply(struct spl_transform *transform, bool to_world, const double in[2], double out[2]);

/* The box around the image of a box of world coordinates: min x, min y, max x, max y. Longitudes of one that crosses
 * the 180th meridian have min > max. */
bool spl_transform_bounds(struct spl_transform *transform, const double world[4], double out[4]);

/* Metres a unit of heights in the system that is asked for: 1 beside degrees. */
double spl_transform_get_height_m(const struct spl_transform *transform);

/* Metres a unit of the world's axes; 0 = they are degrees. */
double spl_transform_get_world_m(const struct spl_transform *transform);

/* How far off coordinates may be, metres, by EPSG's list, for the point that was transformed last; negative = not
 * known. */
double spl_transform_get_accuracy(struct spl_transform *transform);

#endif
