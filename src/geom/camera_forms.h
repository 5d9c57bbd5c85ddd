/* What the forms have in common that other programs write cameras in (camera_forms.c): members that are checked, and
 * values that remember which member said them. Pure functions, any thread. */
#ifndef SPL_GEOM_CAMERA_FORMS_H
#define SPL_GEOM_CAMERA_FORMS_H

#include "geom/camera_json.h"

/* The member that stands behind the last dot of `path`. */
const json_t *spl_form_get(const json_t *object, const char *path);

/* Is it an object of `known` members (ends in NULL) alone? */
int spl_form_check(const json_t *object, const char *path, const char *const *known, struct spl_error *err);

/* Claims a value for `source`, a literal. */
int spl_form_set_number(struct spl_value *values, enum spl_camera_param param, const char *source, double number,
                        struct spl_error *err);

/* fx, fy, cx, cy; with coefficients in COLMAP's order: of OPENCV_FISHEYE four, else of FULL_OPENCV eight. */
int spl_form_set_lens(struct spl_value *values, const char *source, const double lens[4], struct spl_error *err);
int spl_form_set_bent_lens(struct spl_value *values, const char *source, const double lens[4], const double bend[8],
                           bool fisheye, struct spl_error *err);

/* A row-major matrix, camera to world. */
int spl_form_set_pose(struct spl_value *values, const char *source, const double matrix[16], enum spl_axes axes,
                      struct spl_error *err);

/* camera_ros.c, camera_nerfstudio.c */
int spl_form_read_ros(const json_t *json, struct spl_value *values, struct spl_error *err);
int spl_form_read_nerfstudio(const json_t *json, struct spl_value *values, struct spl_error *err);

#endif
