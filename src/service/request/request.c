/* From given parameters to a checked view: the camera by its own rules, what is drawn and how it is encoded by these.
 *
 * Invariant: what comes out has passed spl_view_check() and lies within the server's caps, so that no later stage
 * refuses it for a reason that this one could have named. Pure functions, any thread. */
#include "service/request/request.h"

#include <math.h>
#include <stdio.h>

#include "geom/ground.h"
#include "geom/ray_list.h"

#include "render/view.h"
#include "service/request/values.h"

static bool given(const struct values *values, enum param param)
{
    return values->v[param].given;
}

static double get(const struct values *values, enum param param, double otherwise)
{
    return values->v[param].given ? values->v[param].n[0] : otherwise;
}

static enum spl_format natural_format(enum spl_layer layer)
{
    return layer == SPL_LAYER_COLOR ? SPL_FORMAT_JPEG : SPL_FORMAT_PNG;
}

struct spl_encode_options spl_view_get_encoding(const struct spl_view_request *request, enum spl_layer layer)
{
    struct spl_encode_options encode = request->encode;
    if (request->natural)
        encode.format = natural_format(layer);
    return encode;
}

int spl_values_resolve_encoding(const struct values *values, struct spl_view_request *out, struct spl_error *err)
{
    double quality = get(values, PARAM_quality, 90), scale = get(values, PARAM_depth_scale, 1000);
    double chroma = get(values, PARAM_chroma, 0);
    enum spl_format format = (enum spl_format)get(values, PARAM_format, natural_format(out->layer));
    if (quality < 1 || quality > 100)
        return spl_fail_field(err, SPL_E_INPUT, "quality", "quality %g is outside 1 to 100", quality);
    if (given(values, PARAM_chroma) && chroma != 420 && chroma != 444)
        return spl_fail_field(err, SPL_E_INPUT, "chroma", "chroma %g is neither 420 nor 444", chroma);
    if (chroma == 444 && format == SPL_FORMAT_WEBP)
        return spl_fail_field(err, SPL_E_INPUT, "chroma", "a lossy WebP is always 420; leave chroma out");
    if (!(scale >= 1e-6 && scale <= 1e9))
        return spl_fail_field(err, SPL_E_INPUT, "depth_scale", "depth_scale %g is outside 1e-6 to 1e9", scale);
    out->listed = (int)format == SPL_FORMAT_LISTED;
    if (values->rays ? !out->listed && format != SPL_FORMAT_NPY && format != SPL_FORMAT_RAW : out->listed)
        return spl_fail_field(err, SPL_E_INPUT, "format",
                              values->rays ? "format of rays is npy, raw or json" : "format 'json' is of rays alone");
    if (out->listed && values->rays->count > SPL_RAYS_JSON_MAX)
        return spl_fail_field(err, SPL_E_INPUT, "format", "JSON lists what %d rays hit, not %u; ask for npy or raw",
                              (int)SPL_RAYS_JSON_MAX, values->rays->count);
    if (out->listed)
        format = SPL_FORMAT_RAW;
    out->natural = !given(values, PARAM_format);
    out->encode = SPL_SIZED(spl_encode_options, .format = format, .quality = (int)quality, .chroma = (int)chroma,
                            .depth_scale = scale, .list = values->rays);
    if (format != SPL_FORMAT_TIFF) { // what is none has no world file
        spl_camera_get_ground(&out->view.camera, &out->encode.ground, NULL);
        return 0;
    }
    return spl_camera_get_ground(&out->view.camera, &out->encode.ground, err);
}

static int resolve_layers(const struct values *values, struct spl_view_request *out, struct spl_error *err)
{
    bool several = given(values, PARAM_layers);
    if (several && given(values, PARAM_layer))
        return spl_fail_field(err, SPL_E_INPUT, "layers", "'layer' and 'layers' exclude each other");
    if (!several && given(values, PARAM_container))
        return spl_fail_field(err, SPL_E_INPUT, "container", "'layers' is needed where 'container' is given");
    out->layer = (enum spl_layer)get(values, PARAM_layer, SPL_LAYER_COLOR);
    out->view.layers = 1u << out->layer;
    if (several) {
        out->view.layers = (uint32_t)values->v[PARAM_layers].n[0];
        out->layer = (enum spl_layer)__builtin_ctz(out->view.layers);
        out->container = (enum spl_container)get(values, PARAM_container, SPL_CONTAINER_MULTIPART);
    }
    return 0;
}

