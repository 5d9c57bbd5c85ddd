/* What can be seen of a box: none whose points are on the image is called out of view, whatever the camera; and a box
 * that lies beside the image is called so though a box around it, along the camera's axes, reaches into it. */
#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <stdlib.h>

#include <cmocka.h>

#include "render/frustum.h"

static uint64_t random_state = 1;
static double uniform(void)
{
    random_state = random_state * 6364136223846793005u + 1442695040888963407u;
    return (double)(random_state >> 11) / (double)(1ull << 53);
}

static double within(double reach)
{
    return reach * (2 * uniform() - 1);
}

static struct spl_camera any_camera(bool parallel)
{
    struct spl_camera camera = {0};
    const double eye[3] = {within(50), within(50), within(50)}, target[3] = {within(50), within(50), within(50)};
    assert_int_equal(spl_camera_set_fov(&camera, 20 + 100 * uniform(), 200, 150, NULL), SPL_OK);
    assert_int_equal(spl_camera_look_at(&camera, eye, target, (double[3]){0.1, 0.2, 1}, NULL), SPL_OK);
    camera.near = 5 * uniform();
    camera.far = uniform() < 0.5 ? INFINITY : camera.near + 60 * uniform();
    if (parallel) {
        camera.projection = SPL_ORTHOGRAPHIC;
        camera.fx = camera.fy = 200 / (10 + 40 * uniform());
    }
    return camera;
}

static bool is_on_the_image(const struct spl_camera *camera, const double p[3], double pad)
{
    double v[3];
    for (int i = 0; i < 3; i++)
        v[i] = camera->rotation[3 * i] * p[0] + camera->rotation[3 * i + 1] * p[1] + camera->rotation[3 * i + 2] * p[2];
    if (v[2] < camera->near || v[2] > camera->far)
        return false;
    const double scale = camera->projection == SPL_ORTHOGRAPHIC ? 1 : v[2];
    const double x = v[0] / scale * camera->fx + camera->cx, y = v[1] / scale * camera->fy + camera->cy;
    return x >= -pad && x <= camera->width + pad && y >= -pad && y <= camera->height + pad;
}

static void what_is_seen_is_met(void **state)
{
    (void)state;
    unsigned seen = 0, met = 0, loose = 0;
    for (unsigned i = 0; i < 20000; i++) {
        const struct spl_camera camera = any_camera(i % 3 == 0);
        double least[3], size[3];
        bool any = false;
        for (int a = 0; a < 3; a++) {
            size[a] = 40 * uniform() * uniform();
            least[a] = within(60) - camera.eye[a];
        }
        for (unsigned k = 0; k < 200 && !any; k++) {
            double p[3];
            for (int a = 0; a < 3; a++)
                p[a] = least[a] + size[a] * (k < 8 ? k >> a & 1 : uniform());
            any = is_on_the_image(&camera, p, 3);
        }
        const bool meets = spl_frustum_meets(&camera, least, size, 3);
        const struct spl_view_box box = spl_view_box(&camera, least, size);
        assert_true(meets || !any);
        assert_true(!meets || spl_view_box_visible(&camera, &box, 3)); // and closer than that
        seen += any;
        met += meets;
        loose += spl_view_box_visible(&camera, &box, 3);
    }
    assert_true(seen > 3000 && met < seen + seen / 10 && loose > met + met / 20);
}

static void a_point_is_met_where_it_is_seen(void **state)
{
    (void)state;
    for (unsigned i = 0; i < 20000; i++) {
        const struct spl_camera camera = any_camera(i % 2);
        const double p[3] = {within(60), within(60), within(60)};
        assert_int_equal(spl_frustum_meets(&camera, p, (double[3]){0}, 0), is_on_the_image(&camera, p, 0));
    }
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(what_is_seen_is_met),
        cmocka_unit_test(a_point_is_met_where_it_is_seen),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
