/* A photograph, its pyramid, and the depths of the splats from its eye.
 *
 * The depth map is drawn by the renderer from the dataset that is textured, so what hides a splat is what hides it in a
 * frame. It is a pinhole's: a distorted photograph gets one that holds all that its lens saw. */
#include "pack/texture/photo.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "base/memory.h"
#include "geom/size.h"

enum { black = 6, border_steps = 32, depth_side = 1600 /* samples, at most */ };
static const double widest = 5; /* tangent of the angle off the axis to which depth is drawn */

/* Mean difference of neighbours in green. */
static double contrast(const struct spl_photo *photo, uint32_t level)
{
    uint64_t sum = 0;
    uint32_t w = photo->pixels.width[level], h = photo->pixels.height[level];
    for (uint32_t y = 0; y < h; y++)
        for (uint32_t x = 1; x < w; x++) {
            const uint8_t *p = photo->pixels.texels[level] + 4 * ((size_t)y * w + x);
            sum += (uint64_t)abs(p[1] - p[-3]);
        }
    return (double)sum / ((double)w * h);
}

/* A sharp photograph differs from pixel to pixel as much at full size as at half size, a blurred one half as much. */
static double find_sharpness(const struct spl_photo *photo)
{
    double half = photo->pixels.levels > 2 ? contrast(photo, 1) : 0;
    double ratio = half > 0 ? contrast(photo, 0) / half : 1;
    return fmin(fmax((ratio - 0.4) / 0.4, 0.2), 1);
}

static bool is_black(const struct spl_photo *photo)
{
    size_t count = (size_t)photo->pixels.width[0] * photo->pixels.height[0];
    for (size_t i = 0; i < count; i++) {
        const uint8_t *p = photo->pixels.texels[0] + 4 * i;
        if (p[3] && (p[0] > black || p[1] > black || p[2] > black))
            return false;
    }
    return true;
}

int spl_photo_init(struct spl_photo *photo, const struct spl_named_view *view, struct spl_image *pixels,
                   struct spl_error *err)
{
    const struct spl_camera *camera = &view->camera;
    const char *path = view->photograph ? view->photograph : view->name;
    *photo = (struct spl_photo){.view = view};
    int rc = spl_pyramid_init(&photo->pixels, pixels, err);
    if (rc)
        return rc;
    if (photo->pixels.width[0] != camera->width || photo->pixels.height[0] != camera->height)
        rc = spl_fail_field(err, SPL_E_INPUT, "width",
                            "%s: %u x %u pixels; its camera says %u x %u: scale the photograph or its lens", path,
                            photo->pixels.width[0], photo->pixels.height[0], camera->width, camera->height);
    else if (is_black(photo))
        rc = spl_photo_is_face(view) ? SPL_PHOTO_EMPTY : spl_fail(err, SPL_E_INPUT, "%s: nothing but black", path);
    if (!rc)
        photo->sharpness = find_sharpness(photo);
    if (rc)
        spl_photo_close(photo);
    return rc;
}

/* The widest that the lens saw, along each image edge, as tangents. */
static void find_extent(const struct spl_named_view *view, double low[2], double high[2])
{
    const struct spl_camera *c = &view->camera;
    low[0] = low[1] = INFINITY;
    high[0] = high[1] = -INFINITY;
    for (int i = 0; i <= 4 * border_steps; i++) {
        double along = (double)(i % border_steps) / border_steps;
        int edge = i / border_steps;
        double u = edge == 1 || edge == 4 ? 1 : edge == 3 ? 0 : edge ? 1 - along : along;
        double v = edge == 0 ? 0 : edge == 2 ? 1 : along;
        double x = (u * c->width - c->cx) / c->fx, y = (v * c->height - c->cy) / c->fy, r = hypot(x, y);
        double scale = 1;
        if (view->distortion.kind != SPL_DISTORTION_NONE && r > 1e-9)
            scale = fmin(spl_distortion_invert(&view->distortion, r), widest) / r;
        const double p[2] = {x * scale, y * scale};
        for (int a = 0; a < 2; a++) {
            low[a] = fmin(low[a], p[a]);
            high[a] = fmax(high[a], p[a]);
        }
    }
}

static struct spl_camera find_depth_camera(const struct spl_named_view *view)
{
    struct spl_camera camera = view->camera;
    double low[2], high[2];
    find_extent(view, low, high);
    double span = fmax((high[0] - low[0]) * camera.fx, (high[1] - low[1]) * camera.fy);
    double scale = fmin(1, depth_side / span);
    spl_camera_scale(&camera, scale, scale);
    camera.cx = -low[0] * camera.fx;
    camera.cy = -low[1] * camera.fy;
    camera.width = (uint32_t)fmax(1, ceil((high[0] - low[0]) * camera.fx - 1e-6));
    camera.height = (uint32_t)fmax(1, ceil((high[1] - low[1]) * camera.fy - 1e-6));
    return camera;
}

