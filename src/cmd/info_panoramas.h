/* What splatd info says of the panoramas that scans bring along. */
#ifndef SPL_CMD_INFO_PANORAMAS_H
#define SPL_CMD_INFO_PANORAMAS_H

#include <jansson.h>

#include "pack/scans.h"

/* [{"path", "panoramas", "photographs", "places", "map_bytes"}] of what a pack of `count` scans from `list` on can make
 * maps of (a place has no picture): an E57 file's own images, the folder `panoramas` beside a scan. Headers of images
 * are read; what is wrong with one is appended to `warnings`. Adds what maps of them take in a dataset, about, to
 * *map_bytes. Blocks. */
json_t *spl_info_list_panoramas(const struct spl_scan *list, size_t count, json_t *warnings, uint64_t *map_bytes);

/* A line each. */
void spl_info_print_panoramas(const json_t *panoramas);

#endif
