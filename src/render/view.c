/* A view's defaults, its names and its limits. Pure; any thread. */
#include <splatd/render.h>

#include <math.h>
#include <string.h>

#include "base/error.h"
#include "shared.h"

enum { side_max = 32768 };
#define PIXELS_MAX (1ull << 28)

static const char *const method_names[SPL_METHOD_COUNT] = {
    [SPL_METHOD_SPLAT] = "splat",
    [SPL_METHOD_POINTS] = "points",
    [SPL_METHOD_FILL] = "fill",
};

static const char *const visibility_names[SPL_VISIBILITY_COUNT] = {
    [SPL_VISIBILITY_ADAPTIVE] = "adaptive",
    [SPL_VISIBILITY_CONSTANT] = "constant",
    [SPL_VISIBILITY_NONE] = "none",
};

const char *spl_method_name(enum spl_method method)
{
    return (unsigned)method < SPL_METHOD_COUNT ? method_names[method] : "unknown";
}

int spl_method_from_name(const char *name)
{
    for (int i = 0; i < SPL_METHOD_COUNT; i++)
        if (!strcmp(name, method_names[i]))
            return i;
    return -1;
}

bool spl_method_has_textures(enum spl_method method)
{
    return method == SPL_METHOD_SPLAT;
}

const char *spl_visibility_name(enum spl_visibility visibility)
{
    return (unsigned)visibility < SPL_VISIBILITY_COUNT ? visibility_names[visibility] : "unknown";
}

int spl_visibility_from_name(const char *name)
{
    for (int i = 0; i < SPL_VISIBILITY_COUNT; i++)
        if (!strcmp(name, visibility_names[i]))
            return i;
    return -1;
}

void spl_view_init(struct spl_view *view)
{
    *view = (struct spl_view){
        .method = SPL_METHOD_SPLAT,
        .layers = 1u << SPL_LAYER_COLOR,
        .lod = 1,
        .supersample = 1,
        .background = {0, 0, 0, 255},
        .atoms = SPL_TEXTURE_ATOMS,
        .margin = 1,
        .threshold = 0.38, /* above three open sectors of eight, a hole's most; the edge of a surface leaves four */
        .deadline_ns = UINT64_MAX,
    };
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

int spl_view_check(const struct spl_view *view, struct spl_error *err)
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
    if (view->atoms > SPL_TEXTURE_ATOMS)
        return spl_fail_field(err, SPL_E_USAGE, "atoms", "atoms %u is not within 0 and %d", view->atoms,
                              SPL_TEXTURE_ATOMS);
    if ((unsigned)view->visibility >= SPL_VISIBILITY_COUNT)
        return spl_fail_field(err, SPL_E_USAGE, "visibility", "visibility %d does not exist", (int)view->visibility);
    if (view->kernel != 0 && !(view->kernel >= 3 && view->kernel <= 129))
        return spl_fail_field(err, SPL_E_USAGE, "kernel", "kernel %g is neither 0 nor within 3 and 129 pixels",
                              view->kernel);
    if (!(view->threshold >= 0 && view->threshold <= 1))
        return spl_fail_field(err, SPL_E_USAGE, "threshold", "threshold %g is not within 0 and 1", view->threshold);
    if (view->pyramid > SPL_FILL_LEVELS_MAX)
        return spl_fail_field(err, SPL_E_USAGE, "pyramid", "pyramid %u is not within 0 and %d", view->pyramid,
                              SPL_FILL_LEVELS_MAX);
    if (!(view->margin >= 0 && view->margin <= 16))
        return spl_fail_field(err, SPL_E_USAGE, "margin", "margin %g is not within 0 and 16", view->margin);
    return SPL_OK;
}

int spl_view_check_layers(const struct spl_view *view, const struct spl_dataset_info *info, struct spl_error *err)
{
    if (!info->has_surface && view->layers >> SPL_LAYER_NORMAL & 1 && view->method == SPL_METHOD_POINTS)
        return spl_fail_field(err, SPL_E_INPUT, "layer",
                              "dataset '%s' has no normals, as it was packed with --points-only: ask for method "
                              "fill, which takes them from depth, or pack it without",
                              info->id);
    if (info->splats > SPL_NOTHING && view->layers >> SPL_LAYER_ID & 1)
        return spl_fail_field(err, SPL_E_INPUT, "layer",
                              "dataset '%s' has %llu splats, more than the 32 bits of layer id number (%u): ask for "
                              "other layers, or pack the scans as several datasets",
                              info->id, (unsigned long long)info->splats, SPL_NOTHING);
    return SPL_OK;
}

void spl_frame_finish(struct spl_frame *frame)
{
    for (int i = 0; i < SPL_LAYER_COUNT; i++)
        spl_image_finish(&frame->images[i]);
    memset(frame, 0, sizeof *frame);
}
