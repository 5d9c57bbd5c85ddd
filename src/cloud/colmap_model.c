/* COLMAP's cameras and images, however they were written.
 *
 * Numbers go through the same values as those of JSON, so that all of them mean the same. Any thread; no state. */
#include "cloud/colmap_model.h"

#include <stdlib.h>

#include "base/array.h"

static const struct spl_colmap_camera *find(const struct spl_colmap *model, uint64_t id)
{
    for (size_t i = 0; i < model->count; i++)
        if (model->cameras[i].id == id)
            return &model->cameras[i];
    return NULL;
}

int spl_colmap_add_camera(struct spl_colmap *model, const struct spl_colmap_camera *camera, struct spl_error *err)
{
    int rc;
    if ((rc = spl_value_check(&camera->width, SPL_KIND_COUNT, "WIDTH", err)) ||
        (rc = spl_value_check(&camera->height, SPL_KIND_COUNT, "HEIGHT", err)))
        return rc;
    if (find(model, camera->id))
        return spl_fail_field(err, SPL_E_INPUT, "CAMERA_ID", "camera %llu is there twice",
                              (unsigned long long)camera->id);
    if (model->count == SPL_COLMAP_CAMERAS_MAX)
        return spl_fail(err, SPL_E_LIMIT, "more than %d cameras", SPL_COLMAP_CAMERAS_MAX);
    if (spl_array_reserve(model->cameras, model->capacity, model->count + 1, err))
        return SPL_E_NOMEM;
    model->cameras[model->count++] = *camera;
    return SPL_OK;
}

int spl_colmap_add_image(struct spl_colmap *model, const char *path, const struct spl_colmap_image *image,
                         struct spl_error *err)
{
    struct spl_value values[SPL_CAMERA_PARAMS] = {0};
    struct spl_distortion distortion = {0};
    struct spl_camera camera = {0};
    const struct spl_colmap_camera *found = find(model, image->camera);
    int rc;
    if (!found)
        return spl_fail_field(err, SPL_E_INPUT, "CAMERA_ID", "the model has no camera %llu",
                              (unsigned long long)image->camera);
    if (found->refused)
        return spl_fail_field(err, SPL_E_UNSUPPORTED, "CAMERA_ID", "'%.200s' was taken with camera %llu", image->name,
                              (unsigned long long)image->camera);
    values[SPL_CAMERA_q] = image->q;
    values[SPL_CAMERA_t] = image->t;
    values[SPL_CAMERA_width] = found->width;
    values[SPL_CAMERA_height] = found->height;
    if ((rc = spl_colmap_apply((int)found->model.n[0], &found->params, &camera, model->photographs ? &distortion : NULL,
                               err)))
        return rc;
    const double lens[4] = {camera.fx, camera.fy, camera.cx, camera.cy};
    for (int i = 0; i < 4; i++)
        values[SPL_CAMERA_fx + i] = (struct spl_value){.given = true, .count = 1, .n = {lens[i]}};
    if ((rc = spl_value_check(&values[SPL_CAMERA_q], SPL_KIND_QUATERNION, "q", err)) ||
        (rc = spl_value_check(&values[SPL_CAMERA_t], SPL_KIND_VECTOR, "t", err)) ||
        (rc = spl_camera_from_values(values, NULL, &spl_view_list_limits, &camera, err)))
        return rc;
    return spl_view_list_add_image(model->list, path, image->name, &camera, &distortion, model->folder,
                                   model->photographs, err);
}
