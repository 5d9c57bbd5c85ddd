/* Between the readers of view lists and the list itself. Inside src/cloud only. */
#ifndef SPL_CLOUD_VIEW_LIST_H
#define SPL_CLOUD_VIEW_LIST_H

#include "cloud/source.h"
#include "cloud/views.h"
#include "geom/camera_json.h"

/* The largest image that a view may have. */
extern const struct spl_camera_limits spl_view_list_limits;

/* Appends a view; copies `name` and `photograph` (may be NULL). Refuses a name that no file can carry, a name that is
 * taken, and more than SPL_VIEW_LIST_MAX views; errors start with `path`. */
int spl_view_list_add(struct spl_view_list *list, const char *path, const char *name, const struct spl_camera *camera,
                      const char *photograph, struct spl_error *err);

/* `format` printed into memory that the caller frees; NULL and SPL_E_NOMEM on failure. */
char *spl_view_list_print(struct spl_error *err, const char *format, ...) __attribute__((format(printf, 2, 3)));

int spl_view_list_load_json(struct spl_view_list *list, const char *path, struct spl_error *err);
int spl_view_list_load_colmap(struct spl_view_list *list, const char *folder, struct spl_error *err);

/* cameras.txt and images.txt from open sources, which stay the caller's. `folder` NULL: no photographs are looked for.
 */
int spl_view_list_read_colmap(struct spl_view_list *list, struct spl_source *cameras, struct spl_source *images,
                              const char *folder, struct spl_error *err);

#endif
