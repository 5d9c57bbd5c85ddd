/* A view from inside: from where a scanner or a camera stood, or where somebody could, along the longest way that is
 * free. */
#ifndef SPL_PACK_VIEW_INSIDE_H
#define SPL_PACK_VIEW_INSIDE_H

#include "pack/view.h"
#include "pack/view/sample.h"
#include "pack/view/stood.h"

/* Looks for such a place. *found: the scene lies around it, and *view is filled but for up; else it is to be seen from
 * outside. SPL_E_NOMEM. */
int spl_view_from_inside(const struct spl_view_sample *sample, const struct spl_view_stood *stood,
                         struct spl_default_view *view, bool *found, struct spl_error *err);

#endif
