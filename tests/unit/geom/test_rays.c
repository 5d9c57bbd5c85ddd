/* Rays of cameras that see further around than a pinhole, or through a lens, and the faces that they are drawn from:
 * there and back for every pixel of each, in which direction which pixel looks, that faces hold what pixels ask for,
 * and no more of them, as finely; and that two faces have the same rays where they meet. */
#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <stdio.h>
#include <string.h>
#include <cmocka.h>

#include "base/error.h"
#include "geom/faces.h"

static const double identity[9] = {1, 0, 0, 0, 1, 0, 0, 0, 1};

static struct spl_camera start(void)
{
    struct spl_camera camera = {.near = 0.01, .far = INFINITY};
    memcpy(camera.rotation, identity, sizeof identity);
    return camera;
}

static struct spl_camera around(enum spl_projection projection, uint32_t width, uint32_t height)
{
    struct spl_camera camera = start();
    assert_int_equal(spl_camera_set_around(&camera, projection, width, height, NULL), 0);
    return camera;
}

static struct spl_camera fisheye(double fov, uint32_t width, uint32_t height)
{
    struct spl_camera camera = start();
    assert_int_equal(spl_camera_set_fisheye(&camera, fov, width, height, NULL), 0);
    return camera;
}

static struct spl_camera bent(double fov, const struct spl_distortion *lens)
{
    struct spl_camera camera = start();
    assert_int_equal(spl_camera_set_fov(&camera, fov, 96, 64, NULL), 0);
    camera.cx += 3.25;
    assert_int_equal(spl_camera_set_lens(&camera, lens, NULL), 0);
    assert_int_equal(spl_camera_check(&camera, NULL), 0);
    return camera;
}

enum { CAMERAS = 10 };

static struct spl_camera make(int i)
{
    static const struct spl_distortion barrel = {.kind = SPL_DISTORTION_RADIAL,
                                                 .k = {-0.28, 0.07, 0, 0, 0, 0},
                                                 .p = {0.001, -0.002}},
                                       pincushion = {.kind = SPL_DISTORTION_RADIAL, .k = {0.2, 0, 0.01, 0.1}},
                                       wide = {.kind = SPL_DISTORTION_FISHEYE, .k = {0.04, -0.01, 0.002, -0.0003}};
    switch (i) {
    case 0:
        return around(SPL_EQUIRECTANGULAR, 128, 64);
    case 1:
        return around(SPL_EQUIRECTANGULAR, 50, 70);
    case 2:
        return around(SPL_CUBE, 6 * 32, 32);
    case 3:
        return around(SPL_CUBE, 6 * 33, 33);
    case 4:
        return fisheye(180, 64, 64);
    case 5:
        return fisheye(300, 80, 64);
    case 6:
        return fisheye(50, 64, 64);
    case 7:
        return bent(50, &barrel);
    case 8:
        return bent(60, &pincushion);
    default:
        return bent(50, &wide);
    }
}

static void pixels_look_there_and_back(void **state)
{
    (void)state;
    for (int i = 0; i < CAMERAS; i++) {
        const struct spl_camera camera = make(i);
        struct spl_faces faces;
        size_t seen = 0;
        assert_true(spl_camera_is_bent(&camera));
        assert_int_equal(spl_faces_init(&faces, &camera, 4096, NULL), 0);
        for (uint32_t y = 0; y < camera.height; y++)
            for (uint32_t x = 0; x < camera.width; x++) {
                const double u = x + 0.5, v = y + 0.5;
                double ray[3], pixel[2], place[2], along, depth;
                if (!spl_camera_get_ray(&camera, u, v, ray))
                    continue;
                seen++;
                assert_true(fabs(ray[0] * ray[0] + ray[1] * ray[1] + ray[2] * ray[2] - 1) < 1e-12);
                assert_true(spl_camera_project(&camera, (double[]){9 * ray[0], 9 * ray[1], 9 * ray[2]}, pixel, &depth));
                if (!(fabs(pixel[0] - u) < 1e-9 && fabs(pixel[1] - v) < 1e-9 && fabs(depth - 9) < 1e-12))
                    fail_msg("camera %d: pixel %g %g comes back at %.12f %.12f", i, u, v, pixel[0], pixel[1]);
                /* the face's pinhole sees the ray there, and what is around it */
                const struct spl_camera *face = &faces.cameras[spl_faces_place(&faces, ray, place, &along)];
                const double inside = SPL_FACE_MARGIN - 1.5;
                if (!(place[0] >= inside && place[0] <= face->width - inside && place[1] >= inside &&
                      place[1] <= face->height - inside))
                    fail_msg("camera %d: pixel %g %g is at %g %g of a face of %u x %u", i, u, v, place[0], place[1],
                             face->width, face->height);
                assert_true(spl_camera_project(face, ray, pixel, &depth));
                assert_true(fabs(pixel[0] - place[0]) < 1e-9 && fabs(pixel[1] - place[1]) < 1e-9);
                assert_true(fabs(depth - along) < 1e-12);
            }
        const size_t pixels = (size_t)camera.width * camera.height;
        assert_true(i == 4 || i == 6 ? seen > pixels * 3 / 4 && seen < pixels * 4 / 5 /* a circle */
                    : i == 5         ? seen < pixels && seen > pixels / 2
                                     : seen == pixels);
    }
}

