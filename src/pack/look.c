/* A scan read without keeping its points. What is found is what a pack would find: the same readers with the same
 * options, the same check of coordinates. The caller's thread. */
#include "pack/look.h"

#include <stdio.h>
#include <string.h>

/* Of leaves, levels and headers together. */
static const double dataset_bytes_a_point = 10;
static const double memory_bytes_a_point = 60, memory_bytes_least = 30e6;

int spl_scan_look(const struct spl_scans *scans, struct spl_scan *scan, bool read, struct spl_point_batch *batch,
                  struct spl_stage *stage, char strays[SPL_STRAYS_TEXT_MAX], struct spl_cloud **out,
                  struct spl_error *err)
{
    struct spl_strays sampled = {0};
    struct spl_cloud_options options = scans->how;
    options.colors = &scan->colors;
    struct spl_cloud *cloud = NULL;
    int rc = spl_cloud_open(scan->path, &options, &cloud, err);
    if (rc)
        return rc;
    const struct spl_cloud_info *info = spl_cloud_get_info(cloud);
    char name[128];
    if (read) {
        uint64_t points = 0;
        snprintf(name, sizeof name, "reading %.100s", scan->name);
        spl_stage_begin(stage, name, "points", info->points_expected);
        while (!rc && (rc = spl_cloud_read(cloud, batch, err)) > 0) {
            spl_stage_add(stage, batch->count, 0);
            rc = spl_scan_grow(scan, batch, points, err);
            spl_strays_add(&sampled, batch);
            points += batch->count;
        }
        spl_stage_end(stage);
        stage->name = "";
        memcpy(scan->points_from, info->points_from, sizeof scan->points_from);
        scan->points_behind = info->points_behind;
    } else {
        scan->points_from[scan->colors.from] = scan->points_expected;
        for (int c = 0; c < 3 && info->has_bounds; c++) {
            scan->min[c] = info->bounds[0][c];
            scan->max[c] = info->bounds[1][c];
        }
    }
    if (!spl_strays_tell(&sampled, scan->min, scan->max, strays))
        strays[0] = '\0';
    if (rc) {
        spl_cloud_destroy(cloud);
        return rc;
    }
    *out = cloud;
    return SPL_OK;
}

struct spl_pack_estimate spl_pack_estimate(uint64_t points)
{
    return (struct spl_pack_estimate){.memory_bytes =
                                          (uint64_t)(memory_bytes_least + memory_bytes_a_point * (double)points),
                                      .dataset_bytes = (uint64_t)(dataset_bytes_a_point * (double)points)};
}
