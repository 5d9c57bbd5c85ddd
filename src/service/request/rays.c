/* Rays: a view whose pixels look where a list says. The list comes first, from NPY or JSON, and then the view around
 * it, by the parameters of any other. Pure functions, any thread. */
#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "base/memory.h"
#include "geom/ray_list.h"
#include "image/vectors.h"
#include "service/request/request.h"
#include "service/request/values.h"

const char *const spl_ray_frames[] = {"camera", "sensor", "world", NULL};

int spl_ray_frame_from_name(const char *name)
{
    for (int i = 0; spl_ray_frames[i]; i++)
        if (!strcmp(name, spl_ray_frames[i]))
            return i;
    return -1;
}

int spl_rays_from_npy(FILE *file, uint64_t bytes, const char *name, struct spl_rays **out, struct spl_error *err)
{
    struct spl_error why = {0};
    double *directions;
    size_t count;
    *out = NULL;
    int rc = spl_vectors_load_npy(file, bytes, name, SPL_RAYS_MAX, &directions, &count, &why);
    if (rc)
        return spl_fail_field(err, rc, "directions", "%s", why.message);
    rc = spl_rays_create(directions, count, out, err);
    free(directions);
    return rc;
}

int spl_rays_from_json(const json_t *list, struct spl_rays **out, struct spl_error *err)
{
    const size_t count = json_array_size(list);
    *out = NULL;
    if (!json_is_array(list))
        return spl_fail_field(err, SPL_E_INPUT, "directions", "'directions' must be an array of [x, y, z], not %s",
                              list ? spl_json_type_name(list) : "missing");
    if (!count || count > SPL_RAYS_JSON_MAX)
        return spl_fail_field(err, SPL_E_INPUT, "directions",
                              "there are %zu directions; JSON takes 1 to %d, NPY up to %d", count,
                              (int)SPL_RAYS_JSON_MAX, (int)SPL_RAYS_MAX);
    double *directions = spl_alloc_raw(3 * count, sizeof *directions, err);
    int rc = directions ? 0 : SPL_E_NOMEM;
    for (size_t i = 0; i < count && !rc; i++)
        if (!spl_json_get_numbers(json_array_get(list, i), 3, directions + 3 * i))
            rc = spl_fail_field(err, SPL_E_INPUT, "directions", "directions[%zu] must be three numbers, [x, y, z]", i);
    rc = rc ? rc : spl_rays_create(directions, count, out, err);
    free(directions);
    return rc;
}

int spl_view_set_rays(struct spl_view *view, const struct spl_rays *rays, enum spl_ray_frame frame, double resolution,
                      struct spl_error *err)
{
    double r[9], *own = view->camera.rotation;
    memcpy(r, own, sizeof r);
    for (int i = 0; i < 3 && frame == SPL_FRAME_SENSOR; i++) { /* x is the camera's z, y its -x, z its -y */
        own[i] = r[6 + i];
        own[3 + i] = 0 - r[i];
        own[6 + i] = 0 - r[3 + i];
    }
    for (int i = 0; i < 9 && frame == SPL_FRAME_WORLD; i++)
        own[i] = i % 4 == 0;
    view->rays = rays;
    return spl_camera_set_rays(&view->camera, rays, resolution, err);
}

static void set(struct spl_value *value, double number)
{
    *value = (struct spl_value){.given = true, .count = 1, .n = {number}};
}

int spl_rays_request_from(json_t *rest, const char *query, size_t length, const struct spl_rays *rays,
                          const struct spl_camera_defaults *defaults, const struct spl_camera_limits *limits,
                          struct spl_view_request *out, struct spl_error *err)
{
    struct values values = {.rays = rays};
    struct spl_camera_limits own = *limits;
    int rc = rest ? spl_values_from_object(&values, rest, SPL_BODY | SPL_LIST, err)
                  : spl_values_from_query(&values, query, length, SPL_QUERY | SPL_LIST, err);
    if (rc)
        return rc;
    for (int i = SPL_CAMERA_model; i <= SPL_CAMERA_height; i++)
        if (values.v[i].given) {
            const char *name = values.v[i].source ? values.v[i].source : spl_params[i].name;
            return spl_fail_field(err, SPL_E_INPUT, name,
                                  "'%s' says where the pixels of an image look; here 'directions' do", name);
        }
    if (rays->count > limits->pixels)
        return spl_fail_field(err, SPL_E_INPUT, "directions", "there are %u directions; the limit is %llu", rays->count,
                              (unsigned long long)limits->pixels);
    own.side_px = SPL_RAYS_MAX;
    set(&values.v[SPL_CAMERA_projection], SPL_RAYS);
    set(&values.v[SPL_CAMERA_width], 1);
    set(&values.v[SPL_CAMERA_height], rays->count);
    if (!values.v[PARAM_format].given)
        set(&values.v[PARAM_format], SPL_FORMAT_NPY);
    if (!values.v[PARAM_layer].given && !values.v[PARAM_layers].given)
        set(&values.v[PARAM_layer], SPL_LAYER_RANGE);
    return spl_values_resolve(&values, defaults, &own, out, err);
}
