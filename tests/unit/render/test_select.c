/* What level selection says of nodes that are not there. */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <cmocka.h>

#include "render/select.h"
#include "support/make_dataset.h"

enum { side = 40 };

/* Grants as many nodes as are left. */
static bool take_one(void *context, uint32_t page)
{
    int *left = context;
    (void)page;
    return (*left)-- > 0;
}

static void a_spacing_of_stand_ins_is_not_complete(void **state)
{
    (void)state;
    static struct make_splat splats[side * side];
    for (int i = 0; i < side * side; i++)
        splats[i] =
            (struct make_splat){.position = {i % side * 0.1, i / side * 0.1, 0}, .normal = {0, 0, 1}, .radius = 0.05f};
    struct spl_dataset *dataset = make_dataset_levels(splats, side * side, 2);
    struct spl_view view;
    spl_view_init(&view);
    view.camera.near = 0.1;
    view.camera.far = 100;
    const double eye[3] = {2, 2, 8}, target[3] = {2, 2, 0}, up[3] = {0, 1, 0};
    assert_int_equal(spl_camera_look_at(&view.camera, eye, target, up, NULL), SPL_OK);
    assert_int_equal(spl_camera_set_fov(&view.camera, 40, 256, 256, NULL), SPL_OK);
    int left = 1000;
    struct spl_select_params params = {
        .dataset = dataset, .camera = &view.camera, .lod = 1, .resident = take_one, .context = &left};
    double fine, coarse;
    bool complete = true;
    assert_int_equal(spl_select_spacing(&params, &fine, &complete, NULL), SPL_OK);
    assert_true(complete);
    left = 1; /* the root */
    assert_int_equal(spl_select_spacing(&params, &coarse, &complete, NULL), SPL_OK);
    assert_false(complete);
    assert_true(coarse > fine);
    left = 1000;
    assert_int_equal(spl_select_spacing(&params, &fine, &complete, NULL), SPL_OK);
    assert_false(complete); /* what another part of the frame said stands */
    spl_dataset_close(dataset);
}

int main(void)
{
    const struct CMUnitTest tests[] = {cmocka_unit_test(a_spacing_of_stand_ins_is_not_complete)};
    return cmocka_run_group_tests(tests, NULL, NULL);
}
