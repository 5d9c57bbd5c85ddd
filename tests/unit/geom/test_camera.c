/* A marked world point lands on its pixel, whatever form the camera came in and however far from the origin it stands.
 * The golden numbers were computed with 50 digits by solving eye + a right + b up + c forward = p for a, b, c, with the
 * axes from angles (yaw 35, pitch 70, roll 8 degrees); api/cameras.md shows them. */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <math.h>
#include <stdint.h>
#include <string.h>
#include <cmocka.h>

#include <splatd/camera.h>

#include "geom/size.h"

struct posed { /* one pose at two places; the point projects to (412.5, 273.125) at depth 8 */
    double eye[3], point[3], t[3];
    double pixel[2], depth;
};

static const struct posed local = {
    {2.5, -3.5, 1.75},
    {-0.57705449706900003, 3.3087614730900001, -1.46753054758},
    {-0.06410832213881687, 0.16613728300474614, 4.6401280721795111},
    {412.50000000007034, 273.12499999980368},
    7.9999999999987371,
};
static const struct posed utm = {
    {400012.345, 5600067.89, 123.4},
    {400009.26794599998, 5600074.6987600001, 120.18246945200001},
    {-3712740.1668441948, 983452.40566009129, -4095015.5168560872},
    {412.49998271314519, 273.12503616325898},
    7.9999985986157787,
};
static const double opengl_axes[9] = {
    0.78387787227503695, -0.30826946648440512, 0.53898554469575628,
    0.60698607043454015, 0.19761352719368059,  -0.76975113132005719,
    0.13077993598406572, 0.93054759679636629,  0.34202014332566873,
};
static const double colmap_q[4] = {-0.55772847375664971, -0.76215345285486739, -0.30022022910563139,
                                   0.13389875988314353};

static struct spl_camera make_intrinsics(void)
{
    return (struct spl_camera){.fx = 500, .fy = 510, .cx = 331.25, .cy = 228.5, .width = 640, .height = 480,
                               .near = 0.1, .far = INFINITY};
}

static void make_matrix(const struct posed *posed, enum spl_axes axes, double m[16])
{
    memset(m, 0, 16 * sizeof *m);
    for (int i = 0; i < 3; i++) {
        double sign = axes == SPL_AXES_OPENCV ? -1 : 1;
        m[4 * i] = opengl_axes[3 * i];
        m[4 * i + 1] = sign * opengl_axes[3 * i + 1];
        m[4 * i + 2] = sign * opengl_axes[3 * i + 2];
        m[4 * i + 3] = posed->eye[i];
    }
    m[15] = 1;
}

static void assert_pixel(const struct spl_camera *camera, const double point[3], double u, double v, double depth,
                         double tolerance)
{
    double pixel[2], z;
    struct spl_error err = {0};
    if (spl_camera_check(camera, &err))
        fail_msg("%s: %s", err.field, err.message);
    assert_true(spl_camera_project(camera, point, pixel, &z));
    if (!(fabs(pixel[0] - u) <= tolerance && fabs(pixel[1] - v) <= tolerance && fabs(z - depth) <= tolerance))
        fail_msg("pixel %.12f %.12f depth %.12f, expected %.12f %.12f %.12f", pixel[0], pixel[1], z, u, v, depth);
}

