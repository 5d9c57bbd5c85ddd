/* A map's colours on their way through people's hands: written as a picture, or taken from one that was edited. */
#ifndef SPL_PACK_MAPS_EDIT_H
#define SPL_PACK_MAPS_EDIT_H

#include "pack/maps/atlas.h"
#include "pack/maps/export.h"

/* Puts what was edited of map `index` into the level-0 `atlas` (`edits` without a list: nothing was), and adds the
 * colours that this leaves, with the ranges among `words`, to `out` (without a folder: nothing is exported). Texels
 * that nobody edited keep their exact values. Errors as of both. Blocks. */
int spl_map_edit(struct spl_map_edits *edits, struct spl_map_export *out, uint32_t index,
                 const struct spl_map_row *row, const uint32_t *words, struct spl_atlas *atlas, struct spl_error *err);

#endif