static void assert_looks(const struct spl_camera *camera, double u, double v, double x, double y, double z)
{
    double ray[3];
    assert_true(spl_camera_get_ray(camera, u, v, ray));
    if (!(fabs(ray[0] - x) < 1e-9 && fabs(ray[1] - y) < 1e-9 && fabs(ray[2] - z) < 1e-9))
        fail_msg("(%g, %g) looks to %g %g %g, not %g %g %g", u, v, ray[0], ray[1], ray[2], x, y, z);
}

static void columns_are_azimuths_and_faces_in_order(void **state)
{
    (void)state;
    struct spl_camera sphere = make(0), cube = make(2), eye = make(4);
    double ray[3];
    assert_looks(&sphere, 64, 32, 0, 0, 1);
    assert_looks(&sphere, 96, 32, 1, 0, 0);
    assert_looks(&sphere, 32, 32, -1, 0, 0);
    assert_looks(&sphere, 0, 32, 0, 0, -1);
    assert_looks(&sphere, 17, 0, 0, -1, 0);
    assert_looks(&sphere, 64, 48, 0, sqrt(0.5), sqrt(0.5));
    assert_false(spl_camera_get_ray(&sphere, 64, -0.1, ray));
    static const double middles[6][3] = {{1, 0, 0}, {-1, 0, 0}, {0, -1, 0}, {0, 1, 0}, {0, 0, 1}, {0, 0, -1}};
    for (int face = 0; face < 6; face++)
        assert_looks(&cube, 32 * face + 16, 16, middles[face][0], middles[face][1], middles[face][2]);
    const double s = sqrt(0.5);
    assert_looks(&cube, 0, 16, s, 0, s);           /* right begins where front ends */
    assert_looks(&cube, 64 - 1e-12, 16, -s, 0, s); /* left ends where front begins */
    assert_looks(&cube, 80, 32, 0, -s, s);         /* up stands on front, down hangs below it */
    assert_looks(&cube, 112, 0, 0, s, s);
    assert_looks(&cube, 160, 16, s, 0, -s); /* back begins where right ends */
    assert_looks(&eye, 32, 32, 0, 0, 1);
    assert_looks(&eye, 64, 32, 1, 0, 0);
    assert_looks(&eye, 32, 16, 0, -s, s);
    assert_false(spl_camera_get_ray(&eye, 1, 1, ray));
    assert_false(spl_camera_project(&eye, (double[]){0, 0, -1}, ray, ray + 2));
}

static void only_what_is_asked_for_is_drawn(void **state)
{
    (void)state;
    static const unsigned asked[CAMERAS] = {63, 63, 63, 63, 31, 63, 16, 31, 31, 31};
    /* of the image's pixels, margins included */
    static const double most[CAMERAS] = {2.3, 6.1, 1.95, 1.95, 5, 3.4, 1.8, 3, 2.2, 2.3};
    for (int i = 0; i < CAMERAS; i++) {
        const struct spl_camera camera = make(i);
        struct spl_faces faces;
        unsigned drawn = 0;
        assert_int_equal(spl_faces_init(&faces, &camera, 4096, NULL), 0);
        for (unsigned face = 0; face < SPL_FACES; face++)
            drawn |= faces.cameras[face].width ? 1u << face : 0;
        const double share = (double)spl_faces_get_pixels(&faces) / (camera.width * (double)camera.height);
        if (i < 7 ? drawn != asked[i] : drawn & ~asked[i])
            fail_msg("camera %d: faces %#x", i, drawn);
        if (!(share <= most[i]))
            fail_msg("camera %d: %g times its pixels are drawn", i, share);
    }
    const struct spl_camera large = around(SPL_EQUIRECTANGULAR, 2048, 1024), high = fisheye(180, 1024, 1024);
    struct spl_faces faces;
    assert_int_equal(spl_faces_init(&faces, &large, 4096, NULL), 0);
    assert_true(spl_faces_get_pixels(&faces) < 1.3 * 2048 * 1024);
    assert_int_equal(faces.cameras[4].fx, 326);
    assert_int_equal(spl_faces_init(&faces, &high, 4096, NULL), 0);
    assert_true(faces.cameras[0].width < 0.56 * faces.cameras[4].width &&
                faces.cameras[0].height == faces.cameras[4].height);
    struct spl_error err = {0};
    assert_int_equal(spl_faces_init(&faces, &large, 600, &err), SPL_E_LIMIT);
    assert_string_equal(err.field, "width");
}

