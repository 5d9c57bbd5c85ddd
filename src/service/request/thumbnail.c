/* A thumbnail: the default view, small, at 16:9, smooth, as JPEG. Pure functions, any thread. */
#include "service/request/request.h"

#include <math.h>

#include "service/request/values.h"

enum { width_least = 16, width_most = 1280, width_usual = 320 };

static void set(struct values *values, enum param param, double n)
{
    values->v[param] = (struct spl_value){.given = true, .count = 1, .n = {n}};
}

int spl_thumbnail_request_from_query(const char *query, size_t length, const struct spl_camera_defaults *defaults,
                                     const struct spl_camera_limits *limits, struct spl_view_request *out,
                                     struct spl_error *err)
{
    struct values values = {0};
    int rc = spl_values_from_query(&values, query, length, SPL_THUMBNAIL, err);
    double width = values.v[PARAM_width].given ? values.v[PARAM_width].n[0] : width_usual;
    if (rc)
        return rc;
    if (!(width >= width_least && width <= width_most))
        return spl_fail_field(err, SPL_E_INPUT, "width", "width %.0f of a thumbnail is outside %d to %d", width,
                              width_least, width_most);
    set(&values, PARAM_width, width);
    set(&values, PARAM_height, fmax(1, round(width * 9 / 16)));
    set(&values, PARAM_supersample, 2);
    set(&values, PARAM_quality, 80);
    return spl_values_resolve(&values, defaults, limits, out, err);
}