static void look_at_hits_the_golden_pixel(void **state)
{
    (void)state;
    static const double up[3] = {0, 0, 1};
    static const struct {
        double eye[3], target[3], point[3], by_fov[2], by_pinhole[2], depth;
    } rows[] = {
        {{3, -4, 2}, {0, 1, 1.5}, {0.5, 0.25, 1}, {323.56596303319333, 287.83174284533473},
         {335.53918691069672, 287.18329791607129}, 4.9979922976430516},
        {{400012.345, 5600067.89, 123.4}, {400000.5, 5600100.25, 118.75}, {400003.125, 5600095.5, 121.0625},
         {331.86991292607565, 217.54456437246771}, {345.52728629818166, 200.95011491580708}, 29.148111681433925},
    };
    for (int i = 0; i < 2; i++) {
        struct spl_camera camera = make_intrinsics();
        assert_int_equal(spl_camera_look_at(&camera, rows[i].eye, rows[i].target, up, NULL), 0);
        assert_pixel(&camera, rows[i].point, rows[i].by_pinhole[0], rows[i].by_pinhole[1], rows[i].depth, 1e-9);
        assert_int_equal(spl_camera_set_fov(&camera, 60, 640, 480, NULL), 0);
        assert_pixel(&camera, rows[i].point, rows[i].by_fov[0], rows[i].by_fov[1], rows[i].depth, 1e-9);
        double distance = 0;
        for (int c = 0; c < 3; c++)
            distance += pow(rows[i].target[c] - rows[i].eye[c], 2);
        assert_pixel(&camera, rows[i].target, 320, 240, sqrt(distance), 1e-9);
    }
}

/* The axes in words: what is to the right, above and in front appears there. */
static void axes_point_where_they_should(void **state)
{
    (void)state;
    struct spl_camera camera = make_intrinsics();
    static const double eye[3] = {0, 0, 0}, north[3] = {0, 1, 0}, up[3] = {0, 0, 5};
    assert_int_equal(spl_camera_look_at(&camera, eye, north, up, NULL), 0);
    static const double east_of_it[3] = {1, 10, 0}, above_it[3] = {0, 10, 1}, behind[3] = {0, -1, 0},
                        beside[3] = {1, 0, 0};
    assert_pixel(&camera, east_of_it, 331.25 + 50, 228.5, 10, 1e-12);
    assert_pixel(&camera, above_it, 331.25, 228.5 - 51, 10, 1e-12);
    double pixel[2] = {7, 7}, depth = 7;
    assert_false(spl_camera_project(&camera, behind, pixel, &depth));
    assert_false(spl_camera_project(&camera, beside, pixel, &depth));
    assert_false(spl_camera_project(&camera, eye, pixel, &depth));
    assert_false(spl_camera_project(&camera, (double[3]){0, NAN, 0}, pixel, &depth));
    assert_true(pixel[0] == 7 && pixel[1] == 7 && depth == 7);
}

static void fov_means_the_vertical_edges(void **state)
{
    (void)state;
    struct spl_camera camera = make_intrinsics();
    static const double eye[3] = {0, 0, 0}, north[3] = {0, 1, 0}, up[3] = {0, 0, 1};
    assert_int_equal(spl_camera_look_at(&camera, eye, north, up, NULL), 0);
    assert_int_equal(spl_camera_set_fov(&camera, 90, 101, 33, NULL), 0);
    assert_true(camera.width == 101 && camera.height == 33);
    assert_pixel(&camera, (double[3]){0, 1, 1}, 50.5, 0, 1, 1e-12);
    assert_pixel(&camera, (double[3]){0, 1, -1}, 50.5, 33, 1, 1e-12);
    assert_int_equal(spl_camera_set_fov(&camera, 179, 1, 1, NULL), 0);
}

static void every_form_of_a_pose_hits_the_golden_pixel(void **state)
{
    (void)state;
    const struct posed *const places[] = {&local, &utm};
    for (int i = 0; i < 2; i++) {
        const struct posed *p = places[i];
        double tolerance = i ? 1e-6 : 1e-11, m[16]; /* COLMAP's t at UTM coordinates is a double of 4e6 */
        struct spl_camera camera = make_intrinsics();
        make_matrix(p, SPL_AXES_OPENGL, m);
        assert_int_equal(spl_camera_set_matrix(&camera, m, SPL_AXES_OPENGL, NULL), 0);
        assert_memory_equal(camera.eye, p->eye, sizeof p->eye);
        assert_pixel(&camera, p->point, p->pixel[0], p->pixel[1], p->depth, 1e-11);
        make_matrix(p, SPL_AXES_OPENCV, m);
        assert_int_equal(spl_camera_set_matrix(&camera, m, SPL_AXES_OPENCV, NULL), 0);
        assert_pixel(&camera, p->point, p->pixel[0], p->pixel[1], p->depth, 1e-11);
        struct spl_camera colmap = make_intrinsics();
        assert_int_equal(spl_camera_set_colmap(&colmap, colmap_q, p->t, NULL), 0);
        assert_pixel(&colmap, p->point, p->pixel[0], p->pixel[1], p->depth, tolerance);
        for (int k = 0; k < 9; k++)
            assert_true(fabs(colmap.rotation[k] - camera.rotation[k]) < 1e-15);
        /* q and -q, and any length of it, are the same rotation */
        double scaled[4];
        for (int k = 0; k < 4; k++)
            scaled[k] = -3e200 * colmap_q[k];
        assert_int_equal(spl_camera_set_colmap(&colmap, scaled, p->t, NULL), 0);
        assert_pixel(&colmap, p->point, p->pixel[0], p->pixel[1], p->depth, tolerance);
    }
}

