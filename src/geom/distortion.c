/* Points through distorted lenses: world to pixel, which needs no inverse, and back, by Newton's steps.
 *
 * A polynomial fits inside of the image only. Further out it may fold back, so that points far outside of the view land
 * in the image again; `reach` is where the radius stops growing, found by walking outwards. Tangential terms are small
 * beside the radial ones and do not enter it. Pure functions; any thread. */
#include "geom/distortion.h"

#include <math.h>
#include <string.h>

#include "base/error.h"

static const double radial_reach = 20, fisheye_reach = 1.55; /* tan of 87 degrees; a view depth above 0 */
enum { reach_steps = 2000, tangential_rounds = 24 };

bool spl_distortion_is_same(const struct spl_distortion *a, const struct spl_distortion *b)
{
    return a->kind == b->kind && !memcmp(a->k, b->k, sizeof a->k) && !memcmp(a->p, b->p, sizeof a->p) &&
           !memcmp(&a->reach, &b->reach, sizeof a->reach);
}

double spl_distortion_get_image(const struct spl_distortion *d, double r, double *growth)
{
    const double *k = d->k, s = r * r;
    if (d->kind == SPL_DISTORTION_NONE) {
        *growth = 1;
        return r;
    }
    if (d->kind == SPL_DISTORTION_FISHEYE) {
        *growth = 1 + s * (3 * k[0] + s * (5 * k[1] + s * (7 * k[2] + s * 9 * k[3])));
        return r * (1 + s * (k[0] + s * (k[1] + s * (k[2] + s * k[3]))));
    }
    double above = 1 + s * (k[0] + s * (k[1] + s * k[2])), below = 1 + s * (k[3] + s * (k[4] + s * k[5]));
    double up = 2 * s * (k[0] + s * (2 * k[1] + s * 3 * k[2])), down = 2 * s * (k[3] + s * (2 * k[4] + s * 3 * k[5]));
    *growth = (above + up - above * down / below) / below;
    return r * above / below;
}

static double image_of(const struct spl_distortion *d, double r)
{
    return spl_distortion_get_image(d, r, &(double){0});
}

/* No lens, or a fisheye's polynomial of terms that all grow. */
static bool grows_for_certain(const struct spl_distortion *d)
{
    for (int i = 0; i < 4; i++)
        if (d->kind == SPL_DISTORTION_FISHEYE && !(d->k[i] >= 0))
            return false;
    return d->kind != SPL_DISTORTION_RADIAL;
}

static void find_reach(struct spl_distortion *d, double most)
{
    double last = 0;
    d->reach = 0;
    if (grows_for_certain(d)) {
        d->reach = most;
        return;
    }
    for (int i = 1; i <= reach_steps; i++) {
        double r = most * i / reach_steps, image = image_of(d, r);
        if (!(image > last))
            break;
        d->reach = r;
        last = image;
    }
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
    find_reach(d, d->kind == SPL_DISTORTION_FISHEYE ? fisheye_reach : radial_reach);
    return d->reach > 0 ? SPL_OK
                        : spl_fail_field(err, SPL_E_INPUT, "params",
                                         "params has distortion coefficients that fold the middle of the image");
}

void spl_distortion_widen(struct spl_distortion *d)
{
    find_reach(d, d->kind == SPL_DISTORTION_FISHEYE ? M_PI : radial_reach);
}

/* The r, or the angle, whose image has the radius `image`, from a guess. Newton's steps, halving where they would leave
 * what is known to hold it. */
static double find_radius(const struct spl_distortion *d, double image, double guess)
{
    double low = 0, high = d->reach, r = fmin(guess, d->reach), growth;
    if (d->kind == SPL_DISTORTION_NONE || image_of(d, high) <= image)
        return d->kind == SPL_DISTORTION_NONE ? image : high;
    for (int i = 0; i < 60; i++) {
        double off = spl_distortion_get_image(d, r, &growth) - image;
        *(off < 0 ? &low : &high) = r;
        double next = r - off / growth;
        if (!(next > low && next < high))
            next = (low + high) / 2;
        if (off == 0 || fabs(next - r) <= 1e-15 * r)
            break;
        r = next;
    }
    return r;
}

double spl_distortion_invert(const struct spl_distortion *d, double image)
{
    double r = find_radius(d, image, image);
    return d->kind == SPL_DISTORTION_FISHEYE ? tan(r) : r;
}

static void set_tangential(const struct spl_distortion *d, double x, double y, double out[2])
{
    const double s = x * x + y * y;
    out[0] = 2 * d->p[0] * x * y + d->p[1] * (s + 2 * x * x);
    out[1] = 2 * d->p[1] * x * y + d->p[0] * (s + 2 * y * y);
}

bool spl_distortion_get_ray(const struct spl_distortion *d, const double m[2], double ray[3])
{
    double straight[2] = {m[0], m[1]}, bent[2] = {0}, radius = 0, scale = 1;
    const bool tangential = d->kind == SPL_DISTORTION_RADIAL && (d->p[0] != 0 || d->p[1] != 0);
    for (int i = 0;; i++) { /* what is tangential is small: each round leaves a hundredth of the error, say */
        double r = hypot(straight[0], straight[1]), before[2] = {bent[0], bent[1]};
        radius = find_radius(d, r, i ? radius : r);
        scale = r > 1e-12 ? radius / r : 1;
        if (d->kind != SPL_DISTORTION_NONE && radius >= d->reach && r > image_of(d, d->reach) * (1 + 1e-12))
            return false;
        if (!tangential)
            break;
        set_tangential(d, straight[0] * scale, straight[1] * scale, bent);
        const double moved = hypot(bent[0] - before[0], bent[1] - before[1]);
        if (moved < 1e-14)
            break;
        if (i == tangential_rounds)
            return false;
        straight[0] = m[0] - bent[0];
        straight[1] = m[1] - bent[1];
    }
    double z = 1;
    if (d->kind == SPL_DISTORTION_FISHEYE) {
        scale = radius > 1e-12 ? sin(radius) / radius * scale : 1;
        z = cos(radius);
    }
    const double x = straight[0] * scale, y = straight[1] * scale, length = sqrt(x * x + y * y + z * z);
    ray[0] = x / length;
    ray[1] = y / length;
    ray[2] = z / length;
    return true;
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
        double scale = r > 1e-9 ? image_of(d, reached) / r : 1, bent[2];
        set_tangential(d, x, y, bent);
        out[0] = x * scale + bent[0];
        out[1] = y * scale + bent[1];
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
