/* Which layers a dataset has; what is no method, and no name of one. */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <string.h>

#include <cmocka.h>

#include <splatd/render.h>

#include "render/method.h"

static const char *refusal(enum spl_method method, enum spl_layer layer, bool surface, uint64_t splats)
{
    static struct spl_error err;
    struct spl_dataset_info info = {.id = "hall", .has_surface = surface, .splats = splats, .ids = splats};
    struct spl_view view;
    spl_view_init(&view);
    view.method = method;
    view.layers = 1u << SPL_LAYER_COLOR | 1u << layer;
    err = (struct spl_error){0};
    int rc = spl_view_check_layers(&view, &info, &err);
    assert_true(rc == SPL_OK ? !*err.message : rc == SPL_E_INPUT && !strcmp(err.field, "layer"));
    return err.message;
}

static void test_normals_need_a_surface(void **state)
{
    (void)state;
    assert_string_equal(refusal(SPL_METHOD_POINTS, SPL_LAYER_NORMAL, true, 1), "");
    assert_string_equal(refusal(SPL_METHOD_FILL, SPL_LAYER_NORMAL, false, 1), "");
    assert_string_equal(refusal(SPL_METHOD_POINTS, SPL_LAYER_DEPTH, false, 1), "");
    assert_non_null(strstr(refusal(SPL_METHOD_POINTS, SPL_LAYER_NORMAL, false, 1), "'hall' has no normals"));
}

/* The last word of the id layer says that nothing is there. */
static void test_ids_have_32_bits(void **state)
{
    (void)state;
    for (int method = 0; method < SPL_METHOD_COUNT; method++) {
        assert_string_equal(refusal((enum spl_method)method, SPL_LAYER_ID, true, UINT32_MAX), "");
        assert_non_null(
            strstr(refusal((enum spl_method)method, SPL_LAYER_ID, true, 1ull << 32), "has 4294967296 splats"));
        assert_non_null(strstr(refusal((enum spl_method)method, SPL_LAYER_ID, true, 10000000000), "32 bits"));
        assert_string_equal(refusal((enum spl_method)method, SPL_LAYER_DEPTH, true, 10000000000), "");
    }
}

/* What the camera's own functions leave out, the view has. */
static void test_a_camera_is_whole_with_a_lens_and_a_pose(void **state)
{
    (void)state;
    struct spl_view view;
    spl_view_init(&view);
    assert_int_equal(spl_camera_set_fov(&view.camera, 60, 64, 36, NULL), SPL_OK);
    assert_int_equal(
        spl_camera_look_at(&view.camera, (double[3]){1, 2, 3}, (double[3]){0, 0, 0}, (double[3]){0, 0, 1}, NULL),
        SPL_OK);
    assert_int_equal(spl_view_check(&view, NULL), SPL_OK);
}

/* From other languages an enum is any number, and a name may be NULL. */
static void test_what_is_no_method_is_answered(void **state)
{
    (void)state;
    static const int none[] = {-1, SPL_METHOD_COUNT, 99};
    const struct spl_dataset_info bare = {.splats = 1};
    for (size_t i = 0; i < sizeof none / sizeof *none; i++) {
        enum spl_method method = (enum spl_method)none[i];
        assert_string_equal(spl_method_name(method), "unknown");
        assert_null(spl_method_get(method));
        assert_false(spl_method_has_textures(method));
        assert_false(spl_method_has_normals(method, &bare));
        assert_int_equal(spl_method_get_params(method), 0);
        assert_int_equal(spl_method_for(method, &bare), method);
    }
    assert_null(spl_method_param_get((enum spl_method_param)99));
    assert_string_equal(spl_visibility_name((enum spl_visibility)99), "unknown");
    assert_string_equal(spl_maps_name((enum spl_maps)99), "unknown");
    assert_string_equal(spl_attribute_name((enum spl_attribute)99), "unknown");
    assert_int_equal(spl_method_from_name(NULL), -1);
    assert_int_equal(spl_method_param_from_name(NULL), -1);
    assert_int_equal(spl_visibility_from_name(NULL), -1);
    assert_int_equal(spl_maps_from_name(NULL), -1);
}

/* Maps are drawn where nobody says otherwise, by a caller whose view ends before them too. */
static void test_maps_are_on_unless_told(void **state)
{
    (void)state;
    struct spl_view view;
    spl_view_init(&view);
    assert_int_equal(view.maps, SPL_MAPS_ON);
    assert_true(spl_method_get_params(SPL_METHOD_SPLAT) & SPL_PARAM_BIT(maps));
    assert_true(spl_method_get_params(SPL_METHOD_NEAREST) & SPL_PARAM_BIT(maps));
    assert_false(spl_method_get_params(SPL_METHOD_POINTS) & SPL_PARAM_BIT(maps));
    const struct spl_method_param_info *maps = spl_method_param_get(SPL_PARAM_maps);
    assert_int_equal(maps->changes, SPL_CHANGES_MAPS);
    assert_int_equal(maps->choice_from_name("off"), SPL_MAPS_OFF);
    assert_int_equal(maps->choice_from_name("of"), -1);
    spl_view_set_param(&view, SPL_PARAM_maps, SPL_MAPS_OFF);
    assert_int_equal(view.maps, SPL_MAPS_OFF);
    assert_true(spl_method_param_check(maps, spl_view_get_param(&view, SPL_PARAM_maps), NULL) == SPL_OK);
    assert_true(spl_method_param_check(maps, SPL_MAPS_COUNT, NULL) < 0);
}

/* Where a dataset has nothing that a parameter changes, views with any value of it are one. */
static void test_what_a_dataset_lacks_does_not_count(void **state)
{
    (void)state;
    const struct spl_dataset_info plain = {.splats = 1};
    const struct {
        enum spl_method_param param;
        struct spl_dataset_info has;
    } rows[] = {{SPL_PARAM_atoms, {.atoms = 1}},
                {SPL_PARAM_maps, {.maps = 1}},
                {SPL_PARAM_primitives, {.panels = 1}},
                {SPL_PARAM_primitives, {.pieces = 1}}};
    for (size_t i = 0; i < sizeof rows / sizeof *rows; i++) {
        assert_false(spl_method_param_counts(spl_method_param_get(rows[i].param), &plain));
        assert_true(spl_method_param_counts(spl_method_param_get(rows[i].param), &rows[i].has));
        assert_true(spl_method_param_counts(spl_method_param_get(SPL_PARAM_margin), &rows[i].has));
    }
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_normals_need_a_surface),
        cmocka_unit_test(test_ids_have_32_bits),
        cmocka_unit_test(test_what_a_dataset_lacks_does_not_count),
        cmocka_unit_test(test_what_is_no_method_is_answered),
        cmocka_unit_test(test_maps_are_on_unless_told),
        cmocka_unit_test(test_a_camera_is_whole_with_a_lens_and_a_pose),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