/* One step of the image is one of the face, or more: along columns of what is seen all around; in any direction of what
 * lies up to 90 degrees off the axis of a fisheye or in a lens. */
static void faces_are_as_fine_as_images(void **state)
{
    (void)state;
    for (int i = 0; i < CAMERAS; i++) {
        const struct spl_camera camera = make(i);
        struct spl_faces faces;
        double finest = INFINITY;
        assert_int_equal(spl_faces_init(&faces, &camera, 4096, NULL), 0);
        for (uint32_t y = 1; y < camera.height; y++)
            for (uint32_t x = 1; x < camera.width; x++)
                for (int axis = i < 2; axis < 2; axis++) {
                    const double u = x + 0.5, v = y + 0.5, step = 0.01;
                    double ray[3], beside[3], a[2], b[2], along;
                    if (!spl_camera_get_ray(&camera, u, v, ray) || (i == 5 && ray[2] < 0) ||
                        !spl_camera_get_ray(&camera, u + (axis ? 0 : step), v + (axis ? step : 0), beside) ||
                        spl_faces_place(&faces, ray, a, &along) != spl_faces_place(&faces, beside, b, &along))
                        continue;
                    finest = fmin(finest, hypot(b[0] - a[0], b[1] - a[1]) / step);
                }
        if (!(finest > 0.98 && finest < 1.6))
            fail_msg("camera %d: a pixel is %g of a face's", i, finest);
    }
}

static void faces_have_the_same_rays_where_they_meet(void **state)
{
    (void)state;
    const struct spl_camera camera = make(0);
    struct spl_faces faces;
    assert_int_equal(spl_faces_init(&faces, &camera, 4096, NULL), 0);
    const int side = (int)faces.cameras[4].fx;
    for (int i = -side; i <= side; i++) { /* along the edge of front and right */
        const double y = (double)i / side;
        const struct spl_camera *two[2] = {&faces.cameras[4], &faces.cameras[0]};
        for (int k = 0; k < 2; k++) {
            double pixel[2], depth;
            assert_true(spl_camera_project(two[k], (double[]){1, y, 1}, pixel, &depth));
            for (int axis = 0; axis < 2; axis++)
                assert_true(fabs(pixel[axis] - floor(pixel[axis]) - 0.5) < 1e-9);
        }
    }
}

/* Rays from `from` to `to` degrees along one axis: its focal length and principal point. */
static void set_rays(double from, double to, uint32_t count, double *focal, double *middle)
{
    *focal = (count - 1) / ((to - from) * M_PI / 180);
    *middle = 0.5 - from * M_PI / 180 * *focal;
}

/* A scan's rings and columns need not be whole turns: some turn in the middle of a face, some end at a pole. */
static void a_scans_rays_are_on_their_faces(void **state)
{
    (void)state;
    uint64_t random = 7;
    for (int i = 0; i < 60; i++) {
        static const double known[][4] = {
            {-10, 10, 60, 90}, {-175, 185, 60, 80}, {20, -160, -90, 30}, {0, 350, 89, -89}};
        double scan[4];
        for (int k = 0; k < 4; k++) {
            random = random * 6364136223846793005u + 1442695040888963407u;
            const double share = (double)(random >> 11) / 9007199254740992.0;
            scan[k] = i < 4 ? known[i][k] : k < 2 ? 360 * share - 180 : 180 * share - 90;
        }
        struct spl_camera camera = start();
        camera.projection = SPL_EQUIRECTANGULAR;
        camera.width = i < 4 ? 700 : 40 + (uint32_t)(random >> 55);
        camera.height = i < 4 ? 1500 : 40 + (uint32_t)(random >> 40 & 255);
        set_rays(scan[0], scan[1], camera.width, &camera.fx, &camera.cx);
        set_rays(-scan[2], -scan[3], camera.height, &camera.fy, &camera.cy);
        struct spl_faces faces;
        if (spl_faces_init(&faces, &camera, 32768, NULL))
            continue; /* finer than there is room for */
        for (uint32_t y = 0; y < camera.height; y++)
            for (uint32_t x = 0; x < camera.width; x++) {
                double ray[3], place[2], along;
                if (!spl_camera_get_ray(&camera, x + 0.5, y + 0.5, ray))
                    continue;
                const struct spl_camera *face = &faces.cameras[spl_faces_place(&faces, ray, place, &along)];
                if (!(place[0] >= 2 && place[0] <= face->width - 2.0 && place[1] >= 2 &&
                      place[1] <= face->height - 2.0))
                    fail_msg(
                        "azimuth %g to %g, elevation %g to %g: ray %u, %u of %u x %u is at %g, %g of a face of %u x %u",
                        scan[0], scan[1], scan[2], scan[3], x, y, camera.width, camera.height, place[0], place[1],
                        face->width, face->height);
            }
    }
}

