/* What comes after the scan is packed: photographs, maps, pruning. Each reads the dataset of the one before. */
#ifndef SPL_PACK_PASSES_H
#define SPL_PACK_PASSES_H

#include <splatd/pack.h>

#include "pack/maps/maps.h"
#include "pack/texture/photographs.h"

/* What there is to put onto the scan: photographs, pictures for maps. Loaded before anything is packed. */
struct spl_passes {
    const struct spl_pack_options *options;
    struct spl_stage *stage;
    struct spl_map_options with; /* of maps, where the scans bring pictures along */
    struct spl_view_list photographs, pictures;
    struct spl_photo_report photos;
    struct spl_map_report maps;
};

/* Options of maps and their pictures become those that the scans bring along, or none. Nobody asked for these, so what
 * is wrong with them fails nothing. `options` are those of *p, and may point into it then. */
int spl_passes_find_pictures(struct spl_passes *p, struct spl_pack_options *options, struct spl_error *err);

/* Loads what the options name. */
int spl_passes_load(struct spl_passes *p, struct spl_error *err);

/* Writes options->output from the dataset `part`, whose name is gone as soon as it is open; likewise `points`, which
 * has the points that panels of the other stand for as discs; NULL where there are no panels, or no maps. Blocks. */
int spl_passes_run(struct spl_passes *p, const char *part, const char *points, struct spl_error *err);
void spl_passes_finish(struct spl_passes *p);

#endif
