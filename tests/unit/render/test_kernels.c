/* A renderer keeps as many kernels as a bound says: those that were used last, and never fewer than a tile has got. */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>

#include <cmocka.h>

#include "render/kernels.h"
#include "support/fake_gpu.h"

static struct spl_gpu gpu;
static struct spl_kernels kernels;

static struct spl_gpu_kernel *get(uint32_t constant)
{
    const struct spl_kernel_key key = {.name = "shade", .constants = {constant}};
    struct spl_gpu_kernel *kernel;
    struct spl_error err = {0};
    if (spl_kernels_get(&kernels, &gpu, &key, &kernel, &err))
        fail_msg("%s", err.message);
    return kernel;
}

static int set_up(void **state)
{
    (void)state;
    gpu = fake_gpu_make((struct spl_gpu_limits){0});
    kernels = (struct spl_kernels){0};
    return 0;
}

static int tear_down(void **state)
{
    (void)state;
    spl_kernels_finish(&kernels, &gpu);
    return fake.kernels;
}

/* One a tile for ever: their number is bounded, and the one of every tile is made once. */
static void test_a_bound(void **state)
{
    (void)state;
    struct spl_gpu_kernel *always = NULL;
    for (uint32_t tile = 1; tile < 2000; tile++) {
        spl_kernels_begin(&kernels, &gpu, false);
        struct spl_gpu_kernel *same = get(0);
        assert_true(!always || same == always);
        always = same;
        get(tile);
        assert_true(fake.kernels == (int)kernels.count && fake.kernels <= SPL_KERNELS_MOST + 2);
    }
    assert_true(fake.kernels >= SPL_KERNELS_KEPT);
}

/* A tile that needs more than the bound keeps all that it has got to its end. */
static void test_a_tile_of_many(void **state)
{
    (void)state;
    struct spl_gpu_kernel *got[2 * SPL_KERNELS_MOST];
    spl_kernels_begin(&kernels, &gpu, false);
    for (uint32_t i = 0; i < 2 * SPL_KERNELS_MOST; i++)
        got[i] = get(i);
    for (uint32_t i = 0; i < 2 * SPL_KERNELS_MOST; i++)
        assert_ptr_equal(get(i), got[i]);
    spl_kernels_begin(&kernels, &gpu, false);
    assert_int_equal(fake.kernels, SPL_KERNELS_KEPT);
}

/* What was used longest ago goes. */
static void test_the_oldest_go(void **state)
{
    (void)state;
    for (uint32_t i = 0; i <= SPL_KERNELS_MOST; i++) {
        spl_kernels_begin(&kernels, &gpu, false);
        get(i);
    }
    spl_kernels_begin(&kernels, &gpu, false);
    get(1); // was among the oldest, and is used again
    const int before = fake.kernels;
    assert_int_equal(before, SPL_KERNELS_KEPT + 1);
    for (uint32_t i = SPL_KERNELS_MOST; i > SPL_KERNELS_MOST + 1 - SPL_KERNELS_KEPT; i--)
        get(i);
    assert_int_equal(fake.kernels, before); // all of them were still there
}

/* Who asks for more goes round in as many without making one twice. */
static void test_more_are_kept(void **state)
{
    (void)state;
    enum { many = 2 * SPL_KERNELS_MOST };
    struct spl_gpu_kernel *got[many];
    kernels.more = many;
    for (uint32_t round = 0; round < 2; round++)
        for (uint32_t i = 0; i < many; i++) {
            spl_kernels_begin(&kernels, &gpu, false);
            if (round)
                assert_ptr_equal(get(i), got[i]);
            got[i] = get(i);
        }
    assert_int_equal(fake.kernels, many);
    for (uint32_t i = 0; i <= many; i++) {
        spl_kernels_begin(&kernels, &gpu, false);
        get(many + i);
    }
    assert_true(fake.kernels <= SPL_KERNELS_MOST + many + 1);
}

/* Rays that are parallel are other kernels. */
static void test_parallel_ones_are_others(void **state)
{
    (void)state;
    spl_kernels_begin(&kernels, &gpu, false);
    struct spl_gpu_kernel *pinhole = get(0);
    spl_kernels_begin(&kernels, &gpu, true);
    assert_ptr_not_equal(get(0), pinhole);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test_setup_teardown(test_a_bound, set_up, tear_down),
        cmocka_unit_test_setup_teardown(test_a_tile_of_many, set_up, tear_down),
        cmocka_unit_test_setup_teardown(test_the_oldest_go, set_up, tear_down),
        cmocka_unit_test_setup_teardown(test_more_are_kept, set_up, tear_down),
        cmocka_unit_test_setup_teardown(test_parallel_ones_are_others, set_up, tear_down),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
