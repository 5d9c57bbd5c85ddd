/* Points counted by place, in bounded memory, whatever their bounds and number. */
#ifndef SPL_PACK_JOB_COUNT_H
#define SPL_PACK_JOB_COUNT_H

#include "pack/job/cut.h"

struct spl_job_grid; /* opaque: cells of a power of two, which double where there are too many */

/* NULL: SPL_E_NOMEM. `cells_most` that are kept at once, >= 8. */
struct spl_job_grid *spl_job_grid_create(size_t cells_most, struct spl_error *err);
void spl_job_grid_destroy(struct spl_job_grid *grid); /* NULL-safe */

/* Coordinates within SPL_COORDINATE_MAX. */
void spl_job_grid_add(struct spl_job_grid *grid, const double (*points)[3], size_t count);

/* Doubles the cells. */
void spl_job_grid_coarsen(struct spl_job_grid *grid);

/* Its cells, which the caller frees; *count of them. NULL: SPL_E_NOMEM. */
struct spl_job_cell *spl_job_grid_get_cells(const struct spl_job_grid *grid, size_t *count, struct spl_error *err);

/* Of its points half lie in cells with at least so many. */
double spl_job_grid_get_usual(const struct spl_job_grid *grid);

#endif
