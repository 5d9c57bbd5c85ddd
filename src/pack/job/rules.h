/* What the parts of a job have decided alike before any of them is packed: which points are whose, how attributes are
 * kept. */
#ifndef SPL_PACK_JOB_RULES_H
#define SPL_PACK_JOB_RULES_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#include "pack/scalars.h"

struct spl_part_rules {
    double min[3], max[3]; /* of the part, half open: [min, max); where it is an outer one, infinite */
    double halo;           /* as far beyond it points are read that take part in neighbourhoods, and are dropped then */
    double cells;     /* a power of two: the finest that wires are looked for in, at its multiples; 0: as points ask */
    bool has_class;   /* any of the job's scans has one */
    bool has_scan;    /* points know the number of their scan, */
    bool stations;    /* which is that of their station */
    const double (*poses)[16]; /* of all stations of the job, by their numbers; borrowed. NULL: it has none */
    uint32_t pose_count;
    uint32_t scalars; /* bit 1 << place in struct spl_points, of those that are kept; how, the next says */
    struct spl_scalar_steps steps[SPL_POINT_SCALARS];
};

enum spl_part_place { SPL_PART_OUTSIDE, SPL_PART_INSIDE, SPL_PART_HALO };

/* Where a point is that its scan's box, from `low` to `high` as the job knows it, should hold. One that lies outside of
 * it is the part's that the nearest place of the box is in: so every point of a scan is of one part alone, and that one
 * reads the scan. Pure. */
enum spl_part_place spl_part_find(const struct spl_part_rules *rules, const double low[3], const double high[3],
                                  const double at[3]);

/* Of a scan whose rows can be gone to, the blocks that reach into a part or its halo, one run after the other. */
struct spl_part_blocks {
    const double (*boxes)[6]; /* least and most of x, y, z of each; borrowed. NULL: all is read */
    size_t count;
    uint64_t rows, total; /* of each but the last, of the scan */
};

/* The next run of rows from `row` on, *begin to *end; false: there is none. Pure. */
bool spl_part_next_rows(const struct spl_part_rules *rules, const struct spl_part_blocks *blocks, uint64_t row,
                        uint64_t *begin, uint64_t *end);

/* Leaves what is inside or in the halo, in its order; `numbers` (may be NULL) has a value a point too; `halo` is filled
 * with 1 for each point that is left and lies there. `scalars` are the batch's. Returns how many are inside. */
struct spl_point_batch;
size_t spl_part_filter(const struct spl_part_rules *rules, const double low[3], const double high[3],
                       struct spl_point_batch *batch, uint32_t scalars, double *numbers, uint8_t *halo);

/* Forgets the points in the halo, once what is around the others is known; bounds are those of the rest then, its cube
 * stays. There may be none left. */
struct spl_points;
void spl_part_drop_halo(struct spl_points *points);

#endif
