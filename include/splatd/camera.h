/* A pinhole camera, an orthographic one or one that sees further around than either, and the conventions it can be
 * given in.
 *
 * World coordinates are doubles in the dataset's unit. The camera frame is x right, y down, z forward (COLMAP,
 * OpenCV, ROS); a world point p lands on the pixel
 *     c = R (p - eye),   u = fx c.x / c.z + cx,   v = fy c.y / c.z + cy
 * where the first pixel's centre is (0.5, 0.5). An orthographic camera's rays are parallel to its axis:
 *     u = fx c.x + cx,   v = fy c.y + cy
 * with fx and fy in pixels a unit. An equirectangular one has azimuth (from z towards x) and the angle below the xz
 * plane for c.x / c.z and c.y / c.z, fx and fy pixels a radian; a fisheye the angle off the axis, in the direction of
 * (c.x, c.y), bent by its lens; a cube is six pinholes of 90 degrees side by side; rays are a list. Pure functions; any
 * thread. */
#ifndef SPLATD_CAMERA_H
#define SPLATD_CAMERA_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#include <splatd/api.h>
#include <splatd/error.h>

SPL_BEGIN_DECLARATIONS

enum spl_projection {
    SPL_PERSPECTIVE,
    SPL_ORTHOGRAPHIC,
    SPL_EQUIRECTANGULAR, /* all directions: 2 pi fx = width, pi fy = height, where nothing is cut off; below 0: from the
                            right, from below */
    SPL_CUBE,            /* right, left, up, down, front and back, in this order; each height x height pixels */
    SPL_FISHEYE,         /* equidistant, or as `lens` bends it */
    SPL_RAYS,            /* a list of directions, of spl_view.rays: an image of one column; fx = fy, pixels a radian of
                            what they are looked up in */
    SPL_PROJECTION_COUNT
};
SPL_API const char *spl_projection_name(enum spl_projection projection);
SPL_API int spl_projection_from_name(const char *name); /* -1 for an unknown name, and of rays, which no name makes */

/* What lenses add to a pinhole, or to angles: OpenCV's polynomials, which COLMAP, ROS and nerfstudio write too. */
enum spl_distortion_kind {
    SPL_DISTORTION_NONE,
    SPL_DISTORTION_RADIAL,  /* (1 + k0 r^2 + k1 r^4 + k2 r^6) / (1 + k3 r^2 + k4 r^4 + k5 r^6), and the tangential p */
    SPL_DISTORTION_FISHEYE, /* a (1 + k0 a^2 + k1 a^4 + k2 a^6 + k3 a^8), a = angle off the axis */
};
struct spl_distortion {
    enum spl_distortion_kind kind;
    double k[6], p[2];
    double reach; /* r (fisheye: a) up to which the image of r grows; what lies further out has no image */
};

struct spl_camera {
    double eye[3];           /* world position */
    double rotation[9];      /* R, world -> camera, row-major, orthonormal, determinant +1 */
    double fx, fy, cx, cy;   /* pixels; of orthographic ones fx, fy pixels a unit */
    uint32_t width, height;  /* pixels */
    double near, far;        /* view depths that are drawn, 0 < near < far (near 0 in orthographic views); far may be
                                INFINITY. Of cameras that see around: along the axis of the cube's face that shows it */
    enum spl_projection projection; /* 0 = of a pinhole */
    struct spl_distortion lens;     /* RADIAL of perspective cameras, FISHEYE of fisheyes; zero = none */
};

/* Full pinhole from a vertical field of view: fx = fy, principal point in the middle.
 * fov_degrees in (0, 179]; fields at fault are named "fov", "width", "height". Fills fx fy cx cy width height,
 * projection and lens only: near and far are those of spl_view_init(), 0.01 and INFINITY, or of
 * spl_dataset_get_default_camera(), which fit the dataset. */
SPL_API int spl_camera_set_fov(struct spl_camera *camera, double fov_degrees, uint32_t width, uint32_t height,
                               struct spl_error *err);

/* Orthographic, of an image that is `view_height` units high, principal point in the middle; fields at fault are named
 * "view_height", "width", "height". The same are filled. */
SPL_API int spl_camera_set_orthographic(struct spl_camera *camera, double view_height, uint32_t width, uint32_t height,
                                        struct spl_error *err);

/* All directions around the eye: EQUIRECTANGULAR, of any size, or CUBE, whose width is six times its height; fields
 * "projection", "width", "height". The same are filled. */
