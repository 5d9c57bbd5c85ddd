/* Where the scan was seen from: which of its two sides a surface shows, where no scanner and no normal says so. */
#ifndef SPL_PACK_EYES_H
#define SPL_PACK_EYES_H

#include "cloud/views.h"
#include "pack/points.h"

/* The eyes of photographs or panoramas; of many as many as are enough, at even steps. Kept by the points. */
int spl_eyes_take(struct spl_points *points, const struct spl_view_list *views, struct spl_error *err);

/* How far the normal of point `i` shows outwards, -1 to 1: towards the nearest eye, or upwards where there is none. */
double spl_eyes_get_outward(const struct spl_points *points, size_t i);

#endif
