/* Scans in, a dataset out. */
#ifndef SPLATD_PACK_H
#define SPLATD_PACK_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#include <splatd/dataset.h>
#include <splatd/error.h>

struct spl_progress {          /* one call about every 100 ms while work runs, from the calling thread */
    const char *stage;         /* static: "reading scan.ply", "neighbours", … (valid during the call) */
    uint64_t done, total;      /* items of this stage; total 0 = unknown */
    double rate;               /* items per second */
};

struct spl_pack_options {
    const char *const *inputs;
    size_t input_count;
    const char *output;        /* NAME.spld */
    const char *columns;       /* text inputs, may be NULL */
    unsigned neighbours;       /* K of eq. 20 and of the PCA; 0 = 12 */
    double position_error;     /* mean, as a share of the splat radius; 0 = 0.016 */
    double normal_error;       /* mean, degrees; 0 = 1 */
    unsigned threads;          /* 0 = all cores */
    void (*progress)(void *context, const struct spl_progress *progress); /* may be NULL */
    void *progress_context;
};

struct spl_pack_report {
    uint64_t points_read, points_skipped, duplicates, leaf_splats, splats;
    uint32_t levels, nodes, chunks, pages;
    uint64_t attribute_bits[SPL_ATTRIBUTE_COUNT];
    double position_error;     /* measured mean, share of the radius */
    double normal_error;       /* measured mean, degrees */
    double seconds;
};

/* Reads, cleans, estimates normals and radii, builds the levels and writes `options->output` (temporary file, sync,
 * rename: a crash leaves the old file or none). Blocks; uses options->threads threads and at most about 80 bytes a point.
 * `report` may be NULL. Any thread. */
int spl_pack(const struct spl_pack_options *options, struct spl_pack_report *report, struct spl_error *err);

#endif
