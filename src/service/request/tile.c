/* A map tile: the view that its place says, drawn as the query says (parameters of place SPL_TILE). Pure functions, any
 * thread. */
#include <string.h>

#include "service/request/request.h"
#include "service/request/values.h"

static void set(struct values *values, int param, const double *numbers, unsigned count)
{
    struct spl_value *value = &values->v[param];
    value->given = true;
    value->count = count;
    memcpy(value->n, numbers, count * sizeof *numbers);
}

int spl_tile_request_from_query(const char *query, size_t length, const struct spl_tile_view *tile,
                                const struct spl_camera_defaults *defaults, const struct spl_camera_limits *limits,
                                struct spl_view_request *out, struct spl_error *err)
{
    struct values values = {0};
    const double *eye = tile->eye, side = tile->side, format = tile->format, projection = SPL_ORTHOGRAPHIC, yes = 1,
                 no = 0;
    int rc = spl_values_from_query(&values, query, length, SPL_TILE, err);
    if (rc)
        return rc;
    set(&values, SPL_CAMERA_eye, eye, 3);
    set(&values, SPL_CAMERA_target, (double[]){eye[0], eye[1], eye[2] - 1}, 3);
    set(&values, SPL_CAMERA_up, (double[]){tile->up[0], tile->up[1], 0}, 3);
    set(&values, SPL_CAMERA_projection, &projection, 1);
    set(&values, SPL_CAMERA_fx, &tile->scale[0], 1);
    set(&values, SPL_CAMERA_fy, &tile->scale[1], 1);
    set(&values, SPL_CAMERA_width, &side, 1);
    set(&values, SPL_CAMERA_height, &side, 1);
    set(&values, SPL_CAMERA_near, &no, 1);
    set(&values, PARAM_format, &format, 1);
    if (!values.v[PARAM_background].given)
        set(&values, PARAM_transparent, &yes, 1);
    rc = spl_values_resolve(&values, defaults, limits, out, err);
    out->view.surrounded = true;
    return rc;
}
