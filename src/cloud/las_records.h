/* Variable length records of a LAS file: finding them, and what they say of its coordinates. */
#ifndef SPL_CLOUD_LAS_RECORDS_H
#define SPL_CLOUD_LAS_RECORDS_H

#include "cloud/little.h"
#include "cloud/reader.h"

/* Records that are left to look at: `count` at most from `at` on, none past `end`. */
struct spl_las_record {
    uint64_t at, end;
    uint32_t count;
    bool extended;    /* those behind the points, whose lengths have 64 bits */
    uint64_t content; /* of the one that was found: where it begins */
    uint64_t bytes;   /* and how long it is, up to `end` */
};

/* The next record of `user`, and of number `id` unless that is 0; a chain that leaves its range just ends. Moves the
 * source's cursor. */
int spl_las_find(struct spl_cloud *cloud, struct spl_las_record *record, const char *user, uint16_t id, bool *found,
                 struct spl_error *err);

/* Fills info.coordinates but for their step, from WKT and GeoTIFF keys among the records before the points and the
 * extended ones: as far as they are there and whole, and of two that contradict each other from the first. Moves the
 * cursor. */
int spl_las_read_coordinates(struct spl_cloud *cloud, const struct spl_las_record records[2], bool wkt_first,
                             struct spl_error *err);

#endif
