/* One part of a job while it is packed, as spl_build() sees it. */
#ifndef SPL_PACK_JOB_PART_H
#define SPL_PACK_JOB_PART_H

#include "pack/job/job.h"
#include "pack/points.h"
#include "pack/scans.h"
#include "pack/system.h"

struct spl_part {
    const struct spl_job *job;
    uint32_t number;
    struct spl_part_rules rules; /* the job's, with the part's box */
};

/* The scans that it reads, each held against the plan, and the coordinate system that was decided. `inputs` are its
 * job's. On failure nothing is held but by `system`. */
int spl_part_open(const struct spl_part *part, struct spl_scans *scans, struct spl_system *system,
                  struct spl_inputs *inputs, const struct spl_cloud_options *how, struct spl_stage *stage,
                  struct spl_error *err);

/* Points that are expected, with those of the halo. */
uint64_t spl_part_get_expected(const struct spl_part *part);

/* A look at its bounds, from above: the view that is worth looking for is the collection's. Pure. */
struct spl_default_view;
void spl_part_view(const struct spl_points *points, struct spl_default_view *view);

/* META's "job"; NULL: no memory. */
json_t *spl_part_describe(const struct spl_part *part, uint64_t halo_points);

/* Whether META (or a mark) is of this part of the job: SPL_OK, or SPL_E_INPUT with what it is instead; *older: it is a
 * part of another plan. `path` is for messages. */
int spl_part_recognise(const struct spl_job *job, uint32_t number, const json_t *said, const char *path, bool *older,
                       struct spl_error *err);

/* The mark that a part has no point, parsed; NULL: there is none, or what lies there is none. */
json_t *spl_part_read_mark(const char *path);

#endif
