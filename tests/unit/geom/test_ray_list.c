/* Lists of rays: what they refuse, how densely they are taken to lie, and the faces that they are looked up in. */
#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <stdlib.h>
#include <string.h>
#include <cmocka.h>

#include "base/error.h"
#include "geom/faces.h"
#include "geom/ray_list.h"

static void what_points_nowhere_is_named(void **state)
{
    (void)state;
    static const struct {
        double v[3];
        const char *says;
    } rows[] = {
        {{0, 0, 0}, "directions[2] is 0, 0, 0: it points nowhere"},
        {{0, -0.0, 0}, "it points nowhere"},
        {{0, 0, NAN}, "directions[2] is 0, 0, nan: its numbers must be finite"},
        {{INFINITY, 0, 1}, "directions[2] is inf, 0, 1"},
    };
    for (size_t i = 0; i < sizeof rows / sizeof *rows; i++) {
        double list[4][3] = {{0, 0, 1}, {0, 0, 1}, {0}, {1, 0, 0}};
        struct spl_error err = {0};
        struct spl_rays *rays = (void *)list;
        memcpy(list[2], rows[i].v, sizeof list[2]);
        assert_int_equal(spl_rays_create(list[0], 4, &rays, &err), SPL_E_INPUT);
        assert_null(rays);
        assert_string_equal(err.field, "directions");
        assert_non_null(strstr(err.message, rows[i].says));
    }
    struct spl_error err = {0};
    struct spl_rays *rays;
    assert_int_equal(spl_rays_create(NULL, 0, &rays, &err), SPL_E_INPUT);
    // which reads none
    assert_int_equal(spl_rays_create((double[3]){0, 0, 1}, SPL_RAYS_MAX + 1, &rays, &err), SPL_E_INPUT);
    spl_rays_destroy(NULL);
}

static void lengths_do_not_matter(void **state)
{
    (void)state;
    static const double tiny = 4e-320, huge = 1.7e308;
    const double list[3][3] = {{3 * tiny, 0, 4 * tiny}, {0.6 * huge, 0, 0.8 * huge}, {3, 0, 4}};
    struct spl_rays *rays;
    assert_int_equal(spl_rays_create(list[0], 3, &rays, NULL), SPL_OK);
    for (int i = 0; i < 3; i++) {
        assert_true(fabs(rays->directions[i][0] - 0.6) < 1e-3 && fabs(rays->directions[i][2] - 0.8) < 1e-3);
        assert_true(fabs(hypot(rays->directions[i][0], rays->directions[i][2]) - 1) < 1e-12);
    }
    spl_rays_destroy(spl_rays_ref(rays));
    assert_true(rays->count == 3); // the other owner's
    spl_rays_destroy(rays);
}

/* A square of side x side rays, so many to a radian; `seed`: in another order. */
static struct spl_rays *square(int side, double dense, int seed)
{
    double (*list)[3] = calloc((size_t)side * (size_t)side, sizeof *list);
    struct spl_rays *rays = NULL;
    assert_non_null(list);
    for (int i = 0; i < side * side; i++) {
        const int at = seed ? (int)((int64_t)i * 7919 % (side * side)) : i;
        list[i][0] = (at % side - side / 2) / dense;
        list[i][1] = (at / side - side / 2) / dense;
        list[i][2] = 1;
    }
    assert_int_equal(spl_rays_create(list[0], (size_t)side * (size_t)side, &rays, NULL), SPL_OK);
    free(list);
    return rays;
}

static void resolution_follows_density(void **state)
{
    (void)state;
    static const struct {
        double dense, resolution;
    } rows[] = {{30, 256}, {250, 256}, {500, 512}, {1000, 1024}, {5000, 1024}};
    for (size_t i = 0; i < sizeof rows / sizeof *rows; i++)
        for (int seed = 0; seed < 2; seed++) {
            struct spl_rays *rays = square(41, rows[i].dense, seed);
            struct spl_camera camera;
            assert_true(rays->resolution == rows[i].resolution || (i == 4 && rays->resolution <= 1024));
            assert_int_equal(spl_camera_set_rays(&camera, rays, 0, NULL), SPL_OK);
            assert_true(camera.fx == rays->resolution && camera.height == 41 * 41 && camera.width == 1);
            spl_rays_destroy(rays);
        }
    struct spl_rays *rays = square(2, 1, 0);
    struct spl_camera camera;
    static const double bad[] = {0.5, -1, 1e5, NAN, INFINITY};
    for (size_t i = 0; i < sizeof bad / sizeof *bad; i++) {
        struct spl_error err = {0};
        assert_int_equal(spl_camera_set_rays(&camera, rays, bad[i], &err), SPL_E_INPUT);
        assert_string_equal(err.field, "resolution");
    }
    spl_rays_destroy(rays);
}

/* Each ray lies within its face, a margin from its edge; faces that none goes through are not there. */
static void faces_hold_their_rays(void **state)
{
    (void)state;
    const double list[][3] = {{0, 0, 1}, {0.3, -0.2, 1}, {1, 0.1, 0.2}, {1, 1, 1}, {0.1, 0.2, -4}};
    enum { count = sizeof list / sizeof *list };
    struct spl_rays *rays;
    struct spl_camera camera = {.rotation = {1, 0, 0, 0, 1, 0, 0, 0, 1}, .near = 0.1, .far = INFINITY};
    struct spl_faces faces;
    assert_int_equal(spl_rays_create(list[0], count, &rays, NULL), SPL_OK);
    assert_int_equal(spl_camera_set_rays(&camera, rays, 100, NULL), SPL_OK);
    assert_int_equal(spl_camera_check(&camera, NULL), SPL_OK);
    assert_int_equal(spl_faces_init_of(&faces, &camera, rays, 4096, NULL), SPL_OK);
    for (int i = 0; i < count; i++) {
        double pixel[2], along;
        const struct spl_camera *face = &faces.cameras[spl_faces_place(&faces, list[i], pixel, &along)];
        for (int k = 0; k < 2; k++)
            assert_true(pixel[k] >= SPL_FACE_MARGIN && pixel[k] <= (k ? face->height : face->width) - SPL_FACE_MARGIN);
    }
    assert_true(!faces.cameras[1].width && !faces.cameras[2].width && !faces.cameras[3].width &&
                faces.cameras[5].width);
    assert_true(spl_faces_get_pixels(&faces) < 20000);
    struct spl_error err = {0};
    assert_int_equal(spl_faces_init_of(&faces, &camera, rays, 60, &err), SPL_E_LIMIT);
    assert_string_equal(err.field, "resolution");
    double ray[3], pixel[2], depth;
    assert_false(spl_camera_get_ray(&camera, 0.5, 0.5, ray));
    assert_false(spl_camera_project(&camera, (double[]){0, 0, 3}, pixel, &depth));
    assert_int_equal(spl_projection_from_name("rays"), -1);
    spl_rays_destroy(rays);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(what_points_nowhere_is_named),
        cmocka_unit_test(lengths_do_not_matter),
        cmocka_unit_test(resolution_follows_density),
        cmocka_unit_test(faces_hold_their_rays),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
