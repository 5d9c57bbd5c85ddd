/* Cameras around a cube of half a side of 1, of which selection is asked in many. */
#ifndef SPL_TESTS_RENDER_CAMERAS_H
#define SPL_TESTS_RENDER_CAMERAS_H

#include <splatd/camera.h>

/* Around the cube, within it, beside it, with lenses of every length; `uniform` gives numbers from 0 to 1. */
static inline struct spl_camera random_camera(double (*uniform)(void), uint32_t width, uint32_t height)
{
    struct spl_camera camera = {.near = 0.01, .far = uniform() < 0.2 ? 1.5 : 1000};
    double away = 0.1 + 10 * uniform() * uniform();
    for (;;) {
        double eye[3], target[3];
        for (int c = 0; c < 3; c++) {
            eye[c] = away * (2 * uniform() - 1);
            target[c] = 1.5 * (2 * uniform() - 1);
        }
        const double up[3] = {0.1, 0.2, 1};
        if (!spl_camera_look_at(&camera, eye, target, up, NULL))
            break;
    }
    assert_int_equal(spl_camera_set_fov(&camera, 10 + 80 * uniform(), width, height, NULL), SPL_OK);
    camera.cx += 60 * (uniform() - 0.5);
    camera.fy *= 0.8 + 0.4 * uniform();
    return camera;
}

#endif
