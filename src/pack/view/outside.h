/* A view from outside: the direction that shows the most, at the distance from which all of it fits. */
#ifndef SPL_PACK_VIEW_OUTSIDE_H
#define SPL_PACK_VIEW_OUTSIDE_H

#include "pack/view.h"
#include "pack/view/sample.h"

int spl_view_from_outside(const struct spl_view_sample *sample, unsigned threads, struct spl_default_view *view,
                          struct spl_error *err);

#endif
