/* Shares add up to no more than the whole, but that each scan gives one point at least. The caller's thread. */
#include "pack/part.h"

__extension__ typedef unsigned __int128 wide;

uint64_t spl_part_of(const struct spl_scans *scans)
{
    uint64_t total = 0;
    for (size_t i = 0; scans->how.max_points && i < scans->count; i++)
        total += scans->list[i].points_total;
    return total > scans->how.max_points ? total : 0;
}

void spl_part_share(struct spl_scans *scans)
{
    uint64_t total = spl_part_of(scans);
    for (size_t i = 0; i < scans->count; i++) {
        struct spl_scan *scan = &scans->list[i];
        uint64_t share = total ? (uint64_t)((wide)scans->how.max_points * scan->points_total / total) : 0;
        scan->max_points = total && share == 0 ? 1 : share;
    }
}
