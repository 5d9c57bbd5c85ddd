/* Sizes of images: of which one side, or both, are left out, and of one that is made larger or smaller; and from where
 * on is drawn. */
#ifndef SPL_GEOM_SIZE_H
#define SPL_GEOM_SIZE_H

#include <math.h>

#include <splatd/camera.h>

enum { SPL_WIDTH_DEFAULT = 1280, SPL_HEIGHT_DEFAULT = 720 };

/* Where no dataset is at hand whose size would say; far is infinite then. */
#define SPL_CAMERA_NEAR_DEFAULT 0.01
/* Of eye and target: beyond it neighbouring doubles are further apart than the points of any scan. */
#define SPL_CAMERA_COORDINATE_MAX 1e12

/* The size of an image of which neither side is said, and so its ratio where one is. */
static inline void spl_size_of_projection(enum spl_projection projection, double shape[2])
{
    static const double shapes[SPL_PROJECTION_COUNT][2] = {
        [SPL_EQUIRECTANGULAR] = {1440, 720}, [SPL_CUBE] = {1920, 320}, [SPL_FISHEYE] = {720, 720}};
    shape[0] = shapes[projection][0] > 0 ? shapes[projection][0] : SPL_WIDTH_DEFAULT;
    shape[1] = shapes[projection][1] > 0 ? shapes[projection][1] : SPL_HEIGHT_DEFAULT;
}

/* Fills the sides of `size`, width and height, that are 0: both from `shape`, one from the other at the ratio of
 * `shape`, to the nearest pixel, halves up, at least 1. A shape of 0 x 0 leaves them 0. No upper limit: the caller
 * has one. */
static inline void spl_size_follow(double size[2], const double shape[2])
{
    const double given[2] = {size[0], size[1]};
    for (int i = 0; i < 2; i++)
        if (given[i] == 0 && shape[i] > 0)
            size[i] = fmax(1, round(given[!i] > 0 ? given[!i] * shape[i] / shape[!i] : shape[i]));
}

/* Scales the lens: what lay x pixels from the left edge and y from the top lies x * `across` and y * `down` from them.
 * The image's size is the caller's to set. */
static inline void spl_camera_scale(struct spl_camera *camera, double across, double down)
{
    camera->fx *= across;
    camera->cx *= across;
    camera->fy *= down;
    camera->cy *= down;
}

/* A share of the size; a pixel's centre stays where it is in the world. */
static inline void spl_camera_coarsen(struct spl_camera *camera, double scale)
{
    camera->width = (uint32_t)ceil(camera->width * scale);
    camera->height = (uint32_t)ceil(camera->height * scale);
    spl_camera_scale(camera, scale, scale);
}

/* What offsets from the axis at view depth z are divided by on the image. */
static inline double spl_camera_ray_scale(const struct spl_camera *camera, double z)
{
    return camera->projection == SPL_ORTHOGRAPHIC ? 1 : z;
}

/* The same picture in width x height pixels. */
static inline void spl_camera_resize(struct spl_camera *camera, uint32_t width, uint32_t height)
{
    spl_camera_scale(camera, (double)width / camera->width, (double)height / camera->height);
    camera->width = width;
    camera->height = height;
    if (camera->projection == SPL_CUBE) /* which has no other */
        camera->fx = camera->fy = camera->cx = camera->cy = height / 2.0;
}

#endif
