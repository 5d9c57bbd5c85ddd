/* Words of job.json that its writer and its reader share. */
#ifndef SPL_PACK_JOB_NAMES_H
#define SPL_PACK_JOB_NAMES_H

#include "pack/job/job.h"

#define SPL_JOB_FORMAT "splatd-job"
extern const char *const spl_job_color_names[3]; /* by struct spl_cloud_colors.from */

#endif
