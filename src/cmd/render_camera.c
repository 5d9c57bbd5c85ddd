/* The camera of 'splatd render': the dataset's default view or one by its name, and what options say instead. */
#include "cmd/render.h"

#include <math.h>
#include <string.h>

#include "dataset/dataset.h"
#include "dataset/saved_views.h"
#include "geom/fit.h"
#include "geom/ray_list.h"
#include "geom/size.h"
#include "service/place/places.h"
#include "service/request/request.h"
#include "service/request/values.h"

/* Eye and target into the dataset's coordinates. */
static int place(struct spl_cmd_render *a, const struct spl_dataset *dataset, struct spl_error *err)
{
    struct spl_places *places = NULL;
    struct spl_places_hook hook;
    int rc = a->crs ? spl_places_create(dataset, &places, err) : SPL_OK;
    if (rc || !a->crs)
        return rc;
    spl_places_hook_init(&hook, places, true);
    rc = hook.hook.to_world(&hook.hook, a->crs, "crs", NULL, NULL, err);
    if (!rc && !isnan(a->eye[0]))
        rc = hook.hook.to_world(&hook.hook, a->crs, "--eye", a->eye, a->eye, err);
    if (!rc && !isnan(a->target[0]))
        rc = hook.hook.to_world(&hook.hook, a->crs, "--target", a->target, a->target, err);
    if (!rc)
        rc = spl_terms_to_world(&a->drawing.view.soft.what, "soft", a->crs, &hook.hook, err);
    if (!rc)
        rc = spl_terms_to_world(&a->drawing.view.clip, "clip", a->crs, &hook.hook, err);
    spl_places_destroy(places);
    return rc;
}

static void give(struct spl_value *values, enum spl_camera_param param, const double *numbers, unsigned count)
{
    if (isnan(numbers[0]))
        return;
    values[param].given = true;
    values[param].count = count;
    memcpy(values[param].n, numbers, count * sizeof *numbers);
}

static void give_all(const struct spl_cmd_render *a, double view_height, struct spl_value values[SPL_CAMERA_PARAMS])
{
    const double station = a->station == UINT64_MAX ? (double)NAN : (double)a->station;
    const double projection = a->rays ? SPL_RAYS : a->projection < 0 ? (double)NAN : a->projection;
    const double size[2] = {a->rays ? 1 : a->drawing.size[0], a->rays ? a->rays->count : a->drawing.size[1]};
    give(values, SPL_CAMERA_station, &station, 1);
    give(values, SPL_CAMERA_eye, a->eye, 3);
    give(values, SPL_CAMERA_target, a->target, 3);
    give(values, SPL_CAMERA_up, a->up, 3);
    give(values, SPL_CAMERA_projection, &projection, 1);
    give(values, SPL_CAMERA_view_height, &a->view_height, 1);
    give(values, SPL_CAMERA_units_per_pixel, &a->units_per_pixel, 1);
    give(values, SPL_CAMERA_fov, &a->fov, 1);
    give(values, SPL_CAMERA_fx, &a->fx, 1);
    give(values, SPL_CAMERA_fy, &a->fy, 1);
    give(values, SPL_CAMERA_cx, &a->cx, 1);
    give(values, SPL_CAMERA_cy, &a->cy, 1);
    give(values, SPL_CAMERA_azimuth, a->azimuth, 3);
    give(values, SPL_CAMERA_elevation, a->elevation, 3);
    if (isnan(a->azimuth[0]) && isnan(a->elevation[0])) {
        give(values, SPL_CAMERA_width, &size[0], 1);
        give(values, SPL_CAMERA_height, &size[1], 1);
    }
    give(values, SPL_CAMERA_near, &a->near, 1);
    give(values, SPL_CAMERA_far, &a->far, 1);
    spl_camera_inherit_projection(values, view_height);
}

/* Where a projection is said, all means what it means over HTTP. */
static int resolve_projection(const struct spl_cmd_render *a, const struct spl_value values[SPL_CAMERA_PARAMS],
                              const struct spl_dataset_info *info, const struct spl_saved_view *from,
                              const double fit[2], struct spl_camera *camera, struct spl_error *err)
{
    const struct spl_camera_limits limits = {.side_px = a->rays ? SPL_RAYS_MAX : 65535, .pixels = UINT64_MAX};
    struct spl_camera_defaults defaults = {
        .fov = from->fov, .fit = {fit[0], fit[1]}, .near = camera->near, .far = camera->far, .dataset = info};
    memcpy(defaults.eye, from->eye, sizeof defaults.eye);
    memcpy(defaults.target, from->target, sizeof defaults.target);
    memcpy(defaults.up, from->up, sizeof defaults.up);
    return spl_camera_from_values(values, &defaults, &limits, camera, err);
}

