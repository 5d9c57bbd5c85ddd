/* All scans read once, for a plan: where their points are, and what values their attributes have. */
#ifndef SPL_PACK_JOB_SURVEY_H
#define SPL_PACK_JOB_SURVEY_H

#include "pack/job/count.h"
#include "pack/scans.h"

/* Counts the scans' points in `grid`, and by scan in points_from; finds their boxes (min, max), their stations, and
 * what white is where that was a guess. Decides how attributes are kept, as a pack of all of it does, but that what is
 * seen of a part of the values alone (ranges without outer hundredths) is that of an even sample. What breaks is taken
 * out of the list where the inputs' listener wants that. Scans whose rows can be gone to get boxes of blocks of them
 * (blocks.boxes), which the caller frees, after a failure too. Blocks. */
int spl_survey(struct spl_scans *scans, struct spl_job_grid *grid, struct spl_part_rules *rules,
               struct spl_stage *stage, struct spl_error *err);

#endif
