/* What real lenses add to a pinhole (struct spl_distortion), both ways. Photographs are sampled through lenses, and
 * views drawn through them. Pure functions; any thread. */
#ifndef SPL_GEOM_DISTORTION_H
#define SPL_GEOM_DISTORTION_H

#include <splatd/camera.h>

/* Sets `reach` from the rest. A RADIAL one whose coefficients are all 0 becomes NONE. Refuses coefficients that are not
 * finite, and those that turn the middle of the image inside out (field "params"). */
int spl_distortion_init(struct spl_distortion *distortion, struct spl_error *err);

/* `reach` anew for views, whose fisheyes see behind them: up to half a turn off the axis. */
void spl_distortion_widen(struct spl_distortion *distortion);

/* To the bit. */
bool spl_distortion_is_same(const struct spl_distortion *a, const struct spl_distortion *b);

/* The radius of the image of r (fisheye: of the angle a), and how fast it grows. Without the tangential terms. */
double spl_distortion_get_image(const struct spl_distortion *distortion, double r, double *growth);

/* The ray, unit, in the camera's frame, whose image is at m: offsets from the principal point over focal lengths. False
 * beyond `reach`. */
bool spl_distortion_get_ray(const struct spl_distortion *distortion, const double m[2], double ray[3]);

/* As spl_distortion_project() of a point in the camera's frame (x right, y down, z forward). */
bool spl_distortion_place(const struct spl_camera *camera, const struct spl_distortion *distortion, const double c[3],
                          double pixel[2]);

/* The r (tangent of the angle off the axis) whose image has the radius `image`; that of `reach` for those beyond.
 * Without the tangential terms. */
double spl_distortion_invert(const struct spl_distortion *distortion, double image);

/* As spl_camera_project(), through the lens. False also for points beyond `reach`. */
bool spl_distortion_project(const struct spl_camera *camera, const struct spl_distortion *distortion, const double p[3],
                            double pixel[2], double *depth);

#endif
