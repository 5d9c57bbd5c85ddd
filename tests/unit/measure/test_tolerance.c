/* How far off a depth may be: what is drawn there says it, a splat by its radius, a panel by that of a cell's disc. */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <cmocka.h>

#include "measure/tolerance.h"
#include "support/make_dataset.h"

static void test_what_is_drawn_says_how_far(void **state)
{
    (void)state;
    struct spl_panel panel = {.column = 0};
    for (int y = 0; y < SPL_PANEL_SIDE; y++)
        panel.cells[y] = UINT16_MAX;
    const struct make_splat splats[] = {{.position = {-1, 0, 0}, .normal = {0, 0, 1}, .radius = 0.3f},
                                        {.position = {1, 0, 0}, .normal = {0, 0, 1}, .radius = 0.3f}};
    const struct make_panels made = {
        .plane = {.normal = {0, 0, 1}, .cell = 0.01f, .points = 256}, .panels = &panel, .count = 1};
    struct spl_dataset *dataset = make_dataset_panels(splats, 2, &made, 1, 1);
    struct spl_tolerance *tolerance;
    struct spl_view view;
    uint32_t ids[] = {0, 2, UINT32_MAX};
    float depths[] = {5, 5, 0}, out[3];
    const struct spl_image id = {SPL_LAYER_ID, SPL_PIXEL_U32, 3, 1, ids};
    const struct spl_image depth = {SPL_LAYER_DEPTH, SPL_PIXEL_F32, 3, 1, depths};
    spl_view_init(&view);
    view.lod = 0;
    assert_int_equal(spl_tolerance_create(dataset, &tolerance, NULL), SPL_OK);
    spl_tolerance_fill(tolerance, &view, &id, &depth, 1, out);
    assert_float_equal(out[0], 0.3, 0.02);
    assert_float_equal(out[1], 0.01 * SPL_RADIUS_SPACING, 1e-6); /* not that of the whole panel */
    assert_float_equal(out[2], spl_dataset_get_info(dataset)->splat_radius, 1e-6);
    spl_tolerance_destroy(tolerance);
    spl_dataset_close(dataset);
}

int main(void)
{
    const struct CMUnitTest tests[] = {cmocka_unit_test(test_what_is_drawn_says_how_far)};
    return cmocka_run_group_tests(tests, NULL, NULL);
}
