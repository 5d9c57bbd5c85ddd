/* A pick: one point of an image instead of the image (render/pick.h). Pure functions, any thread. */
#include "service/request/request.h"

#include "render/pick.h"
#include "service/request/values.h"

static int resolve_point(const struct values *values, enum param param, const char *name, double size, double *out,
                         struct spl_error *err)
{
    if (!values->v[param].given)
        return spl_fail_field(err, SPL_E_INPUT, name, "'%s' is missing: the point to pick, in pixels", name);
    *out = values->v[param].n[0];
    if (!(*out >= 0 && *out <= size))
        return spl_fail_field(err, SPL_E_INPUT, name, "%s %g is outside the image, 0 to %g", name, *out, size);
    return 0;
}

static int resolve(struct values *values, const struct spl_camera_defaults *defaults,
                   const struct spl_camera_limits *limits, struct spl_view_request *out, struct spl_error *err)
{
    *out = (struct spl_view_request){.picks = true};
    spl_view_init(&out->view);
    struct spl_camera *camera = &out->pick.camera;
    struct spl_camera_defaults own;
    int rc;
    out->named = values->v[PARAM_view].given;
    if ((rc = spl_values_choose_view(values, &defaults, &own, err)) ||
        (rc = spl_camera_from_values(values->v, defaults, limits, camera, err)) ||
        (rc = resolve_point(values, PARAM_x, "x", camera->width, &out->pick.x, err)) ||
        (rc = resolve_point(values, PARAM_y, "y", camera->height, &out->pick.y, err)))
        return rc;
    // a pick has no picture: what is said of one is only checked
    struct spl_view_request picture = {.layer = SPL_LAYER_COLOR, .view.camera = *camera};
    if ((rc = spl_values_resolve_encoding(values, &picture, err)))
        return rc;
    out->pick.crs = (uint32_t)values->v[PARAM_crs].n[0];
    spl_values_resolve_splats(values, &out->view);
    if ((rc = spl_values_resolve_terms(values, defaults, out, err)))
        return rc;
    spl_values_resolve_version(values, out);
    out->view.camera = *camera;
    out->view.without_late_tiles = true;
    rc = spl_pick_view(&out->view, out->pick.x, out->pick.y, &out->view, err);
    return rc ? rc : spl_view_check(&out->view, err);
}

int spl_pick_request_from_query(const char *query, size_t length, const struct spl_camera_defaults *defaults,
                                const struct spl_camera_limits *limits, struct spl_view_request *out,
                                struct spl_error *err)
{
    struct values values = {0};
    int rc = spl_values_from_query(&values, query, length, SPL_PICK, err);
    return rc ? rc : resolve(&values, defaults, limits, out, err);
}

int spl_pick_request_from_json(const char *body, size_t length, const struct spl_camera_defaults *defaults,
                               const struct spl_camera_limits *limits, struct spl_view_request *out,
                               struct spl_error *err)
{
    struct values values = {0};
    int rc = spl_values_from_body(&values, body, length, SPL_PICK_BODY, err);
    return rc ? rc : resolve(&values, defaults, limits, out, err);
}
