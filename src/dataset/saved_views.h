/* Views that somebody has put down: as JSON, and what they may be. Pure; any thread. */
#ifndef SPL_DATASET_SAVED_VIEWS_H
#define SPL_DATASET_SAVED_VIEWS_H

#include <jansson.h>

#include <splatd/dataset.h>

#include "base/error.h"

#define SPL_VIEW_NAME_FORMS "1 to 63 letters, digits, '.', '_' and '-', the first of them not a '.'"
enum { SPL_TITLE_BYTES_MAX = 200, SPL_DESCRIPTION_BYTES_MAX = 4000 };
enum { SPL_SAVED_VIEW_FOV = 60 }; /* where none is said */

bool spl_view_name_is_valid(const char *name);

/* Finite, within the world, a direction to look in and a field of view; settings are JSON. SPL_E_INPUT names eye,
 * target, up, fov, view_height, settings or, where `named`, name. */
int spl_saved_view_check(const struct spl_saved_view *view, bool named, struct spl_error *err);

/* {"eye": [3], "target": [3], "up": [3], "fov": degrees, "projection": "orthographic", "view_height": units,
 * "settings": {}}; all but the first two may be left out: `up`, 60, perspective (orthographic where view_height is
 * there), as high as the pinhole's image is where it looks, none; of an orthographic one that looks along `up`, what
 * spl_camera_choose_up() says. What settings say is the service's to know. "name" is read where `named`, and must be
 * there. Other keys are refused by name where `strict`. SPL_E_INPUT names the key. */
int spl_saved_view_from_json(const json_t *json, const double up[3], bool named, bool strict,
                             struct spl_saved_view *view, struct spl_error *err);

/* An array of named views, with whatever other keys, into `views`, room for SPL_SAVED_VIEWS_MAX, sorted by name. Errors
 * say which. */
int spl_saved_views_from_json(const json_t *json, const double up[3], struct spl_saved_view *views, uint32_t *count,
                              struct spl_error *err);

/* NULL without memory. */
json_t *spl_saved_view_to_json(const struct spl_saved_view *view);
json_t *spl_saved_views_to_json(const struct spl_saved_view *views, uint32_t count);

void spl_saved_views_sort(struct spl_saved_view *views, uint32_t count);

/* The view of this name; NULL. */
const struct spl_saved_view *spl_saved_views_find(const struct spl_saved_view *views, uint32_t count, const char *name);

#endif
