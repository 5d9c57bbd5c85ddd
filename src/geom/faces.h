/* The faces of a cube around the eye, each a pinhole: what cameras that see further around, or through a lens, are
 * drawn from. Pure functions; any thread. */
#ifndef SPL_GEOM_FACES_H
#define SPL_GEOM_FACES_H

#include <splatd/camera.h>

enum { SPL_FACES = 6, SPL_FACE_MARGIN = 6 };

/* Right, left, up, down, front, back: the axes (right, down, forward) of each in the camera's frame, by rows. Up and
 * down lie against the front with their lower and upper edge. */
extern const double spl_face_axes[SPL_FACES][9];

/* The face that a direction, of any length above 0, goes through, and where: right and down of its middle, -1 to 1. */
unsigned spl_face_of(const double ray[3], double place[2]);

/* Pinholes of one focal length, so that two that meet have the same rays along the edge, but for CUBE through the
 * middles of pixels: no seam comes from the grids. What is drawn of a face is the rectangle that the camera's pixels
 * ask for, and SPL_FACE_MARGIN pixels around it, so that what looks at its neighbours sees the same from both sides. */
struct spl_faces {
    struct spl_camera cameras[SPL_FACES]; /* width 0: no pixel asks for it */
};

/* Of a bent camera (spl_camera_is_bent()) that has passed spl_camera_check(). A face's pixel is as fine as the camera's
 * finest: of an equirectangular one along its columns and its equator, of a fisheye up to 90 degrees off its axis, of a
 * lens at most half as large as in the middle. SPL_E_LIMIT, fields "width" and "params", where a side would be more
 * than `side_px`. */
int spl_faces_init(struct spl_faces *faces, const struct spl_camera *camera, uint32_t side_px, struct spl_error *err);

/* The same of a camera that may be one of RAYS; the list is NULL of others. Field "resolution". */
int spl_faces_init_of(struct spl_faces *faces, const struct spl_camera *camera, const struct spl_rays *rays,
                      uint32_t side_px, struct spl_error *err);

/* The face of a direction in the camera's frame, and its pixel. *along: the direction's component along the face's
 * axis. */
unsigned spl_faces_place(const struct spl_faces *faces, const double ray[3], double pixel[2], double *along);

/* What all of them have together. */
uint64_t spl_faces_get_pixels(const struct spl_faces *faces);

/* rays.c: pixel of a direction in the camera's frame, of bent cameras; false where it has no image. */
bool spl_camera_place(const struct spl_camera *camera, const double c[3], double pixel[2]);
/* What spl_camera_check() asks of bent cameras besides. */
int spl_camera_check_bent(const struct spl_camera *camera, struct spl_error *err);

#endif
