/* Which layers a dataset has. */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <string.h>

#include <cmocka.h>

#include <splatd/render.h>

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

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_normals_need_a_surface),
        cmocka_unit_test(test_ids_have_32_bits),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
