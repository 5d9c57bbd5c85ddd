/* Which way is up. Scans have z there; worlds that were reconstructed from photographs have it anywhere. */
#ifndef SPL_PACK_UP_H
#define SPL_PACK_UP_H

#include <stdbool.h>

#include "cloud/views.h"

/* From photographs alone: the direction that all images are level to, or else the one that most have upwards. Unit
 * vector; false, `up` untouched: they say nothing, or z to 5 degrees, which is believed more than what hands hold. */
bool spl_up_from_cameras(const struct spl_view_list *views, double up[3]);

/* Rows: two level directions, the first of them x where that is level, and up; right-handed. `up` is a unit vector. */
void spl_up_get_frame(const double up[3], double frame[3][3]);

#endif
