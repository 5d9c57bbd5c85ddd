/* A part of the points: how many of them each scan gives. */
#ifndef SPL_PACK_PART_H
#define SPL_PACK_PART_H

#include "pack/scans.h"

/* Gives each scan its share of scans->how.max_points, by how many points it has. */
void spl_part_share(struct spl_scans *scans);

/* How many points the scans have where a part of them is taken, else 0. */
uint64_t spl_part_of(const struct spl_scans *scans);

#endif
