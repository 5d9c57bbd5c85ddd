/* Maps as pictures that people edit: a folder with NAME.color.png and NAME.range.png of each station, and maps.json.
 *
 * A picture is a map's atlas without aprons, 6 side x side: bottom cap, top cap, band, each turned so that it looks as
 * it did from the station: the band upright (in the atlas it stands on its head), the ground not mirrored. Colours are
 * sRGB; ranges are the codes of the map (shaders/shared.h) as 16 bit grey: 0 not scanned, 65535 nothing came back.
 * Ranges are for looking at: what is taken back is colours alone. */
#ifndef SPL_PACK_MAPS_EXPORT_H
#define SPL_PACK_MAPS_EXPORT_H

#include <jansson.h>

#include <splatd/image.h>

#include "base/error.h"
#include "dataset/map.h"

/* Where texel (x, y) of a picture lies in an atlas of `apron`. */
static inline void spl_map_picture_texel(uint32_t side, uint32_t apron, uint32_t x, uint32_t y, uint32_t at[2])
{
    uint32_t chart = x / side < 2 ? x / side : 2;
    at[0] = (chart == 2 ? 8 * side - 1 - x : x) + (2 * chart + 1) * apron;
    at[1] = (chart == 1 ? y : side - 1 - y) + apron;
}

/* A color image of 6 side x side, without pixels' values. The caller's; SPL_E_NOMEM. */
int spl_map_picture_init(struct spl_image *picture, uint32_t side, struct spl_error *err);

struct spl_map_export {
    const char *folder; // borrowed
    bool made, committed;
    uint32_t count; /* pictures of stations written */
    json_t *list;
};

/* Makes the folder. Refuses one that holds anything, for that may be what somebody edited, and one that cannot be made.
 * The caller finishes `out`, also after a failure. Errors name "export-maps", or the folder. */
int spl_map_export_init(struct spl_map_export *out, const char *folder, struct spl_error *err);

/* Writes the next station's colours and the ranges among its `words`. Blocks. */
int spl_map_export_add(struct spl_map_export *out, const struct spl_map_row *row, const struct spl_image *picture,
                       const uint32_t *words, struct spl_error *err);

/* Writes maps.json: only then is the folder complete. */
int spl_map_export_commit(struct spl_map_export *out, struct spl_error *err);

/* Removes what was written unless it was committed. */
void spl_map_export_finish(struct spl_map_export *out);

struct spl_map_edits {
    const char *folder; // borrowed
    json_t *list;
    size_t taken; /* maps that took the colours of theirs */
};

/* Reads maps.json and the headers of its colours, which must have the sizes that it says. Errors name "maps", or a
 * member, and the file. Blocks for reading. */
int spl_map_edits_init(struct spl_map_edits *edits, const char *folder, struct spl_error *err);

/* Puts the edited colours of map `index` over those of `picture`; a transparent texel leaves them as they are, and so
 * does a list without that map. Refuses a map that another station had. Blocks for reading. */
int spl_map_edits_apply(struct spl_map_edits *edits, uint32_t index, const struct spl_map_row *row,
                        struct spl_image *picture, struct spl_error *err);
void spl_map_edits_finish(struct spl_map_edits *edits);

#endif
