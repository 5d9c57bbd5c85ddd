/* Radii where densities differ by far: of a floor with densely scanned spots, of what a tripod sees, of strays. */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>

#include <cmocka.h>

#include "clouds.h"
#include "pack/linear.h"
#include "pack/order.h"

/* Radii by who they are of, negative ones of what is linear where that is asked for. */
static double *radii_with(const double (*position)[3], size_t count, bool linear)
{
    double *radius = calloc(count, sizeof *radius);
    struct spl_points p = cloud_of(position, count);
    struct spl_stage stage = quiet_stage(2);
    assert_int_equal(spl_points_order(&p, &stage, NULL), 0);
    if (linear)
        assert_int_equal(spl_linear_find(&p, &stage, NULL), 0);
    assert_int_equal(spl_surface(&p, 12, true, &stage, NULL), 0);
    for (size_t i = 0; i < p.count; i++)
        radius[p.color_class[i]] = p.linear && p.linear[i] ? -(double)p.radius[i] : (double)p.radius[i];
    spl_points_finish(&p);
    return radius;
}

static double *radii_of(const double (*position)[3], size_t count)
{
    return radii_with(position, count, false);
}

static int by_size(const void *a, const void *b)
{
    double p = *(const double *)a, q = *(const double *)b;
    return (p > q) - (p < q);
}

/* A place with noise. */
static void put(double position[3], double x, double y, double z, double noise, uint64_t *random)
{
    const double at[3] = {x, y, z};
    for (int c = 0; c < 3; c++)
        position[c] = at[c] + noise * (uniform(random) + uniform(random) - 1);
}

