/* Space cut into parts of about as many points each. */
#ifndef SPL_PACK_JOB_CUT_H
#define SPL_PACK_JOB_CUT_H

#include <stdint.h>

#include "pack/job/job.h"

/* So many points, spread evenly over a box; which may be flat. */
struct spl_job_cell {
    double min[3], max[3], points;
};

/* Fills `parts` (`part_count` of them, >= 1) with boxes that together are all of space and do not overlap, each found
 * by halving along the longest side of what most of the points lie in; says of each how many points are expected in it
 * and, within `halo`, around it. Depends on the cells alone, in their order. SPL_E_NOMEM. */
int spl_job_cut(const struct spl_job_cell *cells, size_t count, double halo, struct spl_job_box *parts,
                uint32_t part_count, struct spl_error *err);

/* How far apart points are on the surfaces that cells are pieces of, where these have enough points to tell. */
struct spl_job_spacing {
    double usual; /* of half of the points */
    double wide;  /* of all but a twentieth */
    double mean;  /* over the surfaces, not over the points */
};
void spl_job_find_spacing(const struct spl_job_cell *cells, size_t count, struct spl_job_spacing *out);

#endif