static void look_at_and_matrix_agree(void **state)
{
    (void)state;
    static const double eye[3] = {1, 2, 3}, target[3] = {1, 7, 3}, up[3] = {0, 0.25, 1};
    /* looking along +y with z up: the camera's x is the world's x, its y (up) is z, its z (backwards) is -y */
    static const double m[16] = {1, 0, 0, 1, 0, 0, -1, 2, 0, 1, 0, 3, 0, 0, 0, 1};
    struct spl_camera a = make_intrinsics(), b = make_intrinsics();
    assert_int_equal(spl_camera_look_at(&a, eye, target, up, NULL), 0);
    assert_int_equal(spl_camera_set_matrix(&b, m, SPL_AXES_OPENGL, NULL), 0);
    for (int k = 0; k < 9; k++)
        assert_true(fabs(a.rotation[k] - b.rotation[k]) < 1e-15);
}

/* Six digits, as many tools write them: still a rotation to rounding, and the nearest one. */
static void rough_matrices_are_made_orthonormal(void **state)
{
    (void)state;
    double m[16];
    make_matrix(&local, SPL_AXES_OPENGL, m);
    for (int i = 0; i < 3; i++)
        for (int j = 0; j < 3; j++)
            m[4 * i + j] = round(m[4 * i + j] * 1e6) / 1e6;
    struct spl_camera camera = make_intrinsics();
    assert_int_equal(spl_camera_set_matrix(&camera, m, SPL_AXES_OPENGL, NULL), 0);
    assert_pixel(&camera, local.point, local.pixel[0], local.pixel[1], local.depth, 1e-3);
    for (int i = 0; i < 3; i++)
        for (int j = 0; j < 3; j++) {
            double sum = 0;
            for (int k = 0; k < 3; k++)
                sum += camera.rotation[3 * i + k] * camera.rotation[3 * j + k];
            assert_true(fabs(sum - (i == j)) < 1e-15);
        }
    for (int i = 0; i < 3; i++)
        for (int j = 0; j < 3; j++)
            m[4 * i + j] *= 1.0004; /* a scale is spread over all axes alike, so the direction stays */
    assert_int_equal(spl_camera_set_matrix(&camera, m, SPL_AXES_OPENGL, NULL), 0);
    assert_pixel(&camera, local.point, local.pixel[0], local.pixel[1], local.depth, 1e-3);
}

#define ASSERT_REFUSED(call, name)                                                                                     \
    do {                                                                                                               \
        struct spl_error err = {0};                                                                                    \
        struct spl_camera camera = make_intrinsics(), before = camera;                                                 \
        assert_int_equal(call, SPL_E_INPUT);                                                                           \
        assert_string_equal(err.field, name);                                                                          \
        assert_true(err.message[0]);                                                                                   \
        assert_memory_equal(&camera, &before, sizeof camera);                                                          \
    } while (0)

