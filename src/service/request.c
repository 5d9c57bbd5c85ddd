/* From given parameters to a checked view: the camera by its own rules, what is drawn and how it is encoded by these.
 *
 * Invariant: what comes out has passed spl_view_check() and lies within the server's caps, so that no later stage
 * refuses it for a reason that this one could have named. Pure functions, any thread. */
#include "service/request.h"

#include <math.h>

#include "service/values.h"

static bool given(const struct values *values, enum param param)
{
    return values->v[param].given;
}

static double get(const struct values *values, enum param param, double otherwise)
{
    return values->v[param].given ? values->v[param].n[0] : otherwise;
}

static int resolve_encoding(const struct values *values, struct spl_view_request *out, struct spl_error *err)
{
    enum spl_format natural = out->layer == SPL_LAYER_COLOR ? SPL_FORMAT_JPEG : SPL_FORMAT_PNG;
    double quality = get(values, PARAM_quality, 90), scale = get(values, PARAM_depth_scale, 1000);
    if (quality < 1 || quality > 100)
        return spl_fail_field(err, SPL_E_INPUT, "quality", "quality %g is outside 1 to 100", quality);
    if (!(scale >= 1e-6 && scale <= 1e9))
        return spl_fail_field(err, SPL_E_INPUT, "depth_scale", "depth_scale %g is outside 1e-6 to 1e9", scale);
    out->encode = (struct spl_encode_options){
        .format = (enum spl_format)get(values, PARAM_format, natural), .quality = (int)quality, .depth_scale = scale};
    return 0;
}

static int resolve_drawing(const struct values *values, struct spl_view_request *out, struct spl_error *err)
{
    struct spl_view *view = &out->view;
    double margin = get(values, PARAM_margin, view->margin), supersample = get(values, PARAM_supersample, 1);
    if (given(values, PARAM_margin) && margin < 0) // negative means "default" further down
        return spl_fail_field(err, SPL_E_INPUT, "margin", "margin %g is negative", margin);
    out->layer = (enum spl_layer)get(values, PARAM_layer, SPL_LAYER_COLOR);
    view->layers = 1u << out->layer;
    view->method = (enum spl_method)get(values, PARAM_method, view->method);
    view->lod = get(values, PARAM_lod, view->lod);
    view->supersample = supersample;
    view->margin = margin;
    if (given(values, PARAM_background))
        for (int i = 0; i < 4; i++)
            view->background[i] = (uint8_t)values->v[PARAM_background].n[i];
    if (get(values, PARAM_transparent, 0) != 0)
        view->background[3] = 0;
    return 0;
}

static int resolve_demand(const struct values *values, struct spl_view_request *out, struct spl_error *err)
{
    static const double longest_ms = 600000;
    struct spl_demand *demand = &out->demand;
    double budget = get(values, PARAM_budget, NAN), psnr = get(values, PARAM_psnr, NAN);
    if (given(values, PARAM_budget) && !(budget > 0 && budget <= longest_ms))
        return spl_fail_field(err, SPL_E_INPUT, "budget", "budget %g ms is outside 0 (exclusive) to %.0f", budget,
                              longest_ms);
    if (given(values, PARAM_psnr) && !(psnr >= 0 && psnr <= SPL_PROFILE_PSNR_MAX))
        return spl_fail_field(err, SPL_E_INPUT, "psnr", "psnr %g is outside 0 to %g", psnr, SPL_PROFILE_PSNR_MAX);
    if (given(values, PARAM_psnr) && out->layer != SPL_LAYER_COLOR)
        return spl_fail_field(err, SPL_E_INPUT, "psnr", "psnr is about colour; layer=%s takes a budget only",
                              spl_layer_name(out->layer));
    out->planned = given(values, PARAM_budget) || given(values, PARAM_psnr);
    demand->budget_ms = budget;
    demand->psnr = psnr;
    demand->width = out->view.camera.width;
    demand->height = out->view.camera.height;
    demand->layer = out->layer;
    demand->keep_method = given(values, PARAM_method);
    demand->keep_lod = given(values, PARAM_lod);
    demand->keep_supersample = given(values, PARAM_supersample);
    demand->kept.method = out->view.method;
    demand->kept.lod = out->view.lod;
    demand->kept.supersample = out->view.supersample;
    return 0;
}

static void resolve_version(const struct values *values, struct spl_view_request *out)
{
    const struct spl_value *v = &values->v[PARAM_v];
    out->versioned = v->given;
    out->version = v->given ? (uint64_t)v->n[0] << 32 | (uint64_t)v->n[1] : 0;
}

int spl_values_resolve(const struct values *values, const struct spl_camera_defaults *defaults,
                       const struct spl_camera_limits *limits, struct spl_view_request *out, struct spl_error *err)
{
    *out = (struct spl_view_request){0};
    spl_view_init(&out->view);
    int rc;
    if ((rc = spl_camera_from_values(values->v, defaults, limits, &out->view.camera, err)) ||
        (rc = resolve_drawing(values, out, err)) || (rc = resolve_encoding(values, out, err)) ||
        (rc = resolve_demand(values, out, err)))
        return rc;
    resolve_version(values, out);
    return spl_view_check(&out->view, err);
}
