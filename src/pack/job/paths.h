/* The folder of a job, and scans' paths as it names them. */
#ifndef SPL_PACK_JOB_PATHS_H
#define SPL_PACK_JOB_PATHS_H

#include <stdbool.h>

#include "base/error.h"

/* Makes the folder where there is none (*made), or finds that it may be planned in: it is empty, or holds a job. Else
 * SPL_E_USAGE, field "output". */
int spl_job_make_folder(const char *path, bool *made, struct spl_error *err);

/* `file` as seen from `folder`, both of which exist: "../tiles/a.las". The file's own name stays, though it may be a
 * link; folders above are where they really lie. free() *out. */
int spl_job_relate(const char *folder, const char *file, char **out, struct spl_error *err);

#endif