SPL_API int spl_camera_set_around(struct spl_camera *camera, enum spl_projection projection, uint32_t width,
                                  uint32_t height, struct spl_error *err);

/* An equidistant fisheye whose circle, of fov_degrees in (0, 360] across, is as high as the image; nothing is outside
 * of it. Fields as of spl_camera_set_fov(). The same are filled. */
SPL_API int spl_camera_set_fisheye(struct spl_camera *camera, double fov_degrees, uint32_t width, uint32_t height,
                                   struct spl_error *err);

/* Directions to look along, in any frame that the camera's rotation goes to; any thread. spl_rays_create() takes count
 * times x, y, z of any length above 0, up to SPL_RAYS_MAX; what is none is refused by its place, counted from 0:
 * SPL_E_INPUT, field "directions". NULL-safe: destroy. */
enum { SPL_RAYS_MAX = 1 << 20 };
struct spl_rays;
SPL_API int spl_rays_create(const double *directions, size_t count, struct spl_rays **out, struct spl_error *err);
SPL_API void spl_rays_destroy(struct spl_rays *rays);

/* RAYS of the list: as many rows as it has directions. `resolution`, pixels a radian, is how finely what they hit is
 * sampled; 0 = as densely as most of them lie, 256 to 1024. Field "resolution". The same are filled; the list itself
 * goes into spl_view.rays. */
SPL_API int spl_camera_set_rays(struct spl_camera *camera, const struct spl_rays *rays, double resolution,
                                struct spl_error *err);

/* Bends a pinhole by a RADIAL lens, and makes a fisheye of one by a FISHEYE lens (fx and fy are then pixels a radian);
 * NONE takes the lens away. Its reach is found here. Field "params". Fills projection and lens only. */
SPL_API int spl_camera_set_lens(struct spl_camera *camera, const struct spl_distortion *lens, struct spl_error *err);

/* Looks from `eye` to `target` with `up` upwards in the image. Errors name "eye", "target", "up": non-finite numbers,
 * eye == target, up zero or parallel to the view. Fills eye and rotation only. */
SPL_API int spl_camera_look_at(struct spl_camera *camera, const double eye[3], const double target[3],
                               const double up[3], struct spl_error *err);

enum spl_axes {
    SPL_AXES_OPENCV, /* +x right, +y down, +z forward: COLMAP, ROS, Open3D */
    SPL_AXES_OPENGL, /* +x right, +y up, -z forward: glTF, nerfstudio, Blender */
};

/* From a 4×4 camera-to-world matrix, row-major, in the named axes. Refuses non-finite numbers, a last row other than
 * (0 0 0 1) and a rotation block that is not orthonormal within 1e-3 (it is re-orthonormalised); field "matrix".
 * Fills eye and rotation only. */
SPL_API int spl_camera_set_matrix(struct spl_camera *camera, const double camera_to_world[16], enum spl_axes axes,
                                  struct spl_error *err);

/* From COLMAP's world-to-camera quaternion (w, x, y, z; normalised here, zero refused) and translation;
 * fields "q", "t". Fills eye and rotation only. */
SPL_API int spl_camera_set_colmap(struct spl_camera *camera, const double q[4], const double t[3],
                                  struct spl_error *err);

/* Where the pixels of an orthographic view straight down lie, all but their epsg. SPL_E_INPUT, field "format", of a
 * view that is none. */
struct spl_ground;
SPL_API int spl_camera_get_ground(const struct spl_camera *camera, struct spl_ground *ground, struct spl_error *err);

/* Checks everything: finite, orthonormal, positive focal lengths and sizes, 0 < near < far, |eye| <= 1e12.
 * The field at fault is named. */
SPL_API int spl_camera_check(const struct spl_camera *camera, struct spl_error *err);

/* Does the camera draw what no one pinhole and no parallel rays do? Such views have ranges, but no view depths. */
SPL_API bool spl_camera_is_bent(const struct spl_camera *camera);

/* The unit direction, in the camera's frame, of the ray through pixel (u, v); parallel rays begin beside the eye. False
 * where the lens has no image, outside of a fisheye's circle, and of rays, which the camera does not hold. */
SPL_API bool spl_camera_get_ray(const struct spl_camera *camera, double u, double v, double ray[3]);

/* The pixel and view depth (of bent cameras the distance) of world point `p`; false (outputs untouched) where it has no
 * image: at or behind the eye's plane, or beyond the lens' reach. */
SPL_API bool spl_camera_project(const struct spl_camera *camera, const double p[3], double pixel[2], double *depth);

SPL_END_DECLARATIONS

#endif
