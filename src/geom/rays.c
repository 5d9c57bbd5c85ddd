/* Cameras that see further around than a pinhole, or through a lens: where their rays go, where points have an image,
 * and what is asked of their numbers. Pure functions; any thread. */
#include "geom/faces.h"

#include <math.h>

#include "base/error.h"
#include "geom/distortion.h"

static const double pixels_most = 1e9; /* of a focal length, and to the principal point */
static const double tangential_most = 0.1; /* of lenses that are; beyond, what bends has no inverse */

bool spl_camera_is_bent(const struct spl_camera *camera)
{
    return camera->projection > SPL_ORTHOGRAPHIC || camera->lens.kind != SPL_DISTORTION_NONE;
}

static int check_size(uint32_t width, uint32_t height, struct spl_error *err)
{
    if (width && height)
        return SPL_OK;
    return spl_fail_field(err, SPL_E_INPUT, width ? "height" : "width", "an image needs at least one pixel of %s",
                          width ? "height" : "width");
}

int spl_camera_set_around(struct spl_camera *camera, enum spl_projection projection, uint32_t width, uint32_t height,
                          struct spl_error *err)
{
    const bool cube = projection == SPL_CUBE;
    int rc = check_size(width, height, err);
    if (rc)
        return rc;
    if (!cube && projection != SPL_EQUIRECTANGULAR)
        return spl_fail_field(err, SPL_E_USAGE, "projection", "projection %s does not see all around",
                              spl_projection_name(projection));
    camera->projection = projection;
    camera->lens = (struct spl_distortion){0};
    camera->width = width;
    camera->height = height;
    camera->cx = cube ? height / 2.0 : width / 2.0;
    camera->cy = height / 2.0;
    camera->fx = cube ? height / 2.0 : width / (2 * M_PI);
    camera->fy = cube ? height / 2.0 : height / M_PI;
    return spl_camera_check_bent(camera, err);
}

int spl_camera_set_fisheye(struct spl_camera *camera, double fov_degrees, uint32_t width, uint32_t height,
                           struct spl_error *err)
{
    if (!(fov_degrees > 0 && fov_degrees <= 360))
        return spl_fail_field(err, SPL_E_INPUT, "fov",
                              "a fisheye's field of view must be above 0, up to 360 degrees, not %g", fov_degrees);
    int rc = check_size(width, height, err);
    if (rc)
        return rc;
    camera->projection = SPL_FISHEYE;
    camera->lens = (struct spl_distortion){.kind = SPL_DISTORTION_FISHEYE, .reach = fov_degrees * M_PI / 360};
    camera->width = width;
    camera->height = height;
    camera->cx = width / 2.0;
    camera->cy = height / 2.0;
    camera->fx = camera->fy = height / (fov_degrees * M_PI / 180);
    return SPL_OK;
}

int spl_camera_set_lens(struct spl_camera *camera, const struct spl_distortion *lens, struct spl_error *err)
{
    struct spl_distortion own = *lens;
    int rc = spl_distortion_init(&own, err);
    if (rc)
        return rc;
    spl_distortion_widen(&own);
    if (own.kind == SPL_DISTORTION_NONE)
        own = (struct spl_distortion){0};
    camera->projection = own.kind == SPL_DISTORTION_FISHEYE ? SPL_FISHEYE : SPL_PERSPECTIVE;
    camera->lens = own;
    return spl_camera_check_bent(camera, err);
}

