/* A renderer keeps as many kernels as a bound says: those in use, most of what comes round, and never fewer than a tile
 * has got. */
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
    assert_true(fake.kernels >= SPL_KERNELS_MOST);
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
    assert_int_equal(fake.kernels, SPL_KERNELS_MOST);
}

/* What some tiles use now and then is made once, whatever others come and go between. */
static void test_those_in_use_stay(void **state)
{
    (void)state;
    enum { in_use = 16, tiles = 20 * SPL_KERNELS_MOST };
    const int before = fake.kernels_made;
    for (uint32_t tile = 0; tile < tiles; tile++) {
        spl_kernels_begin(&kernels, &gpu, false);
        get(tile % in_use);
        get(in_use + tile);
    }
    assert_int_equal(fake.kernels_made - before, in_use + tiles);
}

/* Who goes round in a quarter more than are kept has most of them made once, not each anew in every round. */
static void test_rounds_of_more_than_are_kept(void **state)
{
    (void)state;
    enum { many = SPL_KERNELS_MOST * 5 / 4, rounds = 10 };
    int before = 0;
    for (uint32_t i = 0; i < rounds * many; i++) {
        spl_kernels_begin(&kernels, &gpu, false);
        get(i % many);
        before = i == 2 * many ? fake.kernels_made : before;
    }
    assert_in_range(fake.kernels_made - before, 1, (rounds - 2) * many / 2);
}

/* What nobody wants any more, however often it was used, gives its room to what comes round now. */
static void test_others_take_their_place(void **state)
{
    (void)state;
    enum { many = SPL_KERNELS_MOST / 2, rounds = 10 };
    for (uint32_t i = 0; i < rounds * SPL_KERNELS_MOST; i++) {
        spl_kernels_begin(&kernels, &gpu, false);
        get(i % SPL_KERNELS_MOST);
    }
    const int before = fake.kernels_made;
    for (uint32_t i = 0; i < rounds * many; i++) {
        spl_kernels_begin(&kernels, &gpu, false);
        get(SPL_KERNELS_MOST + i % many);
    }
    assert_in_range(fake.kernels_made - before, many, rounds * many / 3);
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
        cmocka_unit_test_setup_teardown(test_those_in_use_stay, set_up, tear_down),
        cmocka_unit_test_setup_teardown(test_rounds_of_more_than_are_kept, set_up, tear_down),
        cmocka_unit_test_setup_teardown(test_others_take_their_place, set_up, tear_down),
        cmocka_unit_test_setup_teardown(test_more_are_kept, set_up, tear_down),
        cmocka_unit_test_setup_teardown(test_parallel_ones_are_others, set_up, tear_down),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