static void bad_fov_is_refused(void **state)
{
    (void)state;
    ASSERT_REFUSED(spl_camera_set_fov(&camera, 0, 10, 10, &err), "fov");
    ASSERT_REFUSED(spl_camera_set_fov(&camera, -60, 10, 10, &err), "fov");
    ASSERT_REFUSED(spl_camera_set_fov(&camera, 179.001, 10, 10, &err), "fov");
    ASSERT_REFUSED(spl_camera_set_fov(&camera, NAN, 10, 10, &err), "fov");
    ASSERT_REFUSED(spl_camera_set_fov(&camera, 1e-320, 10, 10, &err), "fov");
    ASSERT_REFUSED(spl_camera_set_fov(&camera, 60, 0, 10, &err), "width");
    ASSERT_REFUSED(spl_camera_set_fov(&camera, 60, 10, 0, &err), "height");
}

static void bad_look_at_is_refused(void **state)
{
    (void)state;
    static const double eye[3] = {1, 2, 3}, target[3] = {4, 5, 6}, up[3] = {0, 0, 1};
    ASSERT_REFUSED(spl_camera_look_at(&camera, (double[3]){1, NAN, 3}, target, up, &err), "eye");
    ASSERT_REFUSED(spl_camera_look_at(&camera, (double[3]){1, 1e300, 3}, target, up, &err), "eye");
    ASSERT_REFUSED(spl_camera_look_at(&camera, eye, (double[3]){INFINITY, 0, 0}, up, &err), "target");
    ASSERT_REFUSED(spl_camera_look_at(&camera, eye, eye, up, &err), "target");
    ASSERT_REFUSED(spl_camera_look_at(&camera, eye, target, (double[3]){0, 0, 0}, &err), "up");
    ASSERT_REFUSED(spl_camera_look_at(&camera, eye, target, (double[3]){0, 0, NAN}, &err), "up");
    ASSERT_REFUSED(spl_camera_look_at(&camera, eye, target, (double[3]){-3, -3, -3}, &err), "up");
    ASSERT_REFUSED(spl_camera_look_at(&camera, eye, target, (double[3]){3, 3, 3.000001}, &err), "up");
    /* a tenth of a millidegree off is enough for an upright image */
    struct spl_camera camera = make_intrinsics();
    assert_int_equal(spl_camera_look_at(&camera, eye, (double[3]){1, 2, 0}, (double[3]){0, 2e-6, 1}, NULL), 0);
    assert_int_equal(spl_camera_check(&camera, NULL), 0);
    /* up of any length */
    assert_int_equal(spl_camera_look_at(&camera, eye, target, (double[3]){0, 0, 1e-300}, NULL), 0);
    assert_int_equal(spl_camera_check(&camera, NULL), 0);
}

static void bad_matrix_is_refused(void **state)
{
    (void)state;
    static const struct {
        int index;
        double value;
    } faults[] = {{0, NAN}, {11, INFINITY}, {3, 2e12}, {12, 1}, {15, 0}, {0, 2}, {5, 0}, {1, 0.5}};
    for (size_t i = 0; i < sizeof faults / sizeof *faults; i++) {
        double m[16];
        make_matrix(&local, SPL_AXES_OPENCV, m);
        m[faults[i].index] = faults[i].value;
        ASSERT_REFUSED(spl_camera_set_matrix(&camera, m, SPL_AXES_OPENCV, &err), "matrix");
    }
    double mirrored[16] = {-1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1}, zero[16] = {[15] = 1};
    ASSERT_REFUSED(spl_camera_set_matrix(&camera, mirrored, SPL_AXES_OPENGL, &err), "matrix");
    ASSERT_REFUSED(spl_camera_set_matrix(&camera, zero, SPL_AXES_OPENGL, &err), "matrix");
    /* glTF's own column-major order, not transposed: the translation sits in the last row */
    double column_major[16] = {1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 4, 5, 6, 1};
    ASSERT_REFUSED(spl_camera_set_matrix(&camera, column_major, SPL_AXES_OPENGL, &err), "matrix");
}

