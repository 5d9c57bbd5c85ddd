/* A view from outside: the direction that shows the most, at the distance from which all of it fits. */
#ifndef SPL_PACK_VIEW_OUTSIDE_H
#define SPL_PACK_VIEW_OUTSIDE_H

#include "pack/view.h"
#include "pack/view/sample.h"

int spl_view_from_outside(const struct spl_view_sample *sample, struct spl_default_view *view, struct spl_error *err);

/* The angles that the sample takes up around view->target from view->eye, in the frame, but for what `share` of it may
 * lie beyond; with a margin, within [least, most] degrees. SPL_E_NOMEM. */
int spl_view_fit(const struct spl_view_sample *sample, const double eye[3], const double target[3], const double up[3],
                 double share, double least, double most, double fit[2], struct spl_error *err);

#endif
