/* Options of packing, checked once. */
#ifndef SPL_PACK_CHECK_H
#define SPL_PACK_CHECK_H

#include <splatd/pack.h>

#include "base/error.h"
#include "dataset/chunk.h"

/* What primitives do not go with. SPL_E_USAGE, and the errors of spl_export_check(). */
int spl_pack_check_primitives(const struct spl_pack_options *options, struct spl_error *err);

/* Fills what stands for zeros. SPL_E_USAGE names the option. Asks for the files' names alone. */
int spl_pack_check(const struct spl_pack_options *options, unsigned *neighbours, struct spl_chunk_options *chunk,
                   struct spl_error *err);

#endif