void spl_values_resolve_splats(const struct values *values, struct spl_view *view)
{
#define TAKE(name, ...)                                                                                                \
    if (given(values, PARAM_##name))                                                                                   \
        spl_view_set_param(view, SPL_PARAM_##name, values->v[PARAM_##name].n[0]);
    SPL_METHOD_PARAMS(TAKE, TAKE, TAKE)
#undef TAKE
    view->method = (enum spl_method)get(values, PARAM_method, view->method);
    view->lod = get(values, PARAM_lod, view->lod);
}

static int resolve_drawing(const struct values *values, struct spl_view_request *out, struct spl_error *err)
{
    struct spl_view *view = &out->view;
    int rc = resolve_layers(values, out, err);
    if (rc)
        return rc;
    spl_values_resolve_splats(values, view);
    spl_values_resolve_colors(values, view);
    view->supersample = get(values, PARAM_supersample, 1);
    if (given(values, PARAM_background))
        for (int i = 0; i < 4; i++)
            view->background[i] = (uint8_t)values->v[PARAM_background].n[i];
    const bool clear = get(values, PARAM_format, SPL_FORMAT_RAW) == SPL_FORMAT_TIFF && !given(values, PARAM_background);
    if (get(values, PARAM_transparent, clear) != 0) // a map lies over others
        view->background[3] = 0;
    return 0;
}

void spl_values_resolve_colors(const struct values *values, struct spl_view *view)
{
    const double *shade = values->v[PARAM_shade].n, *range = values->v[PARAM_range].n;
    const enum spl_ramp ramp = view->color.ramp; /* as a method's parameter, which is there by now */
    view->color = values->color;
    view->color.ramp = ramp;
    if (given(values, PARAM_range)) {
        view->color.has_range = true;
        for (int i = 0; i < 2; i++) {
            view->color.range[i] = range[i];
            view->color.shares[i] = (int)range[2] >> i & 1;
        }
    }
    if (given(values, PARAM_shade)) {
        view->shade.kinds = (uint32_t)shade[0];
        view->shade.sun[0] = shade[1];
        view->shade.sun[1] = shade[2];
    }
}

/* Samples and memory, not pixels alone, are what a view costs. */
static int check_cost(const struct spl_view *view, const struct spl_camera_limits *limits, struct spl_error *err)
{
    uint64_t samples = spl_view_get_samples(view), bytes = spl_view_get_frame_bytes(view);
    const struct spl_camera *camera = &view->camera;
    if (limits->samples && samples > limits->samples)
        return spl_fail_field(err, SPL_E_INPUT,
                              view->supersample > 1 ? "supersample"
                              : view->rays          ? "resolution"
                                                    : "width",
                              "%u x %u pixels with supersample %g are %llu samples; the limit is %llu", camera->width,
                              camera->height, view->supersample, (unsigned long long)samples,
                              (unsigned long long)limits->samples);
    char drawn[64] = "";
    if (spl_view_is_resampled(view))
        snprintf(drawn, sizeof drawn, ", and of the image of %g times the size,", view->supersample);
    if (limits->bytes && bytes > limits->bytes)
        return spl_fail_field(err, SPL_E_INPUT, drawn[0] ? "supersample" : "layers",
                              "%d layers of %u x %u pixels%s are %llu bytes in memory; the limit is %llu",
                              __builtin_popcount(view->layers), camera->width, camera->height, drawn,
                              (unsigned long long)bytes, (unsigned long long)limits->bytes);
    return 0;
}

static int resolve_demand(const struct values *values, const struct spl_camera_limits *limits,
                          struct spl_view_request *out, struct spl_error *err)
{
    static const double longest_ms = 600000;
    struct spl_demand *demand = &out->demand;
    double budget = get(values, PARAM_budget, NAN), psnr = get(values, PARAM_psnr, NAN);
    if (given(values, PARAM_budget) && !(budget > 0 && budget <= longest_ms))
        return spl_fail_field(err, SPL_E_INPUT, "budget", "budget must be above 0, up to %.0f ms, not %g", longest_ms,
                              budget);
    if (given(values, PARAM_psnr) && !(psnr >= 0 && psnr <= SPL_PROFILE_PSNR_MAX))
        return spl_fail_field(err, SPL_E_INPUT, "psnr", "psnr %g is outside 0 to %g", psnr, SPL_PROFILE_PSNR_MAX);
    if (given(values, PARAM_psnr) && out->layer != SPL_LAYER_COLOR)
        return spl_fail_field(err, SPL_E_INPUT, "psnr", "psnr is about colour; layer=%s takes a budget only",
                              spl_layer_name(out->layer));
    if (out->container && (given(values, PARAM_budget) || given(values, PARAM_psnr)))
        return spl_fail_field(err, SPL_E_INPUT, "layers",
                              "budget and psnr are about one layer; ask for it with 'layer'");
    out->planned = given(values, PARAM_budget) || given(values, PARAM_psnr);
    if (out->planned && spl_camera_is_bent(&out->view.camera))
        return spl_fail_field(
            err, SPL_E_INPUT, given(values, PARAM_budget) ? "budget" : "psnr",
            "what settings cost and gain is known of pinholes and parallel rays; give method, lod and "
            "supersample");
    demand->budget_ms = budget;
    demand->psnr = psnr;
    demand->width = out->view.camera.width;
    demand->height = out->view.camera.height;
    demand->samples_max = limits->samples;
    demand->layer = out->layer;
    demand->keep_method = given(values, PARAM_method);
    demand->keep_lod = given(values, PARAM_lod);
    demand->keep_supersample = given(values, PARAM_supersample);
    demand->keep_atoms = given(values, PARAM_atoms);
    demand->keep_maps = given(values, PARAM_maps);
    demand->kept.method = out->view.method;
    demand->kept.lod = out->view.lod;
    demand->kept.supersample = out->view.supersample;
    demand->kept.atoms = out->view.disc.atoms;
    demand->kept.maps = out->view.maps == SPL_MAPS_ON ? SPL_SETTING_MAPS_ON : SPL_SETTING_MAPS_OFF;
    return 0;
}

void spl_values_resolve_version(const struct values *values, struct spl_view_request *out)
{
    const struct spl_value *v = &values->v[PARAM_v];
    out->versioned = v->given;
    out->version = v->given ? (uint64_t)v->n[0] << 32 | (uint64_t)v->n[1] : 0;
}

int spl_values_choose_view(struct values *values, const struct spl_camera_defaults **defaults,
                           struct spl_camera_defaults *own, struct spl_error *err)
{
    const struct spl_value *view = &values->v[PARAM_view];
    if (!view->given)
        return 0;
    if (!(*defaults)->names)
        return spl_fail_field(err, SPL_E_INPUT, "view", "there are no views by name here; leave view out");
    *own = **defaults;
    int rc = own->names->find(own->names, view->word, own, err);
    *defaults = own;
    if (!rc)
        spl_camera_inherit_projection(values->v, own->view_height);
    return rc ? rc : spl_values_inherit_saved(values, own->settings, err);
}

int spl_values_resolve(struct values *values, const struct spl_camera_defaults *defaults,
                       const struct spl_camera_limits *limits, struct spl_view_request *out, struct spl_error *err)
{
    *out = (struct spl_view_request){0};
    spl_view_init(&out->view);
    struct spl_camera_defaults own;
    int rc;
    out->named = given(values, PARAM_view);
    if ((rc = spl_values_choose_view(values, &defaults, &own, err)) ||
        (rc = spl_camera_from_values(values->v, defaults, limits, &out->view.camera, err)) ||
        (values->rays &&
         (rc = spl_view_set_rays(&out->view, values->rays, (enum spl_ray_frame)get(values, PARAM_frame, 0),
                                 get(values, PARAM_resolution, 0), err))) ||
        (rc = resolve_drawing(values, out, err)) || (rc = spl_values_resolve_terms(values, defaults, out, err)) ||
        (rc = spl_values_resolve_encoding(values, out, err)) || (rc = resolve_demand(values, limits, out, err)))
        return rc;
    spl_values_resolve_version(values, out);
    out->view.partial = get(values, PARAM_wait, 1) == 0;
    out->view.without_late_tiles = !given(values, PARAM_wait);
    rc = spl_view_check(&out->view, err);
    return rc ? rc : check_cost(&out->view, limits, err);
}
