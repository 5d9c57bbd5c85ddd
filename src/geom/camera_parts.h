/* What the files have in common that make a camera of values (camera_values.c), each by what it needs of them: pose,
 * scanner's rays. Pure functions, any thread. */
#ifndef SPL_GEOM_CAMERA_PARTS_H
#define SPL_GEOM_CAMERA_PARTS_H

#include "geom/camera_json.h"

extern const char *const spl_camera_param_names[SPL_CAMERA_PARAMS];

static inline bool given(const struct spl_value *v, enum spl_camera_param param)
{
    return v[param].given;
}

static inline double get(const struct spl_value *v, enum spl_camera_param param, double otherwise)
{
    return v[param].given ? v[param].n[0] : otherwise;
}

/* Is the view one of parallel rays? A size of one that is said is enough. */
static inline bool is_orthographic(const struct spl_value *v)
{
    return given(v, SPL_CAMERA_projection)
               ? v[SPL_CAMERA_projection].n[0] == SPL_ORTHOGRAPHIC
               : given(v, SPL_CAMERA_view_height) || given(v, SPL_CAMERA_units_per_pixel);
}

static inline bool is_around(const struct spl_value *v)
{
    const double projection = v[SPL_CAMERA_projection].n[0];
    return given(v, SPL_CAMERA_projection) &&
           (projection == SPL_EQUIRECTANGULAR || projection == SPL_CUBE || projection == SPL_RAYS);
}

/* Two that are given and exclude each other; one that is not, and needed. SPL_E_INPUT. */
int spl_camera_conflict(const struct spl_value *v, enum spl_camera_param param, enum spl_camera_param with,
                        struct spl_error *err);
int spl_camera_missing(enum spl_camera_param param, enum spl_camera_param because, struct spl_error *err);

/* camera_scan.c: views of all directions. */
static inline bool is_scan(const struct spl_value *v)
{
    return given(v, SPL_CAMERA_azimuth) || given(v, SPL_CAMERA_elevation);
}
int spl_camera_take_scan(const struct spl_value *v, struct spl_value own[SPL_CAMERA_PARAMS], struct spl_error *err);
int spl_camera_resolve_around(const struct spl_value *v, struct spl_camera *camera, struct spl_error *err);

/* camera_pose.c. *distance: from the eye to what it looks at, 0 where the pose does not say. */
int spl_camera_resolve_pose(const struct spl_value *v, const struct spl_camera_defaults *defaults,
                            struct spl_camera *camera, double *distance, struct spl_error *err);

#endif
