/* What tells an input from another one, or from what it was, without reading all of it. */
#ifndef SPL_PACK_JOB_STAMP_H
#define SPL_PACK_JOB_STAMP_H

#include <stdint.h>

#include "base/error.h"

/* Size, and hash of the first and last 64 KiB (of a smaller file: of all). Blocks on disk. */
int spl_stamp_take(const char *path, uint64_t *bytes, uint64_t *ends, struct spl_error *err);

#endif
