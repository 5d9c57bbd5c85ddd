/* Which ray belongs to which place of an image. Pure functions; any thread. */
#ifndef SPL_SYNTH_LENS_H
#define SPL_SYNTH_LENS_H

#include <stdbool.h>

#include <splatd/camera.h>

/* Both kinds look from `origin`, given in the scene's own coordinates; R is row-major, world to camera. */
struct spl_lens {
    bool panorama;
    double origin[3], rotation[9];
    double fx, fy, cx, cy; /* pinhole */
    uint32_t width, height;
    double nearest, farthest; /* t of what is seen: view depth of a pinhole, range of a panorama */
};

/* A pinhole of world coordinates in a scene that lies `offset` away from its model. */
struct spl_lens spl_lens_of_camera(const struct spl_camera *camera, const double offset[3]);

/* The whole sphere around `origin`, width × width/2 pixels, in the axes of `rotation` (frame to world, row-major):
 * place (x, y) looks along longitude pi (1 - 2 x / width), counted from the frame's +x towards +y, and latitude pi (1/2
 * - y / height), towards +z. The middle of the image looks along +x, the left edge along -x; +y is left of the middle,
 * as a person sees it who stands inside. */
struct spl_lens spl_lens_of_panorama(const double origin[3], const double rotation[9], uint32_t width);

/* The ray through (x, y), the first pixel being (0..1, 0..1): a pinhole's has a view depth of 1, a panorama's is unit.
 */
void spl_lens_ray(const struct spl_lens *lens, double x, double y, double direction[3]);

/* The place that sees direction `d` of the scene's axes; false when a pinhole does not. */
bool spl_lens_place(const struct spl_lens *lens, const double d[3], double place[2]);

/* Four directions between which all rays of a pixel lie, for spl_beam_init(). */
void spl_lens_corners(const struct spl_lens *lens, uint32_t x, uint32_t y, double corners[4][3]);

#endif