uint64_t spl_photo_bytes(const struct spl_named_view *view)
{
    struct spl_camera depth = find_depth_camera(view);
    uint64_t whole = spl_photo_is_face(view) ? (uint64_t)view->inner->width * view->inner->height * 4 : 0;
    return whole + (uint64_t)view->camera.width * view->camera.height * 4 * 4 / 3 +
           (uint64_t)depth.width * depth.height * 4;
}

static int render_depth(struct spl_photo *photo, struct spl_renderer *renderer, const struct spl_dataset *dataset,
                        struct spl_error *err)
{
    const char *path = photo->view->photograph;
    struct spl_view view;
    struct spl_frame frame;
    struct spl_error why = {0};
    spl_view_init(&view);
    view.camera = photo->depth_camera;
    view.layers = 1u << SPL_LAYER_DEPTH;
    int rc = spl_renderer_render(renderer, dataset, &view, &frame, &why);
    if (rc)
        return spl_fail_field(err, rc, why.field, "%s: depth of the splats: %s", path, why.message);
    photo->depth = frame.images[SPL_LAYER_DEPTH];
    frame.images[SPL_LAYER_DEPTH] = (struct spl_image){0};
    spl_frame_finish(&frame);
    const float *depth = photo->depth.pixels;
    size_t count = (size_t)photo->depth.width * photo->depth.height, seen = 0, close = 0;
    double within = 4 * spl_dataset_get_info(dataset)->splat_radius;
    for (size_t i = 0; i < count; i++) {
        seen += !isnan(depth[i]);
        close += depth[i] < within;
    }
    if (!seen && spl_photo_is_face(photo->view))
        return SPL_PHOTO_EMPTY;
    if (!seen)
        return spl_fail(err, SPL_E_INPUT, "%s: its pose sees no splat; is the model in the scan's coordinates?", path);
    if (close > count / 2)
        return spl_fail(err, SPL_E_INPUT,
                        "%s: its pose stands within the splats: %.0f %% of them are nearer than %.3g, four radii", path,
                        100.0 * (double)close / (double)count, within);
    return SPL_OK;
}

int spl_photo_open(struct spl_photo *photo, const struct spl_named_view *view, struct spl_photo_whole *whole,
                   struct spl_renderer *renderer, const struct spl_dataset *dataset, struct spl_error *err)
{
    struct spl_image pixels = {0};
    struct spl_image_info info;
    *photo = (struct spl_photo){0};
    int rc = spl_photo_image_get_info(view, &info, err);
    if (rc || (rc = spl_photo_image_load_of(whole, view, &pixels, err)) ||
        (rc = spl_photo_init(photo, view, &pixels, err)))
        return rc;
    photo->depth_camera = find_depth_camera(view);
    if ((rc = render_depth(photo, renderer, dataset, err)))
        spl_photo_close(photo);
    return rc;
}

void spl_photo_close(struct spl_photo *photo)
{
    spl_pyramid_finish(&photo->pixels);
    spl_image_finish(&photo->depth);
    *photo = (struct spl_photo){0};
}

enum spl_sight spl_photo_see(const struct spl_photo *photo, const double p[3], double slack)
{
    double pixel[2], depth;
    int w = (int)photo->depth.width, h = (int)photo->depth.height;
    const float *map = photo->depth.pixels;
    if (!map)
        return SPL_SIGHT_CLEAR;
    if (!spl_camera_project(&photo->depth_camera, p, pixel, &depth) || !(pixel[0] >= 0 && pixel[0] < w) ||
        !(pixel[1] >= 0 && pixel[1] < h))
        return SPL_SIGHT_HIDDEN;
    int x = (int)pixel[0], y = (int)pixel[1];
    enum spl_sight sight = SPL_SIGHT_CLEAR;
    bool beyond = true;
    for (int dy = -2; dy <= 2; dy++)
        for (int dx = -2; dx <= 2; dx++) {
            int sx = x + dx, sy = y + dy;
            if (sx < 0 || sy < 0 || sx >= w || sy >= h)
                continue;
            float there = map[sy * w + sx];
            bool inner = abs(dx) < 2 && abs(dy) < 2;
            if (inner && there < depth - slack)
                return SPL_SIGHT_HIDDEN;
            if (!inner && there < depth - 3 * slack)
                sight = SPL_SIGHT_EDGE;
            if (inner && there <= depth + 2 * slack)
                beyond = false;
        }
    return beyond ? SPL_SIGHT_BEYOND : sight;
}
