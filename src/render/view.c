/* A view's defaults, its names and its limits. Pure; any thread. */
#include "render/view.h"

#include <math.h>
#include <string.h>

#include "base/error.h"
#include "base/sized.h"
#include "geom/distortion.h"
#include "geom/faces.h"
#include "geom/ray_list.h"
#include "geom/size.h"
#include "render/marks.h"
#include "render/paint.h"
#include "shared.h"

#define PIXELS_MAX (1ull << 28)

void spl_view_init_sized(struct spl_view *view, size_t size)
{
    struct spl_view known = {
        .camera = {.near = SPL_CAMERA_NEAR_DEFAULT, .far = INFINITY},
        .method = SPL_METHOD_DEFAULT,
        .layers = 1u << SPL_LAYER_COLOR,
        .lod = 1,
        .supersample = 1,
        .background = {0, 0, 0, 255},
        .deadline_ns = UINT64_MAX,
    };
    for (int i = 0; i < SPL_PARAM_COUNT; i++)
        spl_view_set_param(&known, i, spl_method_param_get(i)->otherwise);
    spl_sized_init(view, size);
    size_t bytes = size < sizeof known ? size : sizeof known;
    if (bytes > sizeof size)
        memcpy((char *)view + sizeof size, (const char *)&known + sizeof size, bytes - sizeof size);
}

/* But for the pose. */
static bool is_same_lens(const struct spl_camera *a, const struct spl_camera *b)
{
    return a->projection == b->projection && a->width == b->width && a->height == b->height && a->fx == b->fx &&
           a->fy == b->fy && a->cx == b->cx && a->cy == b->cy && a->near == b->near && a->far == b->far &&
           spl_distortion_is_same(&a->lens, &b->lens);
}

bool spl_supersample_is_known(double side)
{
    return side == 0.25 || side == 0.5 || side == 1 || side == 1.25 || side == 1.5 || side == 2 || side == 4;
}

bool spl_view_is_resampled(const struct spl_view *view)
{
    return view->supersample != floor(view->supersample);
}

uint32_t spl_view_get_rim(const struct spl_view *view)
{
    return view->surrounded && view->supersample < 1 && !spl_camera_is_bent(&view->camera);
}

static void coarsen(const struct spl_view *view, struct spl_camera *camera)
{
    const uint32_t rim = spl_view_get_rim(view);
    spl_camera_coarsen(camera, view->supersample);
    camera->width += 2 * rim;
    camera->height += 2 * rim;
    camera->cx += rim;
    camera->cy += rim;
}

void spl_view_resize(struct spl_view *view)
{
    const double scale = view->supersample;
    if (!spl_view_is_resampled(view))
        return;
    coarsen(view, &view->camera);
    view->supersample = 1;
    view->shade.radius = (uint32_t)fmax(rint(view->shade.radius * scale), 1);
    view->fill.kernel = view->fill.kernel > 0 ? fmax(view->fill.kernel * scale, 3) : 0;
}

/* What samples are taken of. */
static struct spl_camera coarsened(const struct spl_view *view)
{
    struct spl_camera camera = view->camera;
    if (spl_view_is_resampled(view))
        coarsen(view, &camera);
    return camera;
}

bool spl_view_shares_lens(const struct spl_view *a, const struct spl_view *b)
{
    const struct spl_camera mine = coarsened(a), other = coarsened(b);
    return is_same_lens(&mine, &other);
}

/* Pixels of the faces that the view is looked up in; 0 where it is in none. Tracing a lens takes up to two
 * milliseconds, and is asked for several times of a request and of each view of a batch: the last ones are kept. */
static int count_face_pixels(const struct spl_view *view, uint64_t *pixels, struct spl_error *err)
{
    static _Thread_local struct {
        struct spl_camera camera;
        uint64_t pixels;
    } kept[SPL_VIEW_LENSES_KEPT];
    static _Thread_local unsigned next;
    struct spl_camera camera = coarsened(view);
    struct spl_faces faces;
    *pixels = 0;
    if (!spl_camera_is_bent(&camera))
        return SPL_OK;
    if (camera.projection == SPL_RAYS) { // whose list knows what it takes
        int rc = view->rays ? spl_faces_init_of(&faces, &camera, view->rays, SPL_VIEW_SIDE_MAX, err) : SPL_E_USAGE;
        *pixels = rc ? 0 : spl_faces_get_pixels(&faces);
        return rc;
    }
    memset(camera.eye, 0, sizeof camera.eye);
    memset(camera.rotation, 0, sizeof camera.rotation);
    for (unsigned i = 0; i < SPL_VIEW_LENSES_KEPT; i++)
        if (kept[i].camera.width && is_same_lens(&camera, &kept[i].camera)) {
            *pixels = kept[i].pixels;
            return SPL_OK;
        }
    int rc = spl_faces_init(&faces, &camera, SPL_VIEW_SIDE_MAX, err);
    if (rc)
        return rc;
    *pixels = kept[next].pixels = spl_faces_get_pixels(&faces);
    kept[next].camera = camera;
    next = (next + 1) % SPL_VIEW_LENSES_KEPT;
    return SPL_OK;
}

