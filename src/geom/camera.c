/* Pinhole and orthographic cameras from look-at, matrix and COLMAP form, and the projection they mean.
 *
 * Everything is double and relative to the eye: at UTM coordinates the subtraction p - eye is exact, so a distant
 * origin costs no accuracy. Poses are stored as a rotation that is orthonormal to rounding, whatever precision it came
 * in. Pure functions; any thread. */
#include <splatd/camera.h>

#include <math.h>
#include <string.h>

#include "base/error.h"
#include "geom/faces.h"
#include "geom/size.h"
#include "geom/vector.h"

static const double coordinate_max = SPL_CAMERA_COORDINATE_MAX;
/* An orthographic image is so high at least: below, doubles of coordinates in kilometres end. */
static const double view_height_min = 1e-9;
/* Sine of the angle between view and up below which the image's upright is arbitrary (0.06 millidegrees). */
static const double parallel_sine = 1e-6;
/* What matrices written with few digits, or as floats, are off by. */
static const double matrix_tolerance = 1e-3, stored_tolerance = 1e-9;

/* Scales to unit length without over- or underflow; false for the zero vector. */
static bool normalize(double *v, int n)
{
    double largest = 0, sum = 0;
    for (int i = 0; i < n; i++)
        largest = fmax(largest, fabs(v[i]));
    if (largest == 0)
        return false;
    for (int i = 0; i < n; i++) {
        v[i] /= largest;
        sum += v[i] * v[i];
    }
    for (int i = 0; i < n; i++)
        v[i] /= sqrt(sum);
    return true;
}

static int check_finite(const double *v, int n, const char *field, struct spl_error *err)
{
    for (int i = 0; i < n; i++)
        if (!isfinite(v[i]))
            return spl_fail_field(err, SPL_E_INPUT, field, "number %d of %s, %g, is not finite", i + 1, field, v[i]);
    return SPL_OK;
}

static int check_place(const double v[3], const char *field, struct spl_error *err)
{
    int rc = check_finite(v, 3, field, err);
    for (int i = 0; !rc && i < 3; i++)
        if (fabs(v[i]) > coordinate_max)
            rc = spl_fail_field(err, SPL_E_INPUT, field, "coordinate %d of %s is %g; at most %g is allowed", i + 1,
                                field, v[i], coordinate_max);
    return rc;
}

static const char *const projections[SPL_PROJECTION_COUNT] = {"perspective", "orthographic", "equirectangular", "cube",
                                                               "fisheye", "rays"};

const char *spl_projection_name(enum spl_projection projection)
{
    return (unsigned)projection < SPL_PROJECTION_COUNT ? projections[projection] : "";
}

int spl_projection_from_name(const char *name)
{
    for (int i = 0; i < SPL_RAYS; i++)
        if (!strcmp(name, projections[i]))
            return i;
    return -1;
}

/* The principal point in the middle. */
static void set_centered(struct spl_camera *camera, enum spl_projection projection, double scale, uint32_t width,
                         uint32_t height)
{
    camera->projection = projection;
    camera->fx = camera->fy = scale;
    camera->cx = width / 2.0;
    camera->cy = height / 2.0;
    camera->width = width;
    camera->height = height;
    camera->lens = (struct spl_distortion){0};
}

int spl_camera_set_fov(struct spl_camera *camera, double fov_degrees, uint32_t width, uint32_t height,
                       struct spl_error *err)
{
    if (!(fov_degrees > 0 && fov_degrees <= 179))
        return spl_fail_field(err, SPL_E_INPUT, "fov",
                              "a vertical field of view must be above 0, up to 179 degrees, not %g", fov_degrees);
    if (!width)
        return spl_fail_field(err, SPL_E_INPUT, "width", "an image needs at least one pixel of width");
    if (!height)
        return spl_fail_field(err, SPL_E_INPUT, "height", "an image needs at least one pixel of height");
    double focal = height / (2 * tan(fov_degrees * M_PI / 360));
    if (!isfinite(focal))
        return spl_fail_field(err, SPL_E_INPUT, "fov", "a vertical field of view of %g degrees is too small",
                              fov_degrees);
    set_centered(camera, SPL_PERSPECTIVE, focal, width, height);
    return SPL_OK;
}

int spl_camera_set_orthographic(struct spl_camera *camera, double view_height, uint32_t width, uint32_t height,
                                struct spl_error *err)
{
    if (!(view_height >= view_height_min && view_height <= coordinate_max))
        return spl_fail_field(err, SPL_E_INPUT, "view_height", "a view's height must be within %g and %g, not %g",
                              view_height_min, coordinate_max, view_height);
    if (!width)
        return spl_fail_field(err, SPL_E_INPUT, "width", "an image needs at least one pixel of width");
    if (!height)
        return spl_fail_field(err, SPL_E_INPUT, "height", "an image needs at least one pixel of height");
    set_centered(camera, SPL_ORTHOGRAPHIC, height / view_height, width, height);
    return SPL_OK;
}