int spl_camera_check_bent(const struct spl_camera *camera, struct spl_error *err)
{
    const struct {
        const char *field;
        double pixels;
    } far[] = {{"fx", camera->fx}, {"fy", camera->fy}, {"cx", camera->cx}, {"cy", camera->cy}};
    for (int i = 0; i < 4; i++) /* farther out pixels of the faces cannot be told apart */
        if (!(fabs(far[i].pixels) <= pixels_most))
            return spl_fail_field(err, SPL_E_INPUT, far[i].field, "%s %g is not within %g pixels", far[i].field,
                                  far[i].pixels, pixels_most);
    const struct spl_distortion *lens = &camera->lens;
    const bool fisheye = camera->projection == SPL_FISHEYE;
    if (camera->projection == SPL_CUBE) {
        const double half = camera->height / 2.0;
        if (camera->width != 6 * (uint64_t)camera->height || camera->fx != half || camera->fy != half ||
            camera->cx != half || camera->cy != half)
            return spl_fail_field(
                err, SPL_E_INPUT, "width",
                "the six faces of a cube lie side by side, each as wide as high: %u is not six times %u", camera->width,
                camera->height);
    }
    if (lens->kind != (fisheye ? SPL_DISTORTION_FISHEYE : SPL_DISTORTION_NONE) &&
        !(camera->projection == SPL_PERSPECTIVE && lens->kind == SPL_DISTORTION_RADIAL))
        return spl_fail_field(err, SPL_E_USAGE, "projection", "projection %s and lens %d do not go together",
                              spl_projection_name(camera->projection), (int)lens->kind);
    for (int i = 0; i < 2; i++)
        if (fabs(lens->p[i]) > tangential_most)
            return spl_fail_field(err, SPL_E_INPUT, "params",
                                  "the lens has the tangential coefficient %g; at most %g is drawn", lens->p[i],
                                  tangential_most);
    for (int i = 0; i < 8; i++)
        if (!isfinite(i < 6 ? lens->k[i] : lens->p[i - 6]) || (i >= 6 && fisheye && lens->p[i - 6] != 0))
            return spl_fail_field(err, SPL_E_INPUT, "params", "the lens has the %s coefficient %g",
                                  i < 6 ? "distortion" : "tangential", i < 6 ? lens->k[i] : lens->p[i - 6]);
    if (lens->kind != SPL_DISTORTION_NONE && !(lens->reach > 0 && lens->reach <= (fisheye ? M_PI : 1e3)))
        return spl_fail_field(err, SPL_E_INPUT, "params", "the lens reaches up to %g", lens->reach);
    return SPL_OK;
}

/* Of the face that holds column u. */
static uint32_t face_at(const struct spl_camera *camera, double u)
{
    return (uint32_t)fmin(fmax(floor(u / camera->height), 0), SPL_FACES - 1);
}

bool spl_camera_get_ray(const struct spl_camera *camera, double u, double v, double ray[3])
{
    const uint32_t face = camera->projection == SPL_CUBE ? face_at(camera, u) : 0;
    const double x = (u - (double)face * camera->height - camera->cx) / camera->fx, y = (v - camera->cy) / camera->fy;
    if (camera->projection == SPL_RAYS)
        return false;
    if (camera->projection == SPL_ORTHOGRAPHIC) {
        ray[0] = ray[1] = 0;
        ray[2] = 1;
        return true;
    }
    if (camera->projection == SPL_EQUIRECTANGULAR) {
        if (!(fabs(y) <= M_PI_2 * (1 + 1e-9)))
            return false;
        ray[0] = sin(x) * cos(y);
        ray[1] = sin(y);
        ray[2] = cos(x) * cos(y);
        return true;
    }
    double own[3];
    if (!spl_distortion_get_ray(&camera->lens, (double[]){x, y}, camera->projection == SPL_CUBE ? own : ray))
        return false;
    for (int i = 0; camera->projection == SPL_CUBE && i < 3; i++)
        ray[i] =
            spl_face_axes[face][i] * own[0] + spl_face_axes[face][3 + i] * own[1] + spl_face_axes[face][6 + i] * own[2];
    return true;
}

bool spl_camera_place(const struct spl_camera *camera, const double c[3], double pixel[2])
{
    const double beside = c[0] * c[0] + c[1] * c[1];
    if (!(beside + c[2] * c[2] > 0) || camera->projection == SPL_RAYS)
        return false;
    if (camera->projection == SPL_EQUIRECTANGULAR) {
        const double turn = 2 * M_PI * camera->fx, u = camera->cx + camera->fx * atan2(c[0], c[2]);
        pixel[0] = u - rint((u - camera->width / 2.0) / turn) * turn;
        pixel[1] = camera->cy + camera->fy * atan2(c[1], hypot(c[0], c[2]));
        return true;
    }
    if (camera->projection == SPL_CUBE) {
        double place[2];
        const unsigned face = spl_face_of(c, place);
        pixel[0] = (double)face * camera->height + camera->cx + camera->fx * place[0];
        pixel[1] = camera->cy + camera->fy * place[1];
        return true;
    }
    if (camera->projection != SPL_FISHEYE)
        return spl_distortion_place(camera, &camera->lens, c, pixel);
    const double flat = sqrt(beside), angle = atan2(flat, c[2]);
    if (!(angle <= camera->lens.reach))
        return false;
    const double scale = flat > 0 ? spl_distortion_get_image(&camera->lens, angle, &(double){0}) / flat : 0;
    pixel[0] = camera->cx + camera->fx * c[0] * scale;
    pixel[1] = camera->cy + camera->fy * c[1] * scale;
    return true;
}
