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

void spl_view_init(struct spl_view *view)
{
    *view = (struct spl_view){
        .method = SPL_METHOD_SPLAT,
        .layers = 1u << SPL_LAYER_COLOR,
        .lod = 1,
        .supersample = 1,
        .background = {0, 0, 0, 255},
        .atoms = SPL_TEXTURE_ATOMS,
        .margin = -1,
        .deadline_ns = UINT64_MAX,
    };
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
    if (!(view->margin <= 16))
        return spl_fail_field(err, SPL_E_USAGE, "margin", "margin %g is not a number up to 16", view->margin);
    return SPL_OK;
}

void spl_frame_finish(struct spl_frame *frame)
{
    for (int i = 0; i < SPL_LAYER_COUNT; i++)
        spl_image_finish(&frame->images[i]);
    memset(frame, 0, sizeof *frame);
}