int spl_camera_look_at(struct spl_camera *camera, const double eye[3], const double target[3], const double up[3],
                       struct spl_error *err)
{
    int rc = check_place(eye, "eye", err);
    if (!rc)
        rc = check_place(target, "target", err);
    if (!rc)
        rc = check_finite(up, 3, "up", err);
    if (rc)
        return rc;
    double forward[3] = {target[0] - eye[0], target[1] - eye[1], target[2] - eye[2]};
    double upward[3] = {up[0], up[1], up[2]};
    if (!normalize(forward, 3))
        return spl_fail_field(err, SPL_E_INPUT, "target", "target equals eye, so there is no direction to look in");
    if (!normalize(upward, 3))
        return spl_fail_field(err, SPL_E_INPUT, "up", "up is the zero vector");
    double right[3], down[3];
    cross3(forward, upward, right);
    if (sqrt(dot3(right, right)) < parallel_sine)
        return spl_fail_field(err, SPL_E_INPUT, "up",
                              "up is parallel to the direction of view; give another, such as up=%s",
                              fabs(forward[2]) > 0.5 ? "0,1,0" : "0,0,1");
    normalize(right, 3);
    cross3(forward, right, down);
    memcpy(camera->eye, eye, sizeof camera->eye);
    memcpy(camera->rotation, right, sizeof right);
    memcpy(camera->rotation + 3, down, sizeof down);
    memcpy(camera->rotation + 6, forward, sizeof forward);
    return SPL_OK;
}

/* The largest entry of M M^T - 1, or infinity for a reflection. */
static double rotation_error(const double m[9])
{
    double largest = 0, normal[3];
    for (int i = 0; i < 3; i++)
        for (int j = i; j < 3; j++)
            largest = fmax(largest, fabs(dot3(m + 3 * i, m + 3 * j) - (i == j)));
    cross3(m, m + 3, normal);
    return dot3(normal, m + 6) > 0 ? largest : INFINITY;
}

/* The nearest rotation: Newton's iteration for the polar factor, M <- (M + M^-T) / 2. It squares the error each time,
 * so from 1e-3 four steps reach rounding. */
static void orthonormalize(double m[9])
{
    for (int step = 0; step < 4; step++) {
        double cofactor[9];
        cross3(m + 3, m + 6, cofactor);
        cross3(m + 6, m, cofactor + 3);
        cross3(m, m + 3, cofactor + 6);
        double determinant = dot3(m, cofactor);
        for (int i = 0; i < 9; i++)
            m[i] = (m[i] + cofactor[i] / determinant) / 2;
    }
}

int spl_camera_set_matrix(struct spl_camera *camera, const double camera_to_world[16], enum spl_axes axes,
                          struct spl_error *err)
{
    const double *m = camera_to_world;
    int rc = check_finite(m, 16, "matrix", err);
    if (rc)
        return rc;
    for (int i = 0; i < 4; i++)
        if (fabs(m[12 + i] - (i == 3)) > stored_tolerance)
            return spl_fail_field(err, SPL_E_INPUT, "matrix",
                                  "the last row is %g %g %g %g instead of 0 0 0 1; is the matrix column-major?", m[12],
                                  m[13], m[14], m[15]);
    double eye[3] = {m[3], m[7], m[11]}, rotation[9];
    rc = check_place(eye, "matrix", err);
    if (rc)
        return rc;
    for (int axis = 0; axis < 3; axis++) /* a camera axis is a column of the matrix and a row of R */
        for (int i = 0; i < 3; i++)
            rotation[3 * axis + i] = axes == SPL_AXES_OPENGL && axis ? -m[4 * i + axis] : m[4 * i + axis];
    if (!(rotation_error(rotation) <= matrix_tolerance))
        return spl_fail_field(err, SPL_E_INPUT, "matrix",
                              "the upper left 3x3 block is no rotation within %g (scaled, sheared or mirrored)",
                              matrix_tolerance);
    orthonormalize(rotation);
    memcpy(camera->eye, eye, sizeof eye);
    memcpy(camera->rotation, rotation, sizeof rotation);
    return SPL_OK;
}

