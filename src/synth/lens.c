/* Directions are doubles in the scene's axes. A panorama's pixel is bounded by two meridians, which are planes, and by
 * two parallels, which are not: its corners are moved outwards by more than a parallel bulges from the plane through
 * them. */
#include "synth/lens.h"

#include <math.h>
#include <string.h>

#include "geom/vector.h"

struct spl_lens spl_lens_of_camera(const struct spl_camera *camera, const double offset[3])
{
    struct spl_lens lens = {.fx = camera->fx,
                            .fy = camera->fy,
                            .cx = camera->cx,
                            .cy = camera->cy,
                            .width = camera->width,
                            .height = camera->height,
                            .nearest = camera->near,
                            .farthest = camera->far};
    sub3(camera->eye, offset, lens.origin);
    memcpy(lens.rotation, camera->rotation, sizeof lens.rotation);
    return lens;
}

struct spl_lens spl_lens_of_panorama(const double origin[3], const double rotation[9], uint32_t width)
{
    struct spl_lens lens = {.panorama = true, .width = width, .height = width / 2, .farthest = INFINITY};
    for (int i = 0; i < 3; i++) {
        lens.origin[i] = origin[i];
        for (int a = 0; a < 3; a++)
            lens.rotation[3 * a + i] = rotation[3 * i + a];
    }
    return lens;
}

static void to_world(const struct spl_lens *lens, const double local[3], double direction[3])
{
    const double *r = lens->rotation;
    for (int i = 0; i < 3; i++)
        direction[i] = r[i] * local[0] + r[3 + i] * local[1] + r[6 + i] * local[2];
}

void spl_lens_ray(const struct spl_lens *lens, double x, double y, double direction[3])
{
    if (!lens->panorama) {
        to_world(lens, (double[3]){(x - lens->cx) / lens->fx, (y - lens->cy) / lens->fy, 1}, direction);
        return;
    }
    double longitude = M_PI * (1 - 2 * x / lens->width), latitude = M_PI * (0.5 - y / lens->height);
    double level = cos(latitude);
    to_world(lens, (double[3]){level * cos(longitude), level * sin(longitude), sin(latitude)}, direction);
}

bool spl_lens_place(const struct spl_lens *lens, const double d[3], double place[2])
{
    const double *r = lens->rotation;
    double local[3] = {dot3(r, d), dot3(r + 3, d), dot3(r + 6, d)};
    if (lens->panorama) {
        place[0] = (1 - atan2(local[1], local[0]) / M_PI) * lens->width / 2;
        place[1] = (0.5 - atan2(local[2], hypot(local[0], local[1])) / M_PI) * lens->height;
        return true;
    }
    if (!(local[2] > 0))
        return false;
    place[0] = lens->fx * local[0] / local[2] + lens->cx;
    place[1] = lens->fy * local[1] / local[2] + lens->cy;
    return true;
}

void spl_lens_corners(const struct spl_lens *lens, uint32_t x, uint32_t y, double corners[4][3])
{
    /* A parallel rises (width of the pixel, radians)² / 8 above its chord: under pi / (4 width) of a pixel's height. */
    double more = lens->panorama ? 1e-4 + 1.0 / lens->width : 1e-4;
    double left = x - 1e-4, right = x + 1 + 1e-4, top = y - more, bottom = y + 1 + more;
    if (lens->panorama) {
        top = fmax(top, 0);
        bottom = fmin(bottom, lens->height);
    }
    spl_lens_ray(lens, left, top, corners[0]);
    spl_lens_ray(lens, right, top, corners[1]);
    spl_lens_ray(lens, right, bottom, corners[2]);
    spl_lens_ray(lens, left, bottom, corners[3]);
}
