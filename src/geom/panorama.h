/* Images around an eye, spherical or on a cylinder, and pinholes cut out of them. The panorama's frame is a scanner's:
 * azimuth from x (the middle of the image) towards y (to its left), z up. Pure functions; any thread. */
#ifndef SPL_GEOM_PANORAMA_H
#define SPL_GEOM_PANORAMA_H

#include <splatd/camera.h>

enum { SPL_PANORAMA_FACES = 6 };

struct spl_panorama {
    bool cylinder;          /* rows go with the elevation's tangent, not its angle */
    uint32_t width, height; /* pixels */
    double across, down;    /* pixels a radian; of a cylinder, down is pixels a unit of the tangent */
    double horizon;         /* the row at elevation 0; the first one's centre is 0.5 */
    double rotation[9];     /* of the face that is cut out: its axes (right, down, forward) to the panorama's frame */
};

/* The name of a face, and its axes: row-major, columns are right, down and forward. */
const char *spl_panorama_face(unsigned face, double rotation[9]);

/* Where the face shows the panorama: the place in it of a pixel of the face. False: it has nothing there. */
bool spl_panorama_place(const struct spl_panorama *panorama, const struct spl_camera *face, const double pixel[2],
                        double place[2]);

/* The same of a direction in the panorama's frame, of any length above 0. */
bool spl_panorama_place_of(const struct spl_panorama *panorama, const double p[3], double place[2]);

/* All columns go around once: the first lies beside the last. */
bool spl_panorama_is_closed(const struct spl_panorama *panorama);

#endif