/* No face, rather than one of a side without pixels. */
static void what_sees_nothing_has_no_faces(void **state)
{
    (void)state;
    struct spl_camera camera = fisheye(180, 64, 64);
    struct spl_faces faces;
    camera.cx = -1e6;
    assert_int_equal(spl_camera_check(&camera, NULL), 0);
    assert_int_equal(spl_faces_init(&faces, &camera, 4096, NULL), 0);
    assert_int_equal(spl_faces_get_pixels(&faces), 0);
    camera = fisheye(180, 64, 64);
    camera.fx = camera.fy = camera.cx = 1e9;
    camera.cy = -1e9;
    assert_int_equal(spl_camera_check(&camera, NULL), 0);
    if (!spl_faces_init(&faces, &camera, 4096, NULL))
        for (int i = 0; i < SPL_FACES; i++)
            assert_true(!faces.cameras[i].width == !faces.cameras[i].height);
}

static void faults_are_named(void **state)
{
    (void)state;
    struct spl_camera camera = start();
    struct spl_error err = {0};
    assert_int_equal(spl_camera_set_around(&camera, SPL_CUBE, 100, 20, &err), SPL_E_INPUT);
    assert_string_equal(err.field, "width");
    err = (struct spl_error){0};
    assert_int_equal(spl_camera_set_around(&camera, SPL_EQUIRECTANGULAR, 100, 0, &err), SPL_E_INPUT);
    assert_string_equal(err.field, "height");
    err = (struct spl_error){0};
    assert_int_equal(spl_camera_set_around(&camera, SPL_FISHEYE, 100, 50, &err), SPL_E_USAGE);
    assert_string_equal(err.field, "projection");
    for (int i = 0; i < 3; i++) {
        err = (struct spl_error){0};
        assert_int_equal(spl_camera_set_fisheye(&camera, (double[]){0, 361, NAN}[i], 9, 9, &err), SPL_E_INPUT);
        assert_string_equal(err.field, "fov");
    }
    err = (struct spl_error){0};
    camera = fisheye(90, 9, 9);
    camera.lens.p[0] = 0.1;
    assert_int_equal(spl_camera_check(&camera, &err), SPL_E_INPUT);
    assert_string_equal(err.field, "params");
    static const char *const far[] = {"fx", "fy", "cx", "cy"}; /* where a float's pixels end */
    for (int i = 0; i < 4; i++) {
        err = (struct spl_error){0};
        camera = fisheye(90, 9, 9);
        *(double *[]){&camera.fx, &camera.fy, &camera.cx, &camera.cy}[i] = i < 2 ? 1e20 : -1e20;
        assert_int_equal(spl_camera_check(&camera, &err), SPL_E_INPUT);
        assert_string_equal(err.field, far[i]);
    }
    err = (struct spl_error){0};
    camera = fisheye(90, 9, 9);
    camera.projection = SPL_EQUIRECTANGULAR;
    assert_int_equal(spl_camera_check(&camera, &err), SPL_E_USAGE);
    assert_string_equal(err.field, "projection");
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(pixels_look_there_and_back),
        cmocka_unit_test(columns_are_azimuths_and_faces_in_order),
        cmocka_unit_test(only_what_is_asked_for_is_drawn),
        cmocka_unit_test(faces_are_as_fine_as_images),
        cmocka_unit_test(faces_have_the_same_rays_where_they_meet),
        cmocka_unit_test(a_scans_rays_are_on_their_faces),
        cmocka_unit_test(what_sees_nothing_has_no_faces),
        cmocka_unit_test(faults_are_named),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
