/* The geometry of picks, shared by the library and the service. The world position is the point on the pixel's ray at
 * the depth that was rendered, so it agrees with the depth layer to the bit; class and primitive are those of the
 * nearest splat, panel or mesh, the normal is its plane's; a mesh lies on no plane that a pick could name. Of a bent
 * camera it is the pixel of a face that the image is looked up in, with those around it, along which a range is
 * carried: a ray of its own would pass by what a coarse image shows. Pure functions; any thread. */
#include "render/pick.h"

#include <math.h>
#include <string.h>

#include "base/error.h"
#include "dataset/dataset.h"
#include "dataset/panels.h"
#include "geom/faces.h"
#include "geom/size.h"
#include "render/around.h"
#include "render/view.h"

enum { BLOCK = 3 /* pixels on a side of what is drawn of a face */ };
static const double nowhere = 1e30; // view depth: nothing lies so far away

/* The camera that sees pixel (x, y) of `camera`'s image at at[0], at[1] of its own: itself, or of a bent one the face
 * that is looked up there, of width 0 where no ray goes. SPL_E_LIMIT where the faces are too large to be drawn. */
static int find_camera(const struct spl_camera *camera, double x, double y, struct spl_camera *out, double at[2],
                       struct spl_error *err)
{
    struct spl_faces faces;
    double ray[3], along;
    *out = *camera;
    at[0] = x;
    at[1] = y;
    if (!spl_camera_is_bent(camera))
        return SPL_OK;
    int rc = spl_faces_init(&faces, camera, SPL_VIEW_SIDE_MAX, err);
    if (rc)
        return rc;
    out->width = 0;
    if (spl_camera_get_ray(camera, x, y, ray))
        *out = faces.cameras[spl_faces_place(&faces, ray, at, &along)];
    return SPL_OK;
}

int spl_pick_view(const struct spl_view *view, double x, double y, struct spl_view *out, struct spl_error *err)
{
    if (view->camera.projection == SPL_RAYS)
        return spl_fail_field(err, SPL_E_USAGE, "projection",
                              "a ray of a list is no pixel to pick; ask for the layers of it");
    struct spl_camera camera;
    double at[2];
    int rc = find_camera(&view->camera, x, y, &camera, at, err);
    if (rc)
        return rc;
    *out = *view;
    out->layers = ((1u << SPL_LAYER_COUNT) - 1) & ~(1u << SPL_LAYER_PRIMITIVE);
    out->shade.kinds = SPL_SHADE_NONE;
    out->color = (struct spl_color_params){0};
    out->disc.atoms = 0; // its colour is the splat's
    out->supersample = spl_view_is_resampled(view) ? 1 : view->supersample; // the same at another size
    if (!camera.width) {
        spl_camera_set_fov(&out->camera, 1, 1, 1, NULL);
        out->camera.near = nowhere;
        out->camera.far = INFINITY;
        return SPL_OK;
    }
    const bool bent = spl_camera_is_bent(&view->camera);
    out->surrounded = true; // specks are closed as in the whole
    out->camera = camera;
    out->camera.cx += bent ? 1 - floor(at[0]) : 0.5 - at[0];
    out->camera.cy += bent ? 1 - floor(at[1]) : 0.5 - at[1];
    out->camera.width = out->camera.height = bent ? BLOCK : 1;
    return SPL_OK;
}

/* The point at view depth `z` on the ray through (u, v). */
static void place(const struct spl_camera *camera, double u, double v, double z, double p[3])
{
    const double *r = camera->rotation;
    double scale = spl_camera_ray_scale(camera, z);
    double x = (u - camera->cx) / camera->fx * scale, y = (v - camera->cy) / camera->fy * scale;
    for (int i = 0; i < 3; i++)
        p[i] = camera->eye[i] + r[i] * x + r[3 + i] * y + r[6 + i] * z;
}

