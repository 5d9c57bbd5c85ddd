/* What COLMAP's text and binary models have in common: cameras by their id, and images that use them. Inside src/cloud
 * only. */
#ifndef SPL_CLOUD_COLMAP_MODEL_H
#define SPL_CLOUD_COLMAP_MODEL_H

#include "cloud/view_list.h"

enum { SPL_COLMAP_CAMERAS_MAX = 65536 };

struct spl_colmap_camera {
    uint64_t id;
    bool refused; /* its images are, too */
    struct spl_value width, height, model, params;
};

/* Zero before use; `cameras` is freed by its reader. */
struct spl_colmap {
    struct spl_colmap_camera *cameras;
    size_t count, capacity;
    struct spl_view_list *list;
    const char *folder; /* may be NULL */
    const struct spl_photograph_options *photographs;
};

/* An image as both write it; world to camera. */
struct spl_colmap_image {
    struct spl_value q, t;
    uint64_t camera;
    const char *name;
};

/* Appends; errors are without their place. Fields WIDTH, HEIGHT, CAMERA_ID. */
int spl_colmap_add_camera(struct spl_colmap *model, const struct spl_colmap_camera *camera, struct spl_error *err);

/* Appends the image's view; errors are without their place, which starts with `path`. */
int spl_colmap_add_image(struct spl_colmap *model, const char *path, const struct spl_colmap_image *image,
                         struct spl_error *err);

#endif
