/* Points through distorted lenses, the way that needs no inverse: world to pixel.
 *
 * A polynomial fits inside of the image only. Further out it may fold back, so that points far outside of the view land
 * in the image again; `reach` is where the radius stops growing, found by walking outwards. Tangential terms are small
 * beside the radial ones and do not enter it. Pure functions; any thread. */
#include "geom/distortion.h"

#include <math.h>

#include "base/error.h"

static const double radial_reach = 20, fisheye_reach = 1.55; /* tan of 87 degrees; a view depth above 0 */
enum { reach_steps = 2000 };

/* The image's radius of r, or of the angle a. */
static double image_of(const struct spl_distortion *d, double r)
{
    const double *k = d->k;
    double s = r * r;
    if (d->kind == SPL_DISTORTION_FISHEYE)
        return r * (1 + s * (k[0] + s * (k[1] + s * (k[2] + s * k[3]))));
    return r * (1 + s * (k[0] + s * (k[1] + s * k[2]))) / (1 + s * (k[3] + s * (k[4] + s * k[5])));
}

int spl_distortion_init(struct spl_distortion *d, struct spl_error *err)
{
    bool none = d->kind != SPL_DISTORTION_FISHEYE;
    for (int i = 0; i < 8; i++) {
        double value = i < 6 ? d->k[i] : d->p[i - 6];
        if (!isfinite(value))
            return spl_fail_field(err, SPL_E_INPUT, "params", "params has the distortion coefficient %g", value);
        none = none && value == 0;
    }
    if (none)
        d->kind = SPL_DISTORTION_NONE;
    double most = d->kind == SPL_DISTORTION_FISHEYE ? fisheye_reach : radial_reach, last = 0;
    d->reach = 0;
    for (int i = 1; i <= reach_steps; i++) {
        double r = most * i / reach_steps, image = image_of(d, r);
        if (!(image > last))
            break;
        d->reach = r;
        last = image;
    }
    return d->reach > 0 ? SPL_OK
                        : spl_fail_field(err, SPL_E_INPUT, "params",
                                         "params has distortion coefficients that fold the middle of the image");
}

double spl_distortion_invert(const struct spl_distortion *d, double image)
{
    double low = 0, high = d->reach;
    for (int i = 0; i < 60; i++) {
        double middle = (low + high) / 2;
        *(image_of(d, middle) < image ? &low : &high) = middle;
    }
    return d->kind == SPL_DISTORTION_FISHEYE ? tan(low) : low;
}

bool spl_distortion_place(const struct spl_camera *camera, const struct spl_distortion *d, const double c[3],
                          double pixel[2])
{
    if (!(c[2] > 0))
        return false;
    double x = c[0] / c[2], y = c[1] / c[2], out[2] = {x, y};
    if (d->kind != SPL_DISTORTION_NONE) {
        double s = x * x + y * y, r = sqrt(s), reached = d->kind == SPL_DISTORTION_FISHEYE ? atan(r) : r;
        if (!(reached <= d->reach))
            return false;
        double scale = r > 1e-9 ? image_of(d, reached) / r : 1;
        out[0] = x * scale + 2 * d->p[0] * x * y + d->p[1] * (s + 2 * x * x);
        out[1] = y * scale + 2 * d->p[1] * x * y + d->p[0] * (s + 2 * y * y);
    }
    pixel[0] = camera->fx * out[0] + camera->cx;
    pixel[1] = camera->fy * out[1] + camera->cy;
    return true;
}

bool spl_distortion_project(const struct spl_camera *camera, const struct spl_distortion *d, const double p[3],
                            double pixel[2], double *depth)
{
    const double *m = camera->rotation, q[3] = {p[0] - camera->eye[0], p[1] - camera->eye[1], p[2] - camera->eye[2]};
    double c[3];
    for (int i = 0; i < 3; i++)
        c[i] = m[3 * i] * q[0] + m[3 * i + 1] * q[1] + m[3 * i + 2] * q[2];
    if (!spl_distortion_place(camera, d, c, pixel))
        return false;
    *depth = c[2];
    return true;
}
