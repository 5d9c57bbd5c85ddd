/* Six faces of 90 degrees hold all directions around an eye; each pixel of one is looked up in the panorama.
 * Pure functions; any thread. */
#include "geom/panorama.h"

#include <math.h>
#include <string.h>

const char *spl_panorama_face(unsigned face, double rotation[9])
{
    static const struct {
        const char *name;
        double forward[3], down[3];
    } faces[SPL_PANORAMA_FACES] = {
        {"front", {1, 0, 0}, {0, 0, -1}},  {"left", {0, 1, 0}, {0, 0, -1}}, {"back", {-1, 0, 0}, {0, 0, -1}},
        {"right", {0, -1, 0}, {0, 0, -1}}, {"up", {0, 0, 1}, {1, 0, 0}},    {"down", {0, 0, -1}, {-1, 0, 0}},
    };
    const double *f = faces[face].forward, *d = faces[face].down;
    for (int k = 0; k < 3; k++) {
        rotation[3 * k] = d[(k + 1) % 3] * f[(k + 2) % 3] - d[(k + 2) % 3] * f[(k + 1) % 3];
        rotation[3 * k + 1] = d[k];
        rotation[3 * k + 2] = f[k];
    }
    return faces[face].name;
}

bool spl_panorama_is_closed(const struct spl_panorama *panorama)
{
    return fabs(panorama->width - 2 * M_PI * panorama->across) < 1;
}

bool spl_panorama_place(const struct spl_panorama *panorama, const struct spl_camera *face, const double pixel[2],
                        double place[2])
{
    const double *r = panorama->rotation;
    double x = (pixel[0] - face->cx) / face->fx, y = (pixel[1] - face->cy) / face->fy, p[3];
    for (int k = 0; k < 3; k++)
        p[k] = r[3 * k] * x + r[3 * k + 1] * y + r[3 * k + 2];
    return spl_panorama_place_of(panorama, p, place);
}

bool spl_panorama_place_of(const struct spl_panorama *panorama, const double p[3], double place[2])
{
    double level = hypot(p[0], p[1]), rise = panorama->cylinder ? p[2] / level : atan2(p[2], level);
    place[0] = panorama->width / 2.0 - atan2(p[1], p[0]) * panorama->across;
    place[1] = panorama->horizon - rise * panorama->down;
    return place[0] >= 0 && place[0] <= panorama->width && place[1] >= 0 && place[1] <= panorama->height;
}