int spl_camera_set_colmap(struct spl_camera *camera, const double q[4], const double t[3], struct spl_error *err)
{
    int rc = check_finite(q, 4, "q", err);
    if (!rc)
        rc = check_place(t, "t", err);
    if (rc)
        return rc;
    double unit[4] = {q[0], q[1], q[2], q[3]};
    if (!normalize(unit, 4))
        return spl_fail_field(err, SPL_E_INPUT, "q", "a quaternion of four zeros is no rotation");
    double w = unit[0], x = unit[1], y = unit[2], z = unit[3];
    double rotation[9] = {
        1 - 2 * (y * y + z * z), 2 * (x * y - w * z),     2 * (x * z + w * y),
        2 * (x * y + w * z),     1 - 2 * (x * x + z * z), 2 * (y * z - w * x),
        2 * (x * z - w * y),     2 * (y * z + w * x),     1 - 2 * (x * x + y * y),
    };
    memcpy(camera->rotation, rotation, sizeof rotation);
    for (int i = 0; i < 3; i++)
        camera->eye[i] = -(rotation[i] * t[0] + rotation[3 + i] * t[1] + rotation[6 + i] * t[2]);
    return SPL_OK;
}

static int check_focal(enum spl_projection projection, double focal, const char *field, struct spl_error *err)
{
    if (projection == SPL_ORTHOGRAPHIC && focal > 0 && !(focal >= 1e-12 && focal <= 1e14))
        return spl_fail_field(err, SPL_E_INPUT, field, "%g pixels a unit are not within 1e-12 and 1e14", focal);
    const bool reverses = projection == SPL_EQUIRECTANGULAR; // which may go the other way
    if (isfinite(focal) && (focal > 0 || (reverses && focal < 0)))
        return SPL_OK;
    if (projection == SPL_ORTHOGRAPHIC)
        return spl_fail_field(err, SPL_E_INPUT, field, "%g pixels a unit are not a positive number", focal);
    return spl_fail_field(err, SPL_E_INPUT, field, "a focal length of %g pixels is not a positive number", focal);
}

int spl_camera_check(const struct spl_camera *camera, struct spl_error *err)
{
    int rc = check_place(camera->eye, "eye", err);
    if (!rc)
        rc = check_finite(camera->rotation, 9, "rotation", err);
    if (!rc && !(rotation_error(camera->rotation) <= stored_tolerance))
        rc = spl_fail_field(err, SPL_E_INPUT, "rotation", "the rotation is not orthonormal with determinant +1");
    if (!rc)
        rc = check_focal(camera->projection, camera->fx, "fx", err);
    if (!rc)
        rc = check_focal(camera->projection, camera->fy, "fy", err);
    if (!rc)
        rc = check_finite(&camera->cx, 1, "cx", err);
    if (!rc)
        rc = check_finite(&camera->cy, 1, "cy", err);
    if (!rc && (unsigned)camera->projection >= SPL_PROJECTION_COUNT)
        rc = spl_fail_field(err, SPL_E_USAGE, "projection", "projection %d does not exist", (int)camera->projection);
    if (rc)
        return rc;
    if (!camera->width || !camera->height)
        return spl_fail_field(err, SPL_E_INPUT, camera->width ? "height" : "width",
                              "an image of %u x %u pixels is empty", camera->width, camera->height);
    if (spl_camera_is_bent(camera) && (rc = spl_camera_check_bent(camera, err)))
        return rc;
    bool from_eye = camera->projection == SPL_ORTHOGRAPHIC && camera->near == 0; /* nothing is divided by depth */
    if (!(isfinite(camera->near) && camera->near > 0) && !from_eye)
        return spl_fail_field(err, SPL_E_INPUT, "near", "a near depth of %g is not a positive number", camera->near);
    if (!(camera->far > camera->near))
        return spl_fail_field(err, SPL_E_INPUT, "far", "a far depth of %g does not lie behind near, %g", camera->far,
                              camera->near);
    return SPL_OK;
}

bool spl_camera_project(const struct spl_camera *camera, const double p[3], double pixel[2], double *depth)
{
    const double *r = camera->rotation;
    double ray[3] = {p[0] - camera->eye[0], p[1] - camera->eye[1], p[2] - camera->eye[2]};
    double z = dot3(r + 6, ray);
    if (spl_camera_is_bent(camera)) {
        const double c[3] = {dot3(r, ray), dot3(r + 3, ray), z};
        if (!spl_camera_place(camera, c, pixel))
            return false;
        *depth = sqrt(dot3(ray, ray));
        return true;
    }
    if (!(z > 0))
        return false;
    double scale = camera->projection == SPL_ORTHOGRAPHIC ? 1 : z;
    pixel[0] = camera->fx * dot3(r, ray) / scale + camera->cx;
    pixel[1] = camera->fy * dot3(r + 3, ray) / scale + camera->cy;
    *depth = z;
    return true;
}