static int32_t classification(const struct spl_dataset *dataset, uint32_t id)
{
    double value;
    bool known = dataset && spl_dataset_find_value(dataset, spl_dataset_find_stream(dataset, "class"), id, &value);
    return known ? (int32_t)fmin(value, INT32_MAX) : -1;
}

/* As what `id` is stored is what it is drawn as, since each kind of chunk has its own kernels. */
static void find_primitive(const struct spl_dataset *dataset, uint32_t id, struct spl_pick *pick)
{
    static const enum spl_shape shapes[SPL_CHUNK_KINDS] = {
        [SPL_CHUNK_DISCS] = SPL_SHAPE_SPLAT, [SPL_CHUNK_LINES] = SPL_SHAPE_LINE, [SPL_CHUNK_PANELS] = SPL_SHAPE_PANEL,
        [SPL_CHUNK_MESHES] = SPL_SHAPE_MESH};
    struct spl_pick_plane *plane = &pick->plane;
    struct spl_panel_frame frame;
    struct spl_chunk chunk;
    double origin[3];
    if (!dataset || !spl_dataset_find_chunk(dataset, id, &chunk, origin))
        return;
    pick->primitive = shapes[spl_chunk_kind(&chunk)]; // one of these: opening has judged it
    if (pick->primitive != SPL_SHAPE_PANEL)
        return;
    spl_panels_get_frame(&chunk, &frame);
    for (int i = 0; i < 3; i++) {
        plane->point[i] = origin[i] + (double)frame.origin[i];
        plane->normal[i] = (double)frame.normal[i];
    }
    plane->error_mean = (double)spl_panels_get_error_mean(&chunk);
    plane->error_most = (double)spl_panels_get_error_most(&chunk);
    plane->points = spl_panels_get_points(&chunk);
    /* which the layer has of fewer bits and blended with what lies beside it; the side is the layer's */
    double cosine = 0;
    for (int i = 0; i < 3; i++)
        cosine += plane->normal[i] * pick->normal[i];
    for (int i = 0; i < 3 && cosine != 0; i++)
        pick->normal[i] = cosine < 0 ? -plane->normal[i] : plane->normal[i];
}

void spl_pick_read(const struct spl_camera *camera, double x, double y, const struct spl_frame *frame,
                   const struct spl_dataset *dataset, struct spl_pick *pick)
{
    const struct spl_image *images = frame->images;
    const size_t middle = images[SPL_LAYER_DEPTH].width == BLOCK ? BLOCK + 1 : 0;
    float depth = ((const float *)images[SPL_LAYER_DEPTH].pixels)[middle];
    uint32_t id = ((const uint32_t *)images[SPL_LAYER_ID].pixels)[middle];
    const float *normal = images[SPL_LAYER_NORMAL].pixels;
    *pick = (struct spl_pick){.hit = isfinite(depth)};
    if (!pick->hit)
        return;
    struct spl_camera own;
    double at[2];
    find_camera(camera, x, y, &own, at, NULL); // which has drawn the frame
    pick->depth = (double)depth;
    pick->distance = (double)((const float *)images[SPL_LAYER_RANGE].pixels)[middle];
    if (middle)
        pick->depth = spl_around_depth_at(&images[SPL_LAYER_DEPTH], at[0] - floor(at[0]) + 1, at[1] - floor(at[1]) + 1);
    place(&own, at[0], at[1], pick->depth, pick->position);
    if (middle) {
        const double u = (at[0] - own.cx) / own.fx, v = (at[1] - own.cy) / own.fy;
        pick->depth = pick->distance = pick->depth * sqrt(1 + u * u + v * v);
    }
    for (int i = 0; i < 3 && normal; i++)
        pick->normal[i] = (double)normal[3 * middle + (size_t)i];
    memcpy(pick->color, (const uint8_t *)images[SPL_LAYER_COLOR].pixels + 4 * middle, sizeof pick->color);
    bool named = id != UINT32_MAX;
    pick->splat = named ? (int64_t)id : -1;
    pick->classification = named ? classification(dataset, id) : -1;
    if (named)
        find_primitive(dataset, id, pick);
}