/* Ground of 40 m by 24 m, its points so far apart. */
static size_t put_ground(double (*position)[3], double spacing, uint64_t *random)
{
    size_t count = 0;
    for (double x = -20; x < 20; x += spacing)
        for (double y = -12; y < 12; y += spacing, count++)
            put(position[count], x + spacing * uniform(random), y, 0, 0.01, random);
    return count;
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

/* Up to four wires beside and above each other, over ground: their points' discs reach over the next one, not to the
 * next wire, as if each hung alone. */
static void test_wires_beside_each_other_are_as_thin_as_one(void **state)
{
    (void)state;
    enum { most = 200000, wire_most = 20000 };
    static const struct {
        int wires;
        double apart, spacing, ground;
    } rows[] = {{1, 0, 0.1, 0.2}, {2, 2, 0.4, 0.2}, {3, 2, 0.4, 0.2}, {4, 2, 0.4, 0.2}, {2, 1, 0.2, 0.2},
                {4, 1.5, 0.2, 0.25}, {2, 2, 0.3, 0.3}};
    double(*position)[3] = malloc(most * sizeof *position), *sizes = malloc(wire_most * sizeof *sizes);
    for (size_t row = 0; row < sizeof rows / sizeof *rows; row++)
        for (uint64_t seed = 1; seed <= 3; seed++) {
            uint64_t random = 2 * seed + 1;
            const double spacing = rows[row].spacing;
            size_t ground = put_ground(position, rows[row].ground, &random), count = ground, wires = 0;
            for (int w = 0; w < rows[row].wires; w++)
                for (double x = -18; x < 18; x += spacing * (0.5 + uniform(&random)), count++)
                    put(position[count], x, 0.3 * x + rows[row].apart * (w & 1),
                        8 + 0.002 * x * x + rows[row].apart * (w >> 1), 0.05 * spacing, &random);
            assert_true(count < most && count - ground < wire_most);
            double *radius = radii_with((const double(*)[3])position, count, true);
            for (size_t i = ground; i < count; i++)
                sizes[wires++] = fabs(radius[i]);
            for (size_t i = 0; i < ground; i++)
                assert_true(radius[i] > 0);
            qsort(sizes, wires, sizeof *sizes, by_size);
            printf("%d wires %.1f m apart, points %.2f m: radii %.2f, 9 of 10 up to %.2f spacings\n", rows[row].wires,
                   rows[row].apart, spacing, sizes[wires / 2] / spacing, sizes[wires * 9 / 10] / spacing);
            assert_true(sizes[wires / 2] > 0.6 * spacing && sizes[wires / 2] < 1.1 * spacing);
            assert_true(sizes[wires * 9 / 10] < 1.6 * spacing);
            free(radius);
        }
    free(position);
    free(sizes);
}

/* A pole of 16 cm, in twelve columns of points: its discs close it from column to column. */
static void test_poles_stay_closed(void **state)
{
    (void)state;
    enum { most = 200000 };
    double(*position)[3] = malloc(most * sizeof *position);
    uint64_t random = 5;
    size_t ground = put_ground(position, 0.15, &random), count = ground, on = 0, open = 0;
    for (double z = 0.2; z < 6; z += 0.01)
        for (int k = 0; k < 12; k++, count++)
            put(position[count], 0.08 * cos(k * M_PI / 6), 0.08 * sin(k * M_PI / 6), z, 0.002, &random);
    double *radius = radii_with((const double(*)[3])position, count, true);
    for (size_t i = ground; i < count; i++) {
        on += radius[i] < 0;
        open += fabs(radius[i]) < 0.022; /* half the way to the next column */
    }
    printf("%zu of %zu points on a pole, %zu of them too small\n", on, count - ground, open);
    assert_true(2 * on > count - ground && 100 * open < count - ground);
    free(radius);
    free(position);
}

/* Far scan lines, of which the outermost may be taken for wires: as from a tripod, ever farther apart. What is taken
 * for one stays thin, but that is little. */
static void test_the_last_scan_lines_stay_closed(void **state)
{
    (void)state;
    enum { most = 200000 };
    double(*position)[3] = malloc(most * sizeof *position);
    uint64_t random = 7;
    size_t count = 0, linear = 0, smaller = 0;
    for (double y = 2, step = 0.05; y < 40; y += step, step = 0.01 * y * y)
        for (double x = -8; x < 8; x += 0.02 * y, count++)
            put(position[count], x, y, 0, 0.004, &random);
    double *with = radii_with((const double(*)[3])position, count, true),
           *without = radii_of((const double(*)[3])position, count);
    for (size_t i = 0; i < count; i++) {
        linear += with[i] < 0;
        smaller += fabs(with[i]) < 0.9 * without[i];
    }
    printf("%zu of %zu points of scan lines are linear, %zu smaller for it\n", linear, count, smaller);
    assert_true(linear > 100 && 100 * smaller < 2 * count);
    free(with);
    free(without);
    free(position);
}

/* A floor in rows, as a scanner on a train or a car leaves them: densely along, far apart. It is closed from row to
 * row, and a single one is a wire. */
static void test_rows_far_apart_are_closed(void **state)
{
    (void)state;
    enum { rows = 30, most = 30 * 1200 };
    static const double along[] = {0.02, 0.0145, 0.0135, 0.01, 0.008}, apart = 0.2;
    double(*position)[3] = malloc(most * sizeof *position);
    for (size_t a = 0; a < sizeof along / sizeof *along; a++) {
        uint64_t random = 11;
        size_t count = 0, alone, open = 0, judged = 0;
        for (int row = 0; row < rows; row++)
            for (double x = along[a] * uniform(&random); x < 6; x += along[a], count++)
                put(position[count], x, row * apart, 0, 0.001, &random);
        alone = count - (size_t)(6 / along[a]); /* the last row, lifted */
        for (size_t i = alone; i < count; i++)
            position[i][2] += 5;
        double *radius = radii_with((const double(*)[3])position, count, true);
        for (size_t i = 0; i < count; i++) {
            const bool amid = fabs(position[i][0] - 3) < 2.5 && fabs(position[i][1] - 2.8) < 2.3;
            judged += amid;
            open += amid && fabs(radius[i]) < 0.55 * apart;
            if (i >= alone)
                assert_true(fabs(radius[i]) < 0.2 * apart);
        }
        printf("1 to %.0f: %zu of %zu points leave a slit\n", apart / along[a], open, judged);
        assert_true(200 * open < judged);
        free(radius);
    }
    free(position);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_dense_spots_leave_the_floor_alone),
        cmocka_unit_test(test_radii_follow_the_density),
        cmocka_unit_test(test_a_flat_flock_is_no_floor),
        cmocka_unit_test(test_wires_beside_each_other_are_as_thin_as_one),
        cmocka_unit_test(test_poles_stay_closed),
        cmocka_unit_test(test_the_last_scan_lines_stay_closed),
        cmocka_unit_test(test_rows_far_apart_are_closed),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
