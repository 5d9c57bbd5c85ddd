/* The photographs that are packed: their poses, and what becomes of those that cannot be used. */
#ifndef SPL_PACK_TEXTURE_PHOTOGRAPHS_H
#define SPL_PACK_TEXTURE_PHOTOGRAPHS_H

#include <splatd/pack.h>

#include "base/error.h"
#include "cloud/views.h"

/* Poses and lenses, each held against its photograph's header: what can be refused is refused before anything is
 * packed. Faults of single photographs go to options->refused where it is set. Fills `list` on success. */
int spl_photos_load(const struct spl_photo_options *options, struct spl_view_list *list,
                    struct spl_photo_report *report, struct spl_error *err);

/* The fault `rc`, `why` of one photograph: handed out and counted, SPL_OK; or *err where options->refused is not set or
 * the fault is the machine's. */
int spl_photos_refuse(const struct spl_photo_options *options, struct spl_photo_report *report, int rc,
                      const struct spl_error *why, struct spl_error *err);

#endif