static void bad_colmap_is_refused(void **state)
{
    (void)state;
    static const double t[3] = {1, 2, 3};
    ASSERT_REFUSED(spl_camera_set_colmap(&camera, (double[4]){0}, t, &err), "q");
    ASSERT_REFUSED(spl_camera_set_colmap(&camera, (double[4]){1, 0, NAN, 0}, t, &err), "q");
    ASSERT_REFUSED(spl_camera_set_colmap(&camera, colmap_q, (double[3]){0, 0, INFINITY}, &err), "t");
    ASSERT_REFUSED(spl_camera_set_colmap(&camera, colmap_q, (double[3]){0, -1e13, 0}, &err), "t");
}

static void check_names_the_field(void **state)
{
    (void)state;
    struct spl_camera good = make_intrinsics();
    static const double eye[3] = {1, 2, 3}, target[3] = {4, 5, 6}, up[3] = {0, 0, 1};
    assert_int_equal(spl_camera_look_at(&good, eye, target, up, NULL), 0);
    assert_int_equal(spl_camera_check(&good, NULL), 0);
#define FAULT(change, name)                                                                                            \
    do {                                                                                                               \
        struct spl_camera c = good;                                                                                    \
        struct spl_error err = {0};                                                                                    \
        change;                                                                                                        \
        assert_int_equal(spl_camera_check(&c, &err), SPL_E_INPUT);                                                     \
        assert_string_equal(err.field, name);                                                                          \
    } while (0)
    FAULT(c.eye[1] = 1.1e12, "eye");
    FAULT(c.eye[2] = NAN, "eye");
    FAULT(c.rotation[4] = NAN, "rotation");
    FAULT(c.rotation[0] += 1e-6, "rotation");
    FAULT(memset(c.rotation, 0, sizeof c.rotation), "rotation");
    FAULT(for (int i = 0; i < 3; i++) c.rotation[i] = -c.rotation[i], "rotation");
    FAULT(c.fx = 0, "fx");
    FAULT(c.fx = INFINITY, "fx");
    FAULT(c.fy = -1, "fy");
    FAULT(c.cx = NAN, "cx");
    FAULT(c.cy = INFINITY, "cy");
    FAULT(c.width = 0, "width");
    FAULT(c.height = 0, "height");
    FAULT(c.near = 0, "near");
    FAULT(c.near = INFINITY, "near");
    FAULT(c.far = c.near, "far");
    FAULT(c.far = NAN, "far");
}

/* At another size everything lies at the same share of the image, along each side. */
static void a_resized_camera_shows_the_same(void **state)
{
    (void)state;
    struct spl_camera camera = {.fx = 700, .fy = 650, .cx = 301, .cy = 262, .width = 640, .height = 480};
    const double eye[3] = {3, -2, 1}, target[3] = {0, 0, 0}, up[3] = {0, 0, 1}, point[3] = {0.3, -0.4, 0.2};
    double before[2], after[2], depth, depth_after;
    camera.near = 0.1f;
    camera.far = INFINITY;
    assert_int_equal(spl_camera_look_at(&camera, eye, target, up, NULL), 0);
    struct spl_camera resized = camera;
    spl_camera_resize(&resized, 321, 100);
    assert_int_equal(resized.width, 321);
    assert_int_equal(resized.height, 100);
    assert_true(spl_camera_project(&camera, point, before, &depth));
    assert_true(spl_camera_project(&resized, point, after, &depth_after));
    assert_true(fabs(after[0] / 321 - before[0] / 640) < 1e-12);
    assert_true(fabs(after[1] / 100 - before[1] / 480) < 1e-12);
    assert_true(depth_after == depth);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(look_at_hits_the_golden_pixel),
        cmocka_unit_test(axes_point_where_they_should),
        cmocka_unit_test(fov_means_the_vertical_edges),
        cmocka_unit_test(every_form_of_a_pose_hits_the_golden_pixel),
        cmocka_unit_test(look_at_and_matrix_agree),
        cmocka_unit_test(rough_matrices_are_made_orthonormal),
        cmocka_unit_test(bad_fov_is_refused),
        cmocka_unit_test(bad_look_at_is_refused),
        cmocka_unit_test(bad_matrix_is_refused),
        cmocka_unit_test(bad_colmap_is_refused),
        cmocka_unit_test(check_names_the_field), cmocka_unit_test(a_resized_camera_shows_the_same),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
