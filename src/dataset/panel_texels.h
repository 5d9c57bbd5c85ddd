/* The colours of a panel: texels of 1 << level cells a side, and what is shown between their middles. Of level 0 texels
 * are cells, and only those that are there have a say; of others all have, and beyond the middles of the outer ones
 * their slope goes on, so that even surfaces have no steps from panel to panel. shaders/common/panel.glsl has the same.
 * Pure functions; any thread. */
#ifndef SPL_DATASET_PANEL_TEXELS_H
#define SPL_DATASET_PANEL_TEXELS_H

#include "dataset/panels.h"

/* Red, green, blue, 0..255; the fourth means nothing. */
typedef float spl_panel_texel __attribute__((vector_size(16)));

struct spl_panel_texels {
    unsigned level;                                        /* below SPL_PANEL_EVEN */
    spl_panel_texel color[SPL_PANEL_SIDE][SPL_PANEL_SIDE]; /* [y][x]; the first SPL_PANEL_SIDE >> level */
};

/* Where the middle of a cell lies between texels, along one axis. */
struct spl_panel_between {
    uint8_t first; /* texel; the next one is the other */
    float along;   /* from the first to the other, beyond them too */
};

/* That of each cell, 0..SPL_PANEL_SIDE - 1, between texels of `level`. */
void spl_panel_texels_place(unsigned level, struct spl_panel_between between[SPL_PANEL_SIDE]);

/* The colour, 0..255, at `place`, in cells of the panel; one of the cells around it is there. */
void spl_panel_texels_get(const struct spl_panel *panel, const struct spl_panel_texels *texels, const float place[2],
                          float color[3]);

/* That at the middle of a cell, placed by spl_panel_texels_place(), of texels whose level is not 0. */
static inline spl_panel_texel spl_panel_texels_at(const struct spl_panel_texels *texels,
                                                  const struct spl_panel_between *x, const struct spl_panel_between *y)
{
    typedef int32_t mask __attribute__((vector_size(16)));
    const spl_panel_texel *row = &texels->color[y->first][x->first], *next = row + SPL_PANEL_SIDE;
    const spl_panel_texel black = {0}, white = {255, 255, 255, 255};
    float weights[4] = {(1 - x->along) * (1 - y->along), x->along * (1 - y->along), (1 - x->along) * y->along,
                        x->along * y->along};
    spl_panel_texel color = (weights[0] * row[0] + weights[1] * row[1] + weights[2] * next[0] + weights[3] * next[1]) /
                            (weights[0] + weights[1] + weights[2] + weights[3]);
    color = (spl_panel_texel)((color > black) & (mask)color);
    mask within = color < white;
    return (spl_panel_texel)((within & (mask)color) | (~within & (mask)white));
}

/* Sets texels->color to what is nearest to the colours of the panel's cells at texels->level: their means, moved by
 * what these leave. A texel without cells goes on from those around. */
void spl_panel_texels_fit(const struct spl_panel *panel, struct spl_panel_texels *texels);

/* spl_panels_decode(), with the texels that the colours come from. */
void spl_panels_decode_texels(const struct spl_chunk *chunk, const uint32_t *page, uint32_t i, struct spl_panel *panel,
                              struct spl_panel_texels *texels);

#endif
