/* A view's defaults, its names and its limits. Pure; any thread. */
#include "render/view.h"

#include <math.h>
#include <string.h>

#include "base/error.h"
#include "base/sized.h"
#include "geom/size.h"
#include "render/marks.h"
#include "render/paint.h"
#include "shared.h"

enum { side_max = 32768 };
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

uint64_t spl_view_get_samples(const struct spl_view *view)
{
    uint64_t side = view->supersample > 1 ? (uint64_t)view->supersample : 1;
    return view->camera.width * side * view->camera.height * side;
}

uint64_t spl_view_get_frame_bytes(const struct spl_view *view)
{
    uint64_t pixel = 4 * (uint64_t)__builtin_popcount(view->layers) + (view->layers & 1u << SPL_LAYER_NORMAL ? 8 : 0);
    return pixel * view->camera.width * view->camera.height;
}

static int check(const struct spl_view *view, struct spl_error *err)
{
    int rc = spl_camera_check(&view->camera, err);
    if (rc)
        return rc;
    if (view->camera.width > side_max)
        return spl_fail_field(err, SPL_E_LIMIT, "width", "width %u is above %d", view->camera.width, side_max);
    if (view->camera.height > side_max)
        return spl_fail_field(err, SPL_E_LIMIT, "height", "height %u is above %d", view->camera.height, side_max);
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
    double side = view->supersample;
    if (side != 0.25 && side != 0.5 && side != 1 && side != 2 && side != 4)
        return spl_fail_field(err, SPL_E_USAGE, "supersample", "supersample %g is none of 0.25, 0.5, 1, 2, 4", side);
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
                          "takes them from depth, or pack it without", info->id, finds);
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
    const uint32_t lit = spl_shade_for(&view->shade, info) & (SPL_SHADE_HEADLIGHT | SPL_SHADE_SUN);
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
