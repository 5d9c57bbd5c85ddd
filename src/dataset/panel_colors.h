/* The colours of a panel's cells, which are coded apart from its masks: blocks (block.h) over 4 x 4, 8 x 8 or 16 x 16
 * cells, or one colour; shaders/shared.h has their layout. A part of chunk_panels.c. Pure functions; any thread. */
#ifndef SPL_DATASET_PANEL_COLORS_H
#define SPL_DATASET_PANEL_COLORS_H

#include "dataset/panels.h"

struct spl_panel_texels;

/* The words of a chunk, or of a panel's colours: what is asked for beyond the last is as the last. */
struct spl_panel_words {
    const uint32_t *words;
    uint32_t last;
};

static inline uint32_t spl_panel_word(const struct spl_panel_words *r, uint32_t at)
{
    return r->words[at < r->last ? at : r->last];
}

/* The mean colour of the cells that are there among the `wide` x `wide` from (x0, y0) on; false: none is. */
bool spl_panel_mean_color(const struct spl_panel *panel, unsigned x0, unsigned y0, unsigned wide, float color[3]);

/* Writes the colours of a panel whose blocks `there` have cells, at the coarsest level that keeps to `color_error` as
 * of spl_panels_encode(), and says which; returns the words. */
uint32_t spl_panel_colors_encode(const struct spl_panel *panel, uint32_t there, double color_error, uint32_t *words,
                                 unsigned *level);

/* Fills in those of the panel's cells, which are known, and the texels that they come from; its colours begin at word
 * `at`. */
void spl_panel_colors_decode(const struct spl_panel_words *words, uint32_t at, unsigned level, uint32_t there,
                             struct spl_panel *panel, struct spl_panel_texels *texels);

#endif
