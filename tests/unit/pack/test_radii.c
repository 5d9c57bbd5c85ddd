/* Radii where densities differ by far: of a floor with densely scanned spots, of what a tripod sees, of strays. */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>

#include <cmocka.h>

#include "clouds.h"
#include "pack/order.h"

/* Radii by who they are of. */
static double *radii_of(const double (*position)[3], size_t count)
{
    double *radius = calloc(count, sizeof *radius);
    struct spl_points p = cloud_of(position, count);
    struct spl_stage stage = quiet_stage(2);
    assert_int_equal(spl_points_order(&p, &stage, NULL), 0);
    assert_int_equal(spl_surface(&p, 12, true, &stage, NULL), 0);
    for (size_t i = 0; i < p.count; i++)
        radius[p.color_class[i]] = p.radius[i];
    spl_points_finish(&p);
    return radius;
}

/* A floor of 1000 points a square metre and targets of 5 cm with thousands: what lies half a metre away, and is beside
 * them in order, has the radii that it has without them. */
static void test_dense_spots_leave_the_floor_alone(void **state)
{
    (void)state;
    enum { floor_points = 40000, targets = 3, most = 10000 };
    static const double place[targets][2] = {{3.2, 3.2}, {1.1, 4.4}, {5.2, 0.9}};
    static const size_t points[targets] = {3000, 6000, most};
    double(*position)[3] = malloc((floor_points + targets * most) * sizeof *position);
    uint64_t random = 21;
    size_t count = floor_points, away = 0, other = 0;
    for (size_t i = 0; i < floor_points; i++) {
        position[i][0] = 6.3 * uniform(&random);
        position[i][1] = 6.3 * uniform(&random);
        position[i][2] = 0.002 * uniform(&random);
    }
    for (int t = 0; t < targets; t++)
        for (size_t i = 0; i < points[t]; i++, count++)
            for (int c = 0; c < 3; c++)
                position[count][c] = (c < 2 ? place[t][c] : 0) + (c < 2 ? 0.05 : 0.002) * uniform(&random);
    double *alone = radii_of((const double(*)[3])position, floor_points);
    double *beside = radii_of((const double(*)[3])position, count);
    for (size_t i = 0; i < floor_points; i++) {
        double x = position[i][0], y = position[i][1];
        bool near = fmin(x, y) < 0.2 || fmax(x, y) > 6.1; /* the floor's border */
        for (int t = 0; t < targets; t++)
            near |= hypot(x - place[t][0], y - place[t][1]) < 0.5;
        away += !near;
        other += !near && fabs(beside[i] / alone[i] - 1) > 0.02;
    }
    printf("%zu of %zu points have another radius for dense spots elsewhere\n", other, away);
    assert_true(500 * other < away); /* as good as none: empty places of a random floor look like borders */
    free(alone);
    free(beside);
    free(position);
}

/* What a tripod sees of the floor: its points are as large as their density says at any distance. */
static void test_radii_follow_the_density(void **state)
{
    (void)state;
    enum { rays = 200000 };
    const double height = 1.7, share = rays / (2 * M_PI) * height;
    double(*position)[3] = malloc(rays * sizeof *position);
    uint64_t random = 33;
    size_t count = 0, judged = 0, specks = 0;
    for (size_t i = 0; i < rays; i++) {
        double down = uniform(&random), angle = 2 * M_PI * uniform(&random);
        double r = height * sqrt(1 - down * down) / fmax(down, 1e-9);
        if (r > 40)
            continue;
        position[count][0] = r * cos(angle);
        position[count][1] = r * sin(angle);
        position[count++][2] = 0.002 * uniform(&random);
    }
    double *radius = radii_of((const double(*)[3])position, count);
    for (size_t i = 0; i < count; i++) {
        double r2 = position[i][0] * position[i][0] + position[i][1] * position[i][1];
        double expected = 2 * sqrt(pow(r2 + height * height, 1.5) / (M_PI * share));
        if (r2 > 30 * 30)
            continue;
        judged++;
        specks += radius[i] < 0.5 * expected;
    }
    printf("%zu of %zu discs are specks\n", specks, judged);
    assert_true(2000 * specks < judged);
    free(radius);
    free(position);
}

/* Strays that happen to lie flat are too few to be a floor. */
static void test_a_flat_flock_is_no_floor(void **state)
{
    (void)state;
    enum { grid = 10000, side = 8, count = grid + side * side };
    double(*position)[3] = shape_points(SHAPE_GRID, count, 1);
    uint64_t random = 9;
    for (size_t i = grid; i < count; i++) {
        position[i][0] = 20 + 5 * ((double)((i - grid) % side) + uniform(&random));
        position[i][1] = 20 + 5 * ((double)((i - grid) / side) + uniform(&random));
        position[i][2] = 0;
    }
    double *radius = radii_of((const double(*)[3])position, count);
    for (size_t i = grid; i < count; i++)
        assert_true(radius[i] < 1);
    free(radius);
    free(position);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_dense_spots_leave_the_floor_alone),
        cmocka_unit_test(test_radii_follow_the_density),
        cmocka_unit_test(test_a_flat_flock_is_no_floor),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
