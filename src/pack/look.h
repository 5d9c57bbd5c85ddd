/* Scans as they are, for who wants to know before packing them. */
#ifndef SPL_PACK_LOOK_H
#define SPL_PACK_LOOK_H

#include "pack/scans.h"
#include "pack/strays.h"

/* Opens a scan of the list, and reads it to its end where `read` says so; then points and box are what they are, and
 * `strays` says what a pack would warn of points far off, or ""; else as far as the header says them. On success the
 * caller owns *out, whose info tells the rest. `batch` is anyone's. Blocks. */
int spl_scan_look(const struct spl_scans *scans, struct spl_scan *scan, bool read, struct spl_point_batch *batch,
                  struct spl_stage *stage, char strays[SPL_STRAYS_TEXT_MAX], struct spl_cloud **out,
                  struct spl_error *err);

/* What spl_pack() takes and makes of so many points with the default options, roughly: scans of all kinds became 7.5 to
 * 12 bytes a point. */
struct spl_pack_estimate {
    uint64_t memory_bytes, dataset_bytes;
};
struct spl_pack_estimate spl_pack_estimate(uint64_t points);

#endif
