/* Coordinates in 32 bits are those that they were made from, to the bit, and so is all that is made of them. */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>

#include <cmocka.h>

#include "clouds.h"
#include "pack/neighbours.h"

static const struct spl_cloud_coordinates millimetres = {.step = {0.001, 0.001, 0.01}, .first = {406000, -3, 0.5}};

/* Places as a scan of the kind has them. */
static void round_to(enum spl_points_kind kind, double (*position)[3], size_t count)
{
    for (size_t i = 0; i < count; i++)
        for (int c = 0; c < 3; c++) {
            double *at = &position[i][c];
            const double step = millimetres.step[c], first = millimetres.first[c];
            volatile float rounded = (float)*at; /* GCC 12 forgets to round where it makes vectors of this */
            if (kind == SPL_POINTS_FLOATS)
                *at = (double)rounded;
            else if (kind == SPL_POINTS_STEPS)
                *at = spl_points_coordinate((double)(lrint(100 * *at / step) + 1) * step + first);
        }
}

static struct spl_points sorted(const double (*position)[3], size_t count)
{
    struct spl_points p = cloud_of(position, count);
    struct spl_stage stage = quiet_stage(1);
    assert_int_equal(spl_points_order(&p, &stage, NULL), 0);
    return p;
}

static void assert_same_neighbours(const struct spl_points *a, const struct spl_points *b, enum spl_neighbours_set set)
{
    struct spl_nearest of_a, of_b;
    spl_neighbours_limit(set);
    struct spl_neighbours *in_a = spl_neighbours_create(a, 1, NULL), *in_b = spl_neighbours_create(b, 1, NULL);
    spl_nearest_init(&of_a);
    spl_nearest_init(&of_b);
    for (size_t i = 0; i < a->count; i++) {
        spl_neighbours_find(in_a, i, 12, &of_a);
        spl_neighbours_find(in_b, i, 12, &of_b);
        assert_int_equal(of_a.count, of_b.count);
        assert_memory_equal(of_a.index, of_b.index, of_a.count * sizeof *of_a.index);
        assert_memory_equal(of_a.squared, of_b.squared, of_a.count * sizeof *of_a.squared);
    }
    spl_neighbours_destroy(in_a);
    spl_neighbours_destroy(in_b);
}

static void test_narrow_is_the_same(void **state)
{
    (void)state;
    enum { count = 8000 };
    const enum spl_neighbours_set most = spl_neighbours_limit(SPL_NEIGHBOURS_AVX512);
    struct spl_stage stage = quiet_stage(2);
    for (int shape = 0; shape < SHAPES; shape++)
        for (int kind = SPL_POINTS_DOUBLES; kind <= SPL_POINTS_STEPS; kind++) {
            double(*position)[3] = shape_points((enum shape)shape, count, 7);
            if (kind == SPL_POINTS_STEPS && shape == SHAPE_UTM) /* 100 times that is beyond 32 bits of millimetres */
                for (size_t i = 0; i < count; i++)
                    position[i][0] -= 406000, position[i][1] -= 7405000;
            round_to((enum spl_points_kind)kind, position, count);
            struct spl_points wide = sorted((const double(*)[3])position, count);
            struct spl_points narrow = sorted((const double(*)[3])position, count);
            assert_int_equal(spl_points_narrow(&narrow, &millimetres, &stage, NULL), 0);
            if (kind != SPL_POINTS_DOUBLES)
                assert_int_equal(narrow.kind, kind);
            for (int c = 0; c < 3; c++)
                for (size_t i = 0; i < wide.count; i++)
                    assert_memory_equal(&(double){spl_points_at(&narrow, c, i)}, &wide.axis[c][i], sizeof(double));
            for (int set = SPL_NEIGHBOURS_BASE; set <= (int)most; set++)
                assert_same_neighbours(&wide, &narrow, (enum spl_neighbours_set)set);
            assert_int_equal(spl_surface(&wide, 12, true, &stage, NULL), 0);
            assert_int_equal(spl_surface(&narrow, 12, true, &stage, NULL), 0);
            assert_memory_equal(wide.normal, narrow.normal, wide.count * sizeof *wide.normal);
            assert_memory_equal(wide.radius, narrow.radius, wide.count * sizeof *wide.radius);
            assert_memory_equal(wide.uncertainty, narrow.uncertainty, wide.count * sizeof *wide.uncertainty);
            assert_memory_equal(wide.clip, narrow.clip, wide.count * sizeof *wide.clip);
            spl_points_finish(&wide);
            spl_points_finish(&narrow);
            free(position);
        }
}

/* One coordinate that is something else, at the end and of the last axis: nothing is kept as less than it is. */
static void test_one_that_differs_keeps_all(void **state)
{
    (void)state;
    enum { count = 3 };
    static const double others[] = {0.1, 1e10 + 0.1, 0.5 + 1e-9};
    struct spl_stage stage = quiet_stage(1);
    for (size_t o = 0; o < sizeof others / sizeof *others; o++) {
        const double position[count][3] = {{406000, -3, 0.5}, {406000.5, -3, 0.5}, {406001, -3, others[o]}};
        struct spl_points p = cloud_of(position, count);
        assert_int_equal(spl_points_narrow(&p, o ? &millimetres : NULL, &stage, NULL), 0);
        assert_int_equal(p.kind, SPL_POINTS_DOUBLES);
        assert_true(p.axis[2][2] == others[o]);
        spl_points_finish(&p);
    }
}

/* As they are read, batch by batch: narrow until a coordinate is something else, then all of them are doubles. */
static void test_read_narrow_until_one_differs(void **state)
{
    (void)state;
    enum { count = 1000, batch = 300 };
    for (int kind = SPL_POINTS_FLOATS; kind <= SPL_POINTS_STEPS; kind++)
        for (size_t odd = 0; odd <= count; odd += 250) { /* the first one, some, and none */
            double(*position)[3] = shape_points(SHAPE_PLANE, count, 7);
            round_to((enum spl_points_kind)kind, position, count);
            position[1][0] = -0.0;
            if (odd < count)
                position[odd][2] = 0.5 + 1e-9;
            struct spl_points p = {.capacity = count};
            spl_points_begin_narrow(&p, kind == SPL_POINTS_STEPS ? &millimetres : NULL);
            assert_int_equal(p.kind, kind);
            for (int c = 0; c < 3; c++)
                p.floats[c] = malloc((count + SPL_POINTS_PAD) * sizeof(float));
            for (size_t i = 0, some; i < count; i += some) {
                some = count - i < batch ? count - i : batch;
                assert_int_equal(spl_points_put(&p, (const double(*)[3])position + i, some, NULL), SPL_OK);
                p.count += some;
                assert_int_equal(p.kind, odd < i + some ? SPL_POINTS_DOUBLES : kind);
            }
            for (size_t i = 0; i < count; i++)
                for (int c = 0; c < 3; c++)
                    assert_true(spl_points_at(&p, c, i) == position[i][c]);
            assert_false(signbit(spl_points_at(&p, 0, 1)));
            spl_points_finish(&p);
            free(position);
        }
}

int main(void)
{
    const struct CMUnitTest tests[] = {cmocka_unit_test(test_narrow_is_the_same),
                                       cmocka_unit_test(test_one_that_differs_keeps_all),
                                       cmocka_unit_test(test_read_narrow_until_one_differs)};
    return cmocka_run_group_tests(tests, NULL, NULL);
}
