/* A coarse picture of the sample from one direction, and how well it shows it. */
#ifndef SPL_PACK_VIEW_PICTURE_H
#define SPL_PACK_VIEW_PICTURE_H

#include "pack/view/sample.h"

struct spl_view_pictures; /* room for one at a time, of one worker */

/* NULL on SPL_E_NOMEM; destroy takes NULL. */
struct spl_view_pictures *spl_view_pictures_create(const struct spl_view_sample *sample, struct spl_error *err);
void spl_view_pictures_destroy(struct spl_view_pictures *pictures);

/* Share of the frame that is filled, times the share of the surface that is seen along axes[2], upright along axes[1];
 * the frame is `aspect` times as wide as high. `area` is that of all of the sample. */
double spl_view_judge(struct spl_view_pictures *pictures, const struct spl_view_sample *sample, double axes[3][3],
                      double aspect, double area);

#endif
