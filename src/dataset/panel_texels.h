/* The colours of a panel: texels of 1 << level cells a side, and what is shown between their middles. Of level 0 texels
 * are cells, and only those that are there have a say; of others all have, and beyond the middles of the outer ones
 * their slope goes on, so that even surfaces have no steps from panel to panel. shaders/common/panel.glsl has the same.
 * Pure functions; any thread. */
#ifndef SPL_DATASET_PANEL_TEXELS_H
#define SPL_DATASET_PANEL_TEXELS_H

#include "dataset/panels.h"

struct spl_panel_texels {
    unsigned level;                                 /* below SPL_PANEL_EVEN */
    float color[SPL_PANEL_SIDE][SPL_PANEL_SIDE][3]; /* [y][x], 0..255; the first SPL_PANEL_SIDE >> level */
};

/* The colour, 0..255, at `place`, in cells of the panel; one of the cells around it is there. */
void spl_panel_texels_get(const struct spl_panel *panel, const struct spl_panel_texels *texels, const float place[2],
                          float color[3]);

/* Sets texels->color to what is nearest to the colours of the panel's cells at texels->level: their means, moved by
 * what these leave. A texel without cells goes on from those around. */
void spl_panel_texels_fit(const struct spl_panel *panel, struct spl_panel_texels *texels);

/* spl_panels_decode(), with the texels that the colours come from. */
void spl_panels_decode_texels(const struct spl_chunk *chunk, const uint32_t *page, uint32_t i, struct spl_panel *panel,
                              struct spl_panel_texels *texels);

#endif