uint64_t spl_view_get_samples(const struct spl_view *view)
{
    double side = view->supersample > 1 ? view->supersample : 1;
    uint64_t pixels = (uint64_t)view->camera.width * view->camera.height;
    uint64_t faces;
    if (!spl_camera_is_bent(&view->camera) || count_face_pixels(view, &faces, NULL))
        return (uint64_t)((double)pixels * side * side);
    side = spl_view_is_resampled(view) ? 1 : side; // they are of that size
    return pixels + faces * (uint64_t)(side * side);
}

uint64_t spl_view_get_frame_bytes(const struct spl_view *view)
{
    uint64_t pixel = 4 * (uint64_t)__builtin_popcount(view->layers) + (view->layers & 1u << SPL_LAYER_NORMAL ? 8 : 0);
    uint64_t faces;
    count_face_pixels(view, &faces, NULL);
    const struct spl_camera drawn = coarsened(view);
    if (spl_view_is_resampled(view) && !spl_camera_is_bent(&drawn))
        faces += (uint64_t)drawn.width * drawn.height;
    const uint64_t list = view->rays ? view->rays->count * sizeof view->rays->directions[0] : 0;
    return list + pixel * ((uint64_t)view->camera.width * view->camera.height + faces);
}

/* What is not there of cameras that are no one pinhole. */
static int check_around(const struct spl_view *view, struct spl_error *err)
{
    const struct spl_camera *camera = &view->camera;
    uint64_t faces;
    if (view->layers >> SPL_LAYER_DEPTH & 1)
        return spl_fail_field(
            err, SPL_E_INPUT, "layer", "an image of %s has no one axis that depth could be along; ask for layer range",
            camera->lens.kind == SPL_DISTORTION_RADIAL ? "a lens that bends" : spl_projection_name(camera->projection));
    int rc = count_face_pixels(view, &faces, err);
    if (!rc && faces > PIXELS_MAX)
        rc = spl_fail_field(err, SPL_E_LIMIT, view->rays ? "resolution" : "width",
                            "%llu pixels of a cube around the eye are more than %llu", (unsigned long long)faces,
                            PIXELS_MAX);
    return rc;
}

/* A list and its camera belong together. */
static int check_rays(const struct spl_view *view, struct spl_error *err)
{
    const struct spl_camera *camera = &view->camera;
    if ((camera->projection == SPL_RAYS) != (view->rays != NULL))
        return spl_fail_field(err, SPL_E_USAGE, "rays", "projection %s and %s list of rays do not go together",
                              spl_projection_name(camera->projection), view->rays ? "a" : "no");
    if (!view->rays)
        return SPL_OK;
    if (camera->width != 1 || camera->height != view->rays->count)
        return spl_fail_field(err, SPL_E_USAGE, "rays", "%u rays are an image of 1 x %u pixels, not %u x %u",
                              view->rays->count, view->rays->count, camera->width, camera->height);
    if (spl_view_is_resampled(view))
        return spl_fail_field(err, SPL_E_INPUT, "supersample",
                              "supersample %g resamples images; rays take another resolution", view->supersample);
    return SPL_OK;
}

