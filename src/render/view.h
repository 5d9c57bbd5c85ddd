/* A caller's view as the renderer knows it. */
#ifndef SPL_RENDER_VIEW_H
#define SPL_RENDER_VIEW_H

#include <splatd/render.h>

#include "base/error.h"

enum {
    SPL_VIEW_SIDE_MAX = 32768,
    SPL_VIEW_LENSES_KEPT = 16, /* bent cameras of which a thread keeps how many samples they take */
};

/* Reads `given` by its size, with defaults where it ends, and checks it: errors as of spl_view_check(). Pure; any
 * thread. */
int spl_view_read(const struct spl_view *given, struct spl_view *view, struct spl_error *err);

/* Samples per pixel side that a view may have. Those of a whole number are drawn as such; others are an image of so
 * many times the size, drawn with one sample a pixel, then resampled. */
#define SPL_SUPERSAMPLES "0.25, 0.5, 1, 1.25, 1.5, 2 and 4"
bool spl_supersample_is_known(double side);
bool spl_view_is_resampled(const struct spl_view *view);
/* To what is drawn of it: another size, where it is resampled. */
void spl_view_resize(struct spl_view *view);
/* How many pixels of that lie beyond each border: what is enlarged looks at those, and a piece of something larger has
 * them. */
uint32_t spl_view_get_rim(const struct spl_view *view);

/* Do bent views take samples of the same lens, so that it is traced once? Poses may differ. */
bool spl_view_shares_lens(const struct spl_view *a, const struct spl_view *b);

/* Can a dataset show what the view's colours and its soft terms ask for? SPL_E_INPUT with the field; part of
 * spl_view_check_layers(). */
int spl_view_check_colors(const struct spl_view *view, const struct spl_dataset_info *info, struct spl_error *err);

#endif
