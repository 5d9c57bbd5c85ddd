/* The views of a dataset by name: those that it was packed with, and those that clients have saved, which lie beside
 * its file as NAME.views.json and stand before the others. A container that is served is never written to.
 *
 * The list may be asked by any thread; it is changed by the loop's, after the pool has written the file. */
#ifndef SPL_SERVICE_SAVED_H
#define SPL_SERVICE_SAVED_H

#include <jansson.h>
#include <stdbool.h>

#include <splatd/dataset.h>

#include "base/error.h"
#include "geom/camera_json.h"

struct spl_saved;

/* Reads the file beside the dataset at `place`, where there is one. One that is broken counts as none, and is not
 * written over. SPL_E_NOMEM. Blocks on disk. `info` is borrowed until destroy. */
int spl_saved_create(const char *place, const struct spl_dataset_info *info, struct spl_saved **out,
                     struct spl_error *err);
void spl_saved_destroy(struct spl_saved *saved); /* NULL-safe */

/* What a camera's defaults know views by; lives as long. */
const struct spl_camera_names *spl_saved_get_names(const struct spl_saved *saved);

/* All of them, sorted, each with where it is from: "dataset" or "service". NULL without memory. */
json_t *spl_saved_describe(struct spl_saved *saved);
bool spl_saved_has(struct spl_saved *saved, const char *name, bool *of_service);

/* The file as it will be with `view` in it, or without `name` where that is NULL: the caller's. SPL_E_LIMIT (field
 * "name") for too many, SPL_E_CORRUPT where the file is broken. */
int spl_saved_prepare(struct spl_saved *saved, const char *name, const struct spl_saved_view *view, char **text,
                      struct spl_error *err);
/* The same in the list, once it is written. */
void spl_saved_apply(struct spl_saved *saved, const char *name, const struct spl_saved_view *view);
const char *spl_saved_get_path(const struct spl_saved *saved);

/* The new version's list takes what has been saved since the file was read for it. */
void spl_saved_inherit(struct spl_saved *saved, struct spl_saved *before);

#define SPL_SAVED_ENDING ".views.json"
/* NAME.views.json of NAME.spld; NULL without memory. */
char *spl_saved_path(const char *dataset_path, struct spl_error *err);

#endif
