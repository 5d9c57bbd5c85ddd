/* Where on earth a version of a dataset lies: its world coordinates from those of other coordinate systems, and back.
 *
 * A point is longitude, latitude and height, or east, north and height, in a system of EPSG's list. Heights are the
 * dataset's own, in metres or in the system's unit: no geoid and no datum moves them. Transformations are made when
 * they are first asked for, and the last used are kept. All calls: any thread. */
#ifndef SPL_SERVICE_PLACES_H
#define SPL_SERVICE_PLACES_H

#include "dataset/dataset.h"
#include "geom/camera_json.h"

struct spl_places;

/* What META of `dataset` says of its coordinate system is looked through, not yet used. Borrows nothing. */
int spl_places_create(const struct spl_dataset *dataset, struct spl_places **out, struct spl_error *err);
void spl_places_destroy(struct spl_places *places); /* NULL-safe */

/* For spl_camera_from_values(). `waits`: makes what is missing, tens of ms each and a few for each hook that it is, so
 * no thread may do it that others wait for; else SPL_E_BUSY, field "crs". A hook that waits is one parser's at a time.
 */
struct spl_places_hook {
    struct spl_camera_places hook; /* first */
    struct spl_places *places;
    bool waits;
    unsigned made;
};
void spl_places_hook_init(struct spl_places_hook *hook, struct spl_places *places, bool waits);

/* Makes what EPSG:`crs` needs, unless it is there. Blocks for tens of milliseconds. */
int spl_places_prepare(struct spl_places *places, uint32_t crs, struct spl_error *err);

/* The other way: a point of the world in EPSG:`crs`. `waits` as above. */
int spl_places_from_world(struct spl_places *places, uint32_t crs, bool waits, const double in[3], double out[3],
                          struct spl_error *err);

/* The box around a box. Longitudes of one that crosses the 180th meridian have low > high. SPL_E_BUSY where it is not
 * prepared. */
int spl_places_bounds(struct spl_places *places, uint32_t crs, double world[2][3], double out[2][3],
                      struct spl_error *err);

/* How far off horizontal coordinates may be, metres, by EPSG's list, where the dataset lies; negative = not known. */
double spl_places_get_accuracy(struct spl_places *places, uint32_t crs);

/* The system that the last refusal with SPL_E_BUSY was about. Owned by: loop. */
uint32_t spl_places_get_missing(const struct spl_places *places);

/* What META says, "" where it says nothing. */
const char *spl_places_get_crs(const struct spl_places *places);

#endif
