/* A camera as ROS's CameraInfo says it: the raw image's k with what bends it, or p of the rectified one. Pure
 * functions, any thread. */
#include <string.h>

#include "geom/camera_forms.h"
#include "geom/camera_matrix.h"

/* k (3 columns) or p (4), row-major: fx 0 cx [0], 0 fy cy [0], 0 0 1 [0]. */
static int read_ros_matrix(const json_t *json, const char *name, unsigned columns, double lens[4],
                           struct spl_error *err)
{
    double m[12] = {0};
    int rc = spl_json_get_matrix(spl_form_get(json, name), name, 3, columns, SPL_ROW_MAJOR, m, err);
    for (unsigned i = 0; !rc && i < 3 * columns; i++) {
        unsigned row = i / columns, column = i % columns;
        bool any = row < 2 && (column == row || column == 2);
        if (!any && m[i] != (row == 2 && column == 2))
            return spl_fail_field(err, SPL_E_INPUT, name, "number %u of %s is %g instead of %d: %s", i + 1, name, m[i],
                                  row == 2 && column == 2,
                                  column == 3 ? "a stereo baseline belongs into the pose" : "row-major, without skew");
    }
    for (int i = 0; !rc && i < 2; i++) {
        lens[i] = m[i * (int)columns + i];
        lens[2 + i] = m[i * (int)columns + 2] + 0.5; // ROS's first pixel centre is (0, 0)
    }
    return rc;
}

/* What bends the raw image's rays: how many of its coefficients are there in *count, 0 where none bends. */
static int read_ros_distortion(const json_t *json, double bend[8], unsigned *count, bool *fisheye,
                               struct spl_error *err)
{
    static const struct {
        const char *name;
        size_t least, most; /* coefficients */
    } models[] = {{"plumb_bob", 4, 5}, {"rational_polynomial", 8, 8}, {"equidistant", 4, 4}};
    const json_t *d = json_object_get(json, "d"), *model = json_object_get(json, "distortion_model");
    const char *name = model ? json_string_value(model) : "";
    const size_t given = json_array_size(d);
    int found = -1;
    *count = 0;
    if (d && !json_is_array(d))
        return spl_fail_field(err, SPL_E_INPUT, "ros.d", "ros.d must be an array of numbers, not %s",
                              spl_json_type_name(d));
    for (int i = 0; name && i < 3; i++)
        found = !strcmp(name, models[i].name) ? i : found;
    if (!name || (*name && found < 0))
        return spl_fail_field(err, SPL_E_INPUT, "ros.distortion_model",
                              "ros.distortion_model must be plumb_bob, rational_polynomial or equidistant, not %.32s; "
                              "rectify the image and give p alone",
                              name ? name : spl_json_type_name(model));
    bool bends = found == 2 && (given || json_object_get(json, "k"));
    for (size_t i = 0; i < given; i++) {
        const json_t *number = json_array_get(d, i);
        if (!json_is_number(number))
            return spl_fail_field(err, SPL_E_INPUT, "ros.d", "number %zu of ros.d is %s", i + 1,
                                  spl_json_type_name(number));
        bends = bends || json_number_value(number) != 0;
        if (i < 8)
            bend[i] = json_number_value(number);
    }
    if (!bends)
        return 0;
    if (found < 0)
        return spl_fail_field(
            err, SPL_E_INPUT, "ros.distortion_model",
            "ros.d bends, and ros.distortion_model is missing: plumb_bob, rational_polynomial or equidistant");
    if (given < models[found].least || given > models[found].most)
        return spl_fail_field(err, SPL_E_INPUT, "ros.d", "ros.d has %zu numbers; %s has %zu", given, name,
                              models[found].most);
    *count = (unsigned)given;
    *fisheye = found == 2;
    return 0;
}

int spl_form_read_ros(const json_t *json, struct spl_value *values, struct spl_error *err)
{
    static const char *const known[] = {"k", "p", "d", "distortion_model", "width", "height", NULL};
    double size[2] = {0}, k[4] = {0}, p[4] = {0}, bend[8] = {0};
    bool raw = json_object_get(json, "k"), rectified = json_object_get(json, "p"), fisheye = false;
    unsigned bends = 0;
    int rc;
    if ((rc = spl_form_check(json, "ros", known, err)) ||
        (rc = read_ros_distortion(json, bend, &bends, &fisheye, err)) ||
        (rc = spl_json_get_number(json, "ros.width", &size[0], err)) ||
        (rc = spl_json_get_number(json, "ros.height", &size[1], err)))
        return rc;
    if (!raw && !rectified)
        return spl_fail_field(err, SPL_E_INPUT, "ros.k", "ros has neither k nor p, so no focal length");
    if ((raw && (rc = read_ros_matrix(json, "ros.k", 3, k, err))) ||
        (rectified && (rc = read_ros_matrix(json, "ros.p", 4, p, err))))
        return rc;
    for (int i = 0; raw && rectified && i < 4; i++)
        if (k[i] != p[i])
            return spl_fail_field(err, SPL_E_INPUT, "ros.p",
                                  "ros.k and ros.p are two cameras; give k for the raw image or p for the rectified");
    for (int i = 0; i < 2; i++) {
        enum spl_camera_param side = i ? SPL_CAMERA_height : SPL_CAMERA_width;
        const char *name = i ? "ros.height" : "ros.width";
        if ((rc = spl_form_set_number(values, side, name, size[i], err)) ||
            (rc = spl_value_check(&values[side], SPL_KIND_COUNT, name, err)))
            return rc;
    }
    if (!bends)
        return spl_form_set_lens(values, raw ? "ros.k" : "ros.p", raw ? k : p, err);
    if (rectified)
        return spl_fail_field(err, SPL_E_INPUT, "ros.p",
                              "ros.p is the rectified image, which ros.d does not bend: give k and d, or p alone");
    return spl_form_set_bent_lens(values, "ros.d", k, bend, fisheye, err);
}
