/* The views that pack and collect are told: the one that is seen first, and others by name. */
#ifndef SPL_CMD_VIEWS_H
#define SPL_CMD_VIEWS_H

#include <stddef.h>

#include <splatd/pack.h>

#include "base/error.h"

struct spl_cmd_views {
    struct spl_saved_view first, named[SPL_SAVED_VIEWS_MAX];
    size_t count; /* of those with names */
};

/* --default-view "eye=X,Y,Z,target=X,Y,Z", and up, fov and view_height, which are zeros where they are left out; the
 * last one stands. `text` is cut in place. SPL_E_USAGE. */
int spl_cmd_views_take_first(struct spl_cmd_views *views, const char *option, char *text, struct spl_error *err);

/* --view "NAME=eye=…", one more. */
int spl_cmd_views_take(struct spl_cmd_views *views, const char *option, char *text, struct spl_error *err);

#endif
