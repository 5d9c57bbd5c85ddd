/* A camera as a frame of nerfstudio's and instant-ngp's transforms.json says it. Pure functions, any thread. */
#include <stdio.h>
#include <string.h>

#include "geom/camera_forms.h"
#include "geom/camera_matrix.h"

static int read_transform(const json_t *json, struct spl_value *values, struct spl_error *err)
{
    static const char name[] = "nerfstudio.transform_matrix";
    double m[16];
    int rc = spl_json_get_matrix(spl_form_get(json, name), name, 4, 4, SPL_ROW_MAJOR, m, err);
    return rc ? rc : spl_form_set_pose(values, name, m, SPL_AXES_OPENGL, err);
}

/* k1 to k4, p1 and p2, in the order of FULL_OPENCV, or of OPENCV_FISHEYE. */
static int read_bend(const json_t *json, bool fisheye, bool pinhole, double bend[8], bool *bends, struct spl_error *err)
{
    static const struct {
        const char *name;
        int radial, fisheye; /* places; -1 = the model has none */
    } names[] = {{"k1", 0, 0}, {"k2", 1, 1}, {"k3", 4, 2}, {"k4", -1, 3}, {"p1", 2, -1}, {"p2", 3, -1}};
    char field[64];
    *bends = fisheye;
    for (int i = 0; i < 6; i++) {
        const int place = fisheye ? names[i].fisheye : names[i].radial;
        double value = 0;
        snprintf(field, sizeof field, "nerfstudio.%s", names[i].name);
        int rc = spl_form_get(json, field) ? spl_json_get_number(json, field, &value, err) : 0;
        if (rc)
            return rc;
        if (value != 0 && (place < 0 || pinhole))
            return spl_fail_field(err, SPL_E_INPUT, field,
                                  "%s must be 0: nerfstudio.camera_model has no such coefficient", field);
        if (place >= 0)
            bend[place] = value;
        *bends = *bends || value != 0;
    }
    return 0;
}

/* A frame with its own lens, as nerfstudio and instant-ngp know it; what stands beside `frames` is copied into it. */
int spl_form_read_nerfstudio(const json_t *json, struct spl_value *values, struct spl_error *err)
{
    static const char *const known[] = {"camera_model", "fl_x", "fl_y", "cx", "cy", "w",  "h",
                                        "k1",           "k2",   "k3",   "k4", "p1", "p2", "transform_matrix",
                                        "file_path",    NULL};
    static const char *const models[] = {"OPENCV", "OPENCV_FISHEYE", "EQUIRECTANGULAR", "PINHOLE", "SIMPLE_PINHOLE"};
    enum { fisheye = 1, around = 2, straight = 3, count = 5 };
    static const struct {
        const char *name;
        enum spl_camera_param param;
        enum spl_value_kind kind;
        bool needed;
    } lens[] = {
        {"nerfstudio.w", SPL_CAMERA_width, SPL_KIND_COUNT, true},
        {"nerfstudio.h", SPL_CAMERA_height, SPL_KIND_COUNT, true},
        {"nerfstudio.fl_x", SPL_CAMERA_fx, SPL_KIND_NUMBER, true},
        {"nerfstudio.fl_y", SPL_CAMERA_fy, SPL_KIND_NUMBER, false},
        {"nerfstudio.cx", SPL_CAMERA_cx, SPL_KIND_NUMBER, false},
        {"nerfstudio.cy", SPL_CAMERA_cy, SPL_KIND_NUMBER, false},
    };
    const json_t *model = json_object_get(json, "camera_model");
    const char *name = model ? json_string_value(model) : models[0];
    double bend[8] = {0};
    bool bends = false;
    int rc = spl_form_check(json, "nerfstudio", known, err), kind = 0;
    if (rc)
        return rc;
    while (name && kind < count && strcmp(name, models[kind]))
        kind++;
    if (!name || kind == count)
        return spl_fail_field(err, SPL_E_INPUT, "nerfstudio.camera_model",
                              "nerfstudio.camera_model must be PINHOLE, SIMPLE_PINHOLE, OPENCV, OPENCV_FISHEYE or "
                              "EQUIRECTANGULAR, not %.32s", name ? name : spl_json_type_name(model));
    if ((rc = read_bend(json, kind == fisheye, kind >= around, bend, &bends, err)))
        return rc;
    struct spl_value own[SPL_CAMERA_PARAMS] = {0};
    for (size_t i = 0; i < (kind == around ? 2 : sizeof lens / sizeof *lens); i++) {
        struct spl_value *to = i < 2 ? values : own;
        double number = 0;
        if (!lens[i].needed && !spl_form_get(json, lens[i].name))
            continue;
        if ((rc = spl_json_get_number(json, lens[i].name, &number, err)) ||
            (rc = spl_form_set_number(to, lens[i].param, lens[i].name, number, err)) ||
            (rc = spl_value_check(&to[lens[i].param], lens[i].kind, lens[i].name, err)))
            return rc;
    }
    const double *fx = own[SPL_CAMERA_fx].n, *fy = own[SPL_CAMERA_fy].n;
    const double straight_lens[4] = {
        *fx, own[SPL_CAMERA_fy].given ? *fy : *fx,
        own[SPL_CAMERA_cx].given ? *own[SPL_CAMERA_cx].n : *values[SPL_CAMERA_width].n / 2,
        own[SPL_CAMERA_cy].given ? *own[SPL_CAMERA_cy].n : *values[SPL_CAMERA_height].n / 2};
    if (kind == around)
        rc = spl_form_set_number(values, SPL_CAMERA_projection, "nerfstudio.camera_model", SPL_EQUIRECTANGULAR, err);
    else if (bends)
        rc = spl_form_set_bent_lens(values, "nerfstudio.k1", straight_lens, bend, kind == fisheye, err);
    for (int i = SPL_CAMERA_fx; !rc && !bends && i <= SPL_CAMERA_cy; i++)
        if (own[i].given)
            rc = spl_form_set_number(values, (enum spl_camera_param)i, own[i].source, own[i].n[0], err);
    return rc ? rc : read_transform(json, values, err);
}
