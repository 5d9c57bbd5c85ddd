/* One rendered pixel to JSON: the world position is the point on the pixel's ray at the depth that was rendered, so it
 * agrees with the depth layer to the bit; the class is that of the nearest splat. */
#include "service/view/pick.h"

#include <jansson.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "dataset/dataset.h"

/* The point at view depth `z` on the ray through the pick. */
static json_t *position(const struct spl_pick *pick, double z)
{
    const struct spl_camera *camera = &pick->camera;
    const double *r = camera->rotation;
    double x = (pick->x - camera->cx) / camera->fx * z, y = (pick->y - camera->cy) / camera->fy * z, p[3];
    for (int i = 0; i < 3; i++)
        p[i] = camera->eye[i] + r[i] * x + r[3 + i] * y + r[6 + i] * z;
    return json_pack("[f, f, f]", p[0], p[1], p[2]);
}

static json_t *normal(const float *n)
{
    bool none = n[0] == 0 && n[1] == 0 && n[2] == 0;
    return none ? json_null() : json_pack("[f, f, f]", (double)n[0], (double)n[1], (double)n[2]);
}

static json_t *classification(const struct spl_dataset *dataset, uint32_t id)
{
    double value;
    bool known = dataset && spl_dataset_find_value(dataset, spl_dataset_find_stream(dataset, "class"), id, &value);
    return known ? json_integer((json_int_t)value) : json_null();
}

/* Members that nothing has a value for are null. */
static void fill(json_t *json, const struct spl_view_request *request, const struct spl_frame *frame,
                 const struct spl_dataset *dataset)
{
    const struct spl_image *images = frame->images;
    float depth = *(const float *)images[SPL_LAYER_DEPTH].pixels,
          range = *(const float *)images[SPL_LAYER_RANGE].pixels;
    uint32_t id = *(const uint32_t *)images[SPL_LAYER_ID].pixels;
    const uint8_t *rgba = images[SPL_LAYER_COLOR].pixels;
    bool hit = isfinite(depth), named = hit && id != UINT32_MAX;
    json_object_set_new(json, "position", hit ? position(&request->pick, (double)depth) : json_null());
    json_object_set_new(json, "normal",
                        hit && images[SPL_LAYER_NORMAL].pixels ? normal(images[SPL_LAYER_NORMAL].pixels) : json_null());
    json_object_set_new(json, "color", hit ? json_pack("[i, i, i]", rgba[0], rgba[1], rgba[2]) : json_null());
    json_object_set_new(json, "class", named ? classification(dataset, id) : json_null());
    json_object_set_new(json, "depth", hit ? json_real((double)depth) : json_null());
    json_object_set_new(json, "distance", hit && isfinite(range) ? json_real((double)range) : json_null());
    json_object_set_new(json, "splat", named ? json_integer(id) : json_null());
}

int spl_pick_encode(const struct spl_view_request *request, const struct spl_frame *frame,
                    const struct spl_dataset *dataset, struct spl_encoded *out, struct spl_error *err)
{
    *out = (struct spl_encoded){.media_type = "application/json"};
    json_t *json = json_pack("{s:f, s:f, s:s}", "x", request->pick.x, "y", request->pick.y, "unit", "m");
    if (json)
        fill(json, request, frame, dataset);
    char *text = json ? json_dumps(json, JSON_INDENT(1) | JSON_REAL_PRECISION(17)) : NULL;
    json_decref(json);
    if (!text)
        return spl_fail(err, SPL_E_NOMEM, "out of memory for what was picked");
    out->bytes = (uint8_t *)text;
    out->length = strlen(text);
    return 0;
}
