/* What the files of info of scans share: info_scan.c looks at scans, info_scan_describe.c says as JSON what they are,
 * info_scan_table.c prints that. The command's thread. */
#ifndef SPL_CMD_INFO_SCAN_PARTS_H
#define SPL_CMD_INFO_SCAN_PARTS_H

#include "cmd/info_scan.h"
#include "pack/scans.h"

/* {"min": [x, y, z], "max": …} */
json_t *spl_info_bounds(const double min[3], const double max[3]);

/* Points of all kinds of colours. */
uint64_t spl_info_count_points(const struct spl_scan *scan);

/* What a pack of `count` scans from `list` on would be. */
json_t *spl_info_describe_pack(const struct spl_scans *scans, struct spl_scan *list, size_t count);

/* One of `scans`, which was looked at. Members that are not known are null. */
json_t *spl_info_describe_scan(const struct spl_scans *scans, struct spl_scan *scan, const struct spl_cloud_info *info,
                               const struct spl_info_scan_options *options);

/* Print to stdout what these say; `read`: all points were. */
void spl_info_print_pack(const json_t *pack);
void spl_info_print_scan(const json_t *json, const struct spl_scan *scan, const struct spl_cloud_info *info,
                         bool read);

#endif