/* The default view, or --view: its eye, target and up, and its field of view in *camera. */
static int start_camera(const struct spl_cmd_render *a, const struct spl_dataset *dataset, struct spl_saved_view *from,
                        struct spl_camera *camera, struct spl_error *err)
{
    const struct spl_dataset_info *info = spl_dataset_get_info(dataset);
    const uint32_t *size = a->drawing.size;
    int rc = spl_dataset_get_default_camera(dataset, size[0], size[1], camera, err);
    memcpy(from->eye, info->default_eye, sizeof from->eye);
    memcpy(from->target, info->default_target, sizeof from->target);
    memcpy(from->up, info->default_up, sizeof from->up);
    from->fov = info->default_fov;
    if (rc || !a->view)
        return rc;
    const struct spl_saved_view *view = spl_saved_views_find(info->views, info->view_count, a->view);
    if (!view)
        return spl_fail_field(err, SPL_E_USAGE, "view", "--view: '%s' has no view '%.64s'; 'splatd info' lists them",
                              info->id, a->view);
    *from = *view;
    if ((rc = spl_camera_set_fov(camera, spl_fit_fov((double[]){view->fov, view->fov}, size[0], size[1]), size[0],
                                 size[1], err)))
        return rc;
    return spl_camera_look_at(camera, view->eye, view->target, view->up, err);
}

/* What is left out of --size, and what does not go together. */
static int resolve_size(struct spl_cmd_render *a, struct spl_error *err)
{
    double size[2] = {a->drawing.size[0], a->drawing.size[1]}, shape[2];
    const bool scans = !isnan(a->azimuth[0]) || !isnan(a->elevation[0]);
    if (scans && a->projection != SPL_EQUIRECTANGULAR)
        return spl_fail(err, SPL_E_USAGE, "--azimuth and --elevation go with --projection equirectangular");
    if (scans && (size[0] > 0 || size[1] > 0))
        return spl_fail(err, SPL_E_USAGE, "--size and --azimuth exclude each other");
    spl_size_of_projection(a->projection < 0 ? SPL_PERSPECTIVE : (enum spl_projection)a->projection, shape);
    spl_size_follow(size, shape);
    if (a->fov > 179 && a->projection != SPL_FISHEYE)
        return spl_fail(err, SPL_E_USAGE, "--fov takes 1e-06 to 179, not %g; of --projection fisheye up to 360",
                        a->fov);
    for (int i = 0; i < 2; i++) {
        if (size[i] > UINT32_MAX)
            return spl_fail(err, SPL_E_USAGE, "--size makes an image of %.0f x %.0f pixels", size[0], size[1]);
        a->drawing.size[i] = (uint32_t)size[i];
    }
    return SPL_OK;
}

int spl_cmd_render_set_camera(struct spl_cmd_render *a, const struct spl_dataset *dataset, struct spl_error *err)
{
    struct spl_camera *camera = &a->drawing.view.camera;
    struct spl_saved_view from = {0};
    int rc = resolve_size(a, err);
    rc = rc ? rc : start_camera(a, dataset, &from, camera, err);
    if (rc || (rc = place(a, dataset, err)))
        return rc;
    struct spl_value values[SPL_CAMERA_PARAMS] = {0};
    give_all(a, from.view_height, values);
    if (values[SPL_CAMERA_projection].given || values[SPL_CAMERA_view_height].given ||
        values[SPL_CAMERA_units_per_pixel].given || values[SPL_CAMERA_station].given) {
        const struct spl_dataset_info *info = spl_dataset_get_info(dataset);
        const double *fit = info->default_fit;
        rc = resolve_projection(a, values, info, &from, a->view ? (double[]){from.fov, from.fov} : fit, camera, err);
        if (!rc && a->rays)
            rc = spl_view_set_rays(&a->drawing.view, a->rays, (enum spl_ray_frame)a->frame, a->resolution, err);
        return rc ? rc : spl_view_check(&a->drawing.view, err);
    }
    if (!isnan(a->fov) && !isnan(a->fx))
        return spl_fail(err, SPL_E_USAGE, "--fov and --fx exclude each other");
    if (!isnan(a->fy) && isnan(a->fx))
        return spl_fail(err, SPL_E_USAGE, "--fy is given without --fx");
    if (!isnan(a->fov) && (rc = spl_camera_set_fov(camera, a->fov, a->drawing.size[0], a->drawing.size[1], err)))
        return rc;
    if (!isnan(a->fx))
        camera->fx = camera->fy = a->fx;
    camera->fy = isnan(a->fy) ? camera->fy : a->fy;
    camera->cx = isnan(a->cx) ? camera->cx : a->cx;
    camera->cy = isnan(a->cy) ? camera->cy : a->cy;
    if (!isnan(a->eye[0]) || !isnan(a->target[0]) || !isnan(a->up[0]))
        rc = spl_camera_look_at(camera, isnan(a->eye[0]) ? from.eye : a->eye,
                                isnan(a->target[0]) ? from.target : a->target,
                                isnan(a->up[0]) ? from.up : a->up, err);
    if (rc)
        return rc;
    camera->near = isnan(a->near) ? camera->near : a->near;
    if (!isnan(a->far))
        camera->far = a->far;
    else if (camera->far <= camera->near) /* only near was moved, behind the default far */
        camera->far = INFINITY;
    return spl_view_check(&a->drawing.view, err);
}
