/* Between the readers of camera paths. Inside src/cloud only. */
#ifndef SPL_CLOUD_PATH_READER_H
#define SPL_CLOUD_PATH_READER_H

#include "cloud/path.h"
#include "cloud/source.h"
#include "cloud/views.h"

/* A path that is being read. */
struct spl_path_reader {
    const struct spl_path_options *options;
    struct spl_camera_path *path;
    const char *list;       /* the key of the list that is read, for messages */
    uint32_t width, height; /* of the outcome; 0 until spl_path_set_size() */
};

/* The size of the outcome: the options', else the path's own, else 1280 x 720; checked against the limits. */
int spl_path_set_size(struct spl_path_reader *reader, double width, double height, struct spl_error *err);

/* The path's frames a second, of its key fps; 0 where it has none. */
int spl_path_set_fps(struct spl_path_reader *reader, const json_t *json, struct spl_error *err);

/* A camera whose lens is the vertical field of view `fov`, at the reader's size, with near and far; its pose is zero.
 */
int spl_path_set_fov(const struct spl_path_reader *reader, double fov, struct spl_camera *camera,
                     struct spl_error *err);

/* Scales the lens to the reader's size, checks the camera and appends it. */
int spl_path_take(struct spl_path_reader *reader, struct spl_camera *camera, double time, struct spl_error *err);

/* `why` again, as the fault of entry `index` of the list: field "LIST[INDEX].FIELD". Returns rc. */
int spl_path_fail(const struct spl_path_reader *reader, size_t index, int rc, const struct spl_error *why,
                  struct spl_error *err);

/* path_formats.c */
int spl_path_read_nerfstudio(struct spl_path_reader *reader, const json_t *json, struct spl_error *err);
int spl_path_read_open3d(struct spl_path_reader *reader, const json_t *json, struct spl_error *err);

/* path_text.c */
int spl_path_read_tum(struct spl_path_reader *reader, struct spl_source *source, struct spl_error *err);
int spl_path_read_colmap(struct spl_path_reader *reader, const json_t *json, struct spl_error *err);
int spl_path_read_views(struct spl_path_reader *reader, struct spl_view_list *views, struct spl_error *err);

#endif