static int check(const struct spl_view *view, struct spl_error *err)
{
    int rc = spl_camera_check(&view->camera, err);
    if (rc || (rc = check_rays(view, err)))
        return rc;
    if (view->camera.width > SPL_VIEW_SIDE_MAX)
        return spl_fail_field(err, SPL_E_LIMIT, "width", "width %u is above %d", view->camera.width, SPL_VIEW_SIDE_MAX);
    if (view->camera.height > SPL_VIEW_SIDE_MAX && !view->rays)
        return spl_fail_field(err, SPL_E_LIMIT, "height", "height %u is above %d", view->camera.height,
                              SPL_VIEW_SIDE_MAX);
    if ((uint64_t)view->camera.width * view->camera.height > PIXELS_MAX)
        return spl_fail_field(err, SPL_E_LIMIT, "width", "%u x %u pixels are more than %llu", view->camera.width,
                              view->camera.height, PIXELS_MAX);
    if ((unsigned)view->method >= SPL_METHOD_COUNT)
        return spl_fail_field(err, SPL_E_USAGE, "method", "method %d does not exist", (int)view->method);
    if (!view->layers || view->layers >> SPL_LAYER_COUNT)
        return spl_fail_field(err, SPL_E_USAGE, "layer", "layer set %#x names no layer or an unknown one",
                              view->layers);
    if (!(view->lod >= 0 && view->lod <= 64))
        return spl_fail_field(err, SPL_E_USAGE, "lod", "lod %g is not within 0 and 64", view->lod);
    if (!spl_supersample_is_known(view->supersample))
        return spl_fail_field(err, SPL_E_USAGE, "supersample", "supersample %g is none of " SPL_SUPERSAMPLES,
                              view->supersample);
    if (spl_camera_is_bent(&view->camera) && (rc = check_around(view, err)))
        return rc;
    for (int i = 0; i < SPL_PARAM_COUNT && !rc; i++)
        rc = spl_method_param_check(spl_method_param_get(i), spl_view_get_param(view, i), err);
    rc = rc ? rc : spl_shade_check(&view->shade, err);
    rc = rc ? rc : spl_color_check(&view->color, err);
    rc = rc ? rc : spl_soft_check(&view->soft, err);
    return rc ? rc : spl_terms_check(&view->clip, "clip", err);
}

static int refuse_normals(const struct spl_dataset_info *info, const char *field, struct spl_error *err)
{
    const char *finds = "that finds them";
    for (int i = SPL_METHOD_COUNT; i-- > 0;)
        if (spl_method_get(i)->finds_normals)
            finds = spl_method_name(i);
    return spl_fail_field(err, SPL_E_INPUT, field,
                          "dataset '%s' has no normals, as it was packed with --points-only: ask for method %s, which "
                          "takes them from depth, or pack it without",
                          info->id, finds);
}

int spl_view_check_layers(const struct spl_view *view, const struct spl_dataset_info *info, struct spl_error *err)
{
    if (view->layers >> SPL_LAYER_NORMAL & 1 && !spl_method_has_normals(view->method, info))
        return refuse_normals(info, "layer", err);
    if (info->ids > SPL_NOTHING && view->layers >> SPL_LAYER_ID & 1)
        return spl_fail_field(err, SPL_E_INPUT, "layer",
                              "dataset '%s' has %llu splats and vertices of lines, more than the 32 bits of layer "
                              "id number (%u): ask for other layers, or pack the scans as several datasets",
                              info->id, (unsigned long long)info->ids, SPL_NOTHING);
    return spl_view_check_colors(view, info, err);
}

int spl_view_check_colors(const struct spl_view *view, const struct spl_dataset_info *info, struct spl_error *err)
{
    struct spl_paint paint;
    const uint32_t lit = spl_shade_for(view, info) & (SPL_SHADE_HEADLIGHT | SPL_SHADE_SUN);
    if (lit && view->layers >> SPL_LAYER_COLOR & 1 && !spl_method_has_normals(view->method, info))
        return refuse_normals(info, "shade", err);
    int rc = spl_paint_init(&paint, &view->color, info, err);
    return rc ? rc : spl_marks_check_view(view, info, err);
}

int spl_view_read(const struct spl_view *given, struct spl_view *view, struct spl_error *err)
{
    spl_view_init(view);
    int rc = spl_sized_read(given, view, sizeof *view, "spl_view", err);
    return rc ? rc : check(view, err);
}

int spl_view_check(const struct spl_view *view, struct spl_error *err)
{
    struct spl_view known;
    return spl_view_read(view, &known, err);
}

bool spl_view_shows_soft(const struct spl_view *view)
{
    const uint32_t blended = 1u << SPL_LAYER_COLOR | 1u << SPL_LAYER_COVERAGE;
    return view->soft.what.count && view->soft.opacity > 0 &&
           (view->layers & blended || view->soft.of != SPL_SOFT_OF_SOLID);
}

void spl_frame_finish(struct spl_frame *frame)
{
    for (int i = 0; i < SPL_LAYER_COUNT; i++)
        spl_image_finish(&frame->images[i]);
    memset(frame, 0, sizeof *frame);
}
