/* A plan in the making, as its files share it. */
#ifndef SPL_PACK_JOB_PLAN_PARTS_H
#define SPL_PACK_JOB_PLAN_PARTS_H

#include "pack/job/cut.h"
#include "pack/job/job.h"
#include "pack/scans.h"
#include "pack/system.h"

struct spl_planning {
    const struct spl_plan_options *options;
    struct spl_stage stage;
    struct spl_keep keep;
    struct spl_inputs inputs;
    struct spl_scans scans;
    struct spl_system system;
    struct spl_job_cell *cells; // owned
    size_t cell_count;
    struct spl_job_spacing spacing;
    struct spl_job *job;
};

/* Finds where the scans' points are: cells, spacing, each scan's points and box, and the rules of attributes. Blocks;
 * errors of reading scans. */
int spl_plan_find_points(struct spl_planning *plan, struct spl_error *err);

#endif
