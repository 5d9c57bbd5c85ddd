/* What real lenses add to a pinhole: OpenCV's polynomials, which COLMAP and nerfstudio write too. Nothing is drawn with
 * them; photographs are sampled through them. Pure functions; any thread. */
#ifndef SPL_GEOM_DISTORTION_H
#define SPL_GEOM_DISTORTION_H

#include <splatd/camera.h>

enum spl_distortion_kind {
    SPL_DISTORTION_NONE,
    SPL_DISTORTION_RADIAL,  /* (1 + k0 r^2 + k1 r^4 + k2 r^6) / (1 + k3 r^2 + k4 r^4 + k5 r^6), and the tangential p */
    SPL_DISTORTION_FISHEYE, /* equidistant: a (1 + k0 a^2 + k1 a^4 + k2 a^6 + k3 a^8), a = angle off the axis */
};

struct spl_distortion {
    enum spl_distortion_kind kind;
    double k[6], p[2];
    double reach; /* r (fisheye: a) up to which the image of r grows; what lies further out has no image */
};

/* Sets `reach` from the rest. A RADIAL one whose coefficients are all 0 becomes NONE. Refuses coefficients that are not
 * finite, and those that turn the middle of the image inside out (field "params"). */
int spl_distortion_init(struct spl_distortion *distortion, struct spl_error *err);

/* The same of a point in the camera's frame (x right, y down, z forward). */
bool spl_distortion_place(const struct spl_camera *camera, const struct spl_distortion *distortion, const double c[3],
                          double pixel[2]);

/* The r (tangent of the angle off the axis) whose image has the radius `image`; that of `reach` for those beyond.
 * Without the tangential terms. */
double spl_distortion_invert(const struct spl_distortion *distortion, double image);

/* As spl_camera_project(), through the lens. False also for points beyond `reach`. */
bool spl_distortion_project(const struct spl_camera *camera, const struct spl_distortion *distortion, const double p[3],
                            double pixel[2], double *depth);

#endif
