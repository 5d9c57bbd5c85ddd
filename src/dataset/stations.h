/* Stations of a dataset as JSON: what the service and splatd info say of one. Any thread. */
#ifndef SPL_DATASET_STATIONS_H
#define SPL_DATASET_STATIONS_H

#include <jansson.h>

#include <splatd/dataset.h>

/* Its number (< info->station_count), its place in the world, where a view from it looks, level, and its pose as the
 * scan says it. NULL without memory. */
json_t *spl_station_to_json(const struct spl_dataset_info *info, uint32_t number);

#endif
