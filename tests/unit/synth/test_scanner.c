/* Scanners on scenes small enough to be worked out by hand: where pulses go, how dense they fall, and what each fault
 * does and how often. */
#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <stdlib.h>
#include <string.h>
#include <cmocka.h>

#include "synth/build.h"
#include "synth/scanner.h"
#include "geom/vector.h"

#define assert_near(a, b, tolerance) assert_true(fabs((a) - (b)) <= (tolerance))

static const double x_axis[3] = {1, 0, 0}, y_axis[3] = {0, 1, 0};
static const struct spl_material greys[] = {
    {.kind = SPL_MATERIAL_FLAT, .colors = {{128, 128, 128}}}, /* albedo 0.502 */
    {.kind = SPL_MATERIAL_FLAT, .colors = {{32, 32, 32}}},    /* 0.125: four times weaker than 0.5 */
};

static struct spl_scene *new_scene(struct spl_scanner scanner)
{
    struct spl_scene *scene = calloc(1, sizeof *scene);
    scene->materials = greys;
    scene->scanner = scanner;
    scene->scanner.aperture = 0.01;
    return scene;
}

static void complete(struct spl_scene *scene)
{
    assert_int_equal(scene->error.code, 0);
    assert_int_equal(spl_bvh_build(scene->primitives, scene->primitive_count, &scene->nodes, NULL), 0);
}

static struct spl_scene *named(const char *name)
{
    struct spl_scene *scene = NULL;
    assert_int_equal(spl_scene_create(name, &scene, NULL), 0);
    return scene;
}

/* Downward parallel beams, 10 × 10 m from z = `height`: each square metre is as good as another. */
static struct spl_scene *under_a_sweep(double height)
{
    struct spl_scene *scene = new_scene((struct spl_scanner){
        .kind = SPL_SCANNER_SWEEP, .range = 10, .returns = 1, .length = 10, .width = 10, .growth = 1});
    spl_build_station(scene, (double[3]){0, 0, height}, 0, 0);
    return scene;
}

static const struct spl_scan_grid hundred_squared = {.columns = 100, .rows = 100};

/* The returns of all pulses; *out has room for all. */
static size_t cast_all(const struct spl_scene *scene, const struct spl_scan_grid *grid,
                       const struct spl_scan_faults *faults, struct spl_return **out)
{
    size_t count = 0, most = scene->station_count * grid->columns * grid->rows * scene->scanner.returns;
    *out = calloc(most, sizeof **out);
    for (size_t pass = 0; pass < scene->station_count; pass++)
        for (uint64_t column = 0; column < grid->columns; column++)
            for (uint64_t row = 0; row < grid->rows; row++) {
                struct spl_return returns[SPL_SCANNER_RETURNS_MAX];
                unsigned found = spl_scanner_cast(scene, grid, faults, pass, column, row, returns);
                assert_true(found <= scene->scanner.returns);
                memcpy(*out + count, returns, found * sizeof *returns);
                count += found;
            }
    return count;
}

/* How far a point is from a primitive, worked out apart from ray casting; cones as if they had one radius. */
static double distance_to(const struct spl_primitive *p, const double at[3])
{
    double from[3];
    sub3(at, p->center, from);
    double n = dot3(from, p->normal), u = dot3(from, p->u), v = dot3(from, p->v);
    switch (p->kind) {
    case SPL_PRIMITIVE_RECTANGLE:
        return hypot(n, hypot(fmax(0, fabs(u) - p->half[0]), fmax(0, fabs(v) - p->half[1])));
    case SPL_PRIMITIVE_DISC:
        return hypot(n, fmax(0, hypot(u, v) - p->half[0]));
    case SPL_PRIMITIVE_SPHERE:
        return fabs(sqrt(dot3(from, from)) - p->half[0]);
    case SPL_PRIMITIVE_CONE:
        break;
    }
    double share = fmin(1, fmax(0, n / p->length)), radius = p->half[0] + share * (p->half[1] - p->half[0]);
    return hypot(fabs(hypot(u, v) - radius), fmax(0, fmax(-n, n - p->length)));
}

static double distance_to_scene(const struct spl_scene *scene, const double at[3])
{
    double least = INFINITY;
    for (size_t i = 0; i < scene->primitive_count; i++)
        least = fmin(least, distance_to(&scene->primitives[i], at));
    return least;
}

/* Of every scanner: without noise points lie on surfaces, with it they are off by as much as was asked, along the ray.
 */
static void points_lie_on_surfaces_within_the_noise(void **state)
{
    (void)state;
    static const char *const names[] = {"railway", "density", "steps"};
    for (size_t i = 0; i < 3; i++) {
        struct spl_scene *scene = named(names[i]);
        struct spl_scan_grid grid = spl_scanner_fit(scene, &(struct spl_scan_faults){0}, 1500, 2);
        struct spl_return *exact, *noisy;
        size_t count = cast_all(scene, &grid, &(struct spl_scan_faults){.seed = 3}, &exact);
        assert_int_equal(cast_all(scene, &grid, &(struct spl_scan_faults){.seed = 3, .noise = 0.01}, &noisy), count);
        double squares = 0;
        for (size_t k = 0; k < count; k++) {
            double off[3], range = sqrt(dot3(exact[k].local, exact[k].local)), radial;
            assert_true(distance_to_scene(scene, exact[k].scene) < 1e-9 * (1 + range));
            sub3(noisy[k].scene, exact[k].scene, off);
            radial = sqrt(dot3(noisy[k].local, noisy[k].local)) - range;
            assert_near(sqrt(dot3(off, off)), fabs(radial), 1e-9);
            squares += radial * radial;
        }
        assert_near(sqrt(squares / (double)count), 0.01, 0.001);
        free(exact);
        free(noisy);
        spl_scene_destroy(scene);
    }
}

/* A straight track of 10 m in two unequal parts: equal steps of the pulses, the lever arm to the left of the heading,
 * the head's axis along the track, so that every beam is square to it. */
static void a_vehicle_keeps_its_speed_and_its_heads(void **state)
{
    (void)state;
    struct spl_scene *scene = new_scene((struct spl_scanner){.kind = SPL_SCANNER_MOBILE, .range = 5, .returns = 1});
    spl_build_track(scene, (const double[3][3]){{1, 2, 3}, {1, 5, 3}, {1, 12, 3}}, 3);
    spl_build_station(scene, (double[3]){0.5, 0.25, 2}, 90, 90);
    const struct spl_scan_grid grid = {.columns = 20, .rows = 8};
    struct spl_pulse pulse, last = {0};
    for (uint64_t i = 0; i < 160; i++) {
        spl_scanner_pulse(scene, &grid, 0, i / 8, i % 8, &pulse);
        assert_near(pulse.origin[0], 1 - 0.25, 1e-12);
        assert_near(pulse.origin[1], 2 + 0.5 + 10 * ((double)i + 0.5) / 160, 1e-12);
        assert_near(pulse.origin[2], 5, 1e-12);
        assert_near(pulse.direction[1], 0, 1e-12);
        assert_near(dot3(pulse.direction, pulse.direction), 1, 1e-12);
        if (i)
            assert_near(dot3(pulse.direction, last.direction), cos(M_PI / 4), 1e-12);
        last = pulse;
    }
    spl_scene_destroy(scene);
}

/* In the railway's curve heads stay over the track and level. */
static void a_vehicle_follows_its_curve(void **state)
{
    (void)state;
    struct spl_scene *scene = named("railway");
    const struct spl_scan_grid grid = {.columns = 1000, .rows = 1};
    struct spl_pulse pulse, last = {0};
    double length = 0;
    for (uint64_t i = 0; i < 1000; i++) {
        double step[3];
        spl_scanner_pulse(scene, &grid, 0, i, 0, &pulse);
        double from_center = hypot(pulse.origin[0], pulse.origin[1] - 600);
        assert_near(from_center, 599.5, 0.02); /* the head sits half a metre to the left */
        assert_near(pulse.origin[2], 3.6, 1e-9);
        sub3(pulse.origin, last.origin, step);
        if (i)
            length += sqrt(dot3(step, step));
        last = pulse;
    }
    assert_near(length, 120 * 599.5 / 600 * 999 / 1000, 0.02);
    spl_scene_destroy(scene);
}

static void lines_in_the_air_run_across_and_back(void **state)
{
    (void)state;
    struct spl_scene *scene = new_scene((struct spl_scanner){
        .kind = SPL_SCANNER_AIRBORNE, .range = 50, .returns = 1, .length = 100, .half_angle = 45, .zigzag = true});
    spl_build_station(scene, (double[3]){10, 20, 50}, 90, 0); /* flies north */
    spl_build_rectangle(scene, (struct spl_skin){0}, (double[3]){10, 70, 0}, x_axis, y_axis, (double[2]){60, 60}, NULL);
    complete(scene);
    const struct spl_scan_grid grid = {.columns = 50, .rows = 90};
    struct spl_return *points;
    assert_int_equal(cast_all(scene, &grid, &(struct spl_scan_faults){0}, &points), 4500);
    for (size_t i = 0; i < 4500; i++) {
        double angle = (-45 + (double)(i % 90) + 0.5) * M_PI / 180;
        double across = i / 90 % 2 ? angle : -angle; /* left of north is west */
        assert_near(points[i].scene[0], 10 + 50 * tan(across), 1e-9);
        assert_near(points[i].scene[1], 20 + ((double)i + 0.5) / 45, 1e-9);
    }
    free(points);
    spl_scene_destroy(scene);
}

/* One surface, 1 to 10,000 points a square metre at a million: a hundredth of that here. Both of its parts alike. */
static void density_grows_as_it_says(void **state)
{
    (void)state;
    struct spl_scene *scene = named("density");
    struct spl_scan_faults faults = {0};
    struct spl_scan_grid grid = spl_scanner_fit(scene, &faults, 200000, 2);
    struct spl_return *points;
    size_t count = cast_all(scene, &grid, &faults, &points), bins[23][2] = {0};
    for (size_t i = 0; i < count; i++)
        bins[(int)(points[i].scene[0] / 2)][points[i].scene[2] > 1e-6]++;
    for (int b = 0; b < 23; b++)
        for (int part = 0; part < 2; part++) {
            double growth = log(10000) / 46,
                   expected = 0.2 * 10 * (exp(growth * (2 * b + 2)) - exp(growth * 2 * b)) / growth;
            assert_near((double)bins[b][part], expected, 0.03 * expected + 3);
        }
    /* No two closer than a third of the spacing that their density has on a square lattice. */
    for (size_t i = count / 2; i < count / 2 + 300; i++)
        for (size_t k = i + 1; k < i + 3000 && k < count; k++) {
            double apart[3], there = 0.2 * exp(log(10000) / 46 * points[i].scene[0]);
            sub3(points[i].scene, points[k].scene, apart);
            assert_true(sqrt(dot3(apart, apart)) > 0.33 / sqrt(there) || points[i].scene[2] < 0.5 ||
                        points[k].scene[2] < 0.5);
        }
    free(points);
    spl_scene_destroy(scene);
}

static void a_power_line_is_sparse(void **state)
{
    (void)state;
    struct spl_scene *scene = named("powerline");
    struct spl_scan_faults faults = {0};
    struct spl_scan_grid grid = spl_scanner_fit(scene, &faults, 100000, 2);
    struct spl_return *points;
    size_t count = cast_all(scene, &grid, &faults, &points), squares[6] = {0}, later = 0;
    for (size_t i = 0; i < count; i++) {
        const double *p = points[i].scene;
        if (p[1] > -48 && p[1] < 48 && p[0] > -180 && p[0] < 180)
            squares[(int)((p[0] + 180) / 60)]++;
        later += points[i].number > 1;
    }
    for (int i = 0; i < 6; i++) { /* 10 to 30 points a square metre with a million points */
        double density = 10 * (double)squares[i] / (60 * 96);
        assert_true(density > 10 && density < 30);
    }
    assert_true(later > 100 && later < count / 10);
    free(points);
    spl_scene_destroy(scene);
}

/* A plate of 5 × 10 m above a floor: beams of 10 mm meet both within half of their width of its edge. */
static struct spl_scene *plate_over_floor(unsigned returns, double above)
{
    struct spl_scene *scene = under_a_sweep(10);
    scene->scanner.returns = returns;
    spl_build_rectangle(scene, (struct spl_skin){1, 0}, (double[3]){5, 5, 0}, x_axis, y_axis, (double[2]){6, 6}, NULL);
    spl_build_rectangle(scene, (struct spl_skin){0}, (double[3]){2, 5, above}, x_axis, y_axis,
                        (double[2]){3, 6}, NULL);
    complete(scene);
    return scene;
}

static void mixed_pixels_lie_between_two_surfaces(void **state)
{
    (void)state;
    struct spl_scene *scene = plate_over_floor(1, 3);
    const struct spl_scan_grid grid = {.columns = 1000, .rows = 200};
    size_t between[3] = {0};
    for (int i = 0; i < 3; i++) {
        struct spl_return *points;
        size_t count = cast_all(scene, &grid, &(struct spl_scan_faults){.seed = 1, .mixed = 0.5 * i}, &points);
        assert_int_equal(count, 200000);
        for (size_t k = 0; k < count; k++) {
            const double *p = points[k].scene;
            if (fabs(p[2]) < 1e-9 || fabs(p[2] - 3) < 1e-9) {
                assert_int_equal(points[k].color[0], p[2] > 1 ? 128 : 32);
                continue;
            }
            assert_true(p[2] > 0 && p[2] < 3 && fabs(p[0] - 5) < 0.005);
            assert_near(points[k].color[0], 32 + 96 * p[2] / 3, 1);
            between[i]++;
        }
        free(points);
    }
    /* The ring of rays reaches 3.3 to 3.8 mm to either side, so 7 mm of 10 m are on the edge. */
    assert_int_equal(between[0], 0);
    assert_in_range(between[2], 120, 160);
    assert_near((double)between[1], 0.5 * (double)between[2], 4 * sqrt(0.25 * (double)between[2]));
    spl_scene_destroy(scene);
}

/* Surfaces within two widths of the beam are one to it. */
static void surfaces_that_nearly_touch_do_not_mix(void **state)
{
    (void)state;
    struct spl_scene *scene = plate_over_floor(1, 0.015);
    const struct spl_scan_grid grid = {.columns = 1000, .rows = 200};
    struct spl_return *points;
    size_t count = cast_all(scene, &grid, &(struct spl_scan_faults){.seed = 1, .mixed = 1}, &points), on_plate = 0;
    for (size_t k = 0; k < count; k++) {
        double z = points[k].scene[2];
        assert_true(fabs(z) < 1e-9 || fabs(z - 0.015) < 1e-9);
        on_plate += z > 0.01;
    }
    assert_true(on_plate > count / 3 && on_plate < count);
    free(points);
    spl_scene_destroy(scene);
}

static void returns_of_a_pulse_are_surfaces_apart(void **state)
{
    (void)state;
    struct spl_scene *scene = plate_over_floor(3, 3);
    const struct spl_scan_grid grid = {.columns = 1000, .rows = 200};
    struct spl_return *points;
    size_t count = cast_all(scene, &grid, &(struct spl_scan_faults){0}, &points), doubles = 0;
    for (size_t k = 0; k < count; k++) {
        assert_true(fabs(points[k].scene[2]) < 1e-6 || fabs(points[k].scene[2] - 3) < 1e-6);
        if (points[k].of == 1)
            continue;
        assert_int_equal(points[k].of, 2);
        assert_int_equal(points[k].number, points[k].scene[2] > 1 ? 1 : 2); /* the nearer one is the first */
        doubles++;
    }
    assert_int_equal(count, 200000 + doubles / 2);
    assert_in_range(doubles / 2, 120, 160);
    free(points);
    spl_scene_destroy(scene);
}

/* The share of returns that a floor loses, which is `tilt` degrees off square, of grey number `grey`, seen from
 * `height`. */
static double lost(double share, uint32_t grey, double tilt, double height, double range)
{
    struct spl_scene *scene = under_a_sweep(height);
    double t = tilt * M_PI / 180;
    scene->scanner.range = range;
    spl_build_rectangle(scene, (struct spl_skin){grey, 0}, (double[3]){5, 5, 0}, (double[3]){cos(t), 0, sin(t)}, y_axis,
                        (double[2]){1000, 10}, NULL);
    complete(scene);
    struct spl_return *points;
    size_t count = cast_all(scene, &hundred_squared, &(struct spl_scan_faults){.seed = 5, .dropout = share}, &points);
    free(points);
    spl_scene_destroy(scene);
    return 1 - (double)count / 1e4;
}

static void dropouts_come_where_little_light_returns(void **state)
{
    (void)state;
    const double off = 0.02; /* four sigma of ten thousand throws */
    assert_true(lost(0, 1, 60, 30, 10) == 0);
    assert_near(lost(0.1, 0, 0, 5, 10), 0.1, off);
    assert_near(lost(0.1, 0, 0, 10, 10), 0.1, off);
    assert_near(lost(0.5, 0, 0, 5, 10), 0.5, off);
    assert_near(lost(0.1, 1, 0, 5, 10), 1 - pow(0.9, 0.5 / (32 / 255.0)), off);
    assert_near(lost(0.1, 0, 60, 10, 30), 1 - pow(0.9, 2), off);
    assert_near(lost(0.1, 0, 0, 20, 10), 1 - pow(0.9, 4), off);
    assert_true(lost(0.1, 1, 60, 60, 10) > 0.95);
}

static void every_pass_is_off_by_what_was_asked(void **state)
{
    (void)state;
    struct spl_scene *scene = named("courtyard");
    const struct spl_scan_faults good = {.seed = 9}, bad = {.seed = 9, .misregister = 0.05};
    const struct spl_scan_grid grid = {.columns = 40, .rows = 20};
    struct spl_return *straight, *moved;
    size_t count = cast_all(scene, &grid, &good, &straight);
    double by[4][3];
    assert_int_equal(cast_all(scene, &grid, &bad, &moved), count);
    for (size_t s = 0; s < 4; s++) {
        spl_scanner_displacement(&bad, s, by[s]);
        assert_near(sqrt(dot3(by[s], by[s])), 0.05, 1e-12);
        for (size_t other = 0; other < s; other++) {
            double apart[3];
            sub3(by[s], by[other], apart);
            assert_true(sqrt(dot3(apart, apart)) > 0.005);
        }
    }
    for (size_t k = 0; k < count; k++)
        for (int a = 0; a < 3; a++) {
            assert_true(moved[k].local[a] == straight[k].local[a]);
            assert_near(moved[k].scene[a] - straight[k].scene[a], by[moved[k].pass][a], 1e-12);
        }
    free(straight);
    free(moved);
    spl_scene_destroy(scene);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(points_lie_on_surfaces_within_the_noise),
        cmocka_unit_test(a_vehicle_keeps_its_speed_and_its_heads),
        cmocka_unit_test(a_vehicle_follows_its_curve),
        cmocka_unit_test(lines_in_the_air_run_across_and_back),
        cmocka_unit_test(density_grows_as_it_says),
        cmocka_unit_test(a_power_line_is_sparse),
        cmocka_unit_test(mixed_pixels_lie_between_two_surfaces),
        cmocka_unit_test(surfaces_that_nearly_touch_do_not_mix),
        cmocka_unit_test(returns_of_a_pulse_are_surfaces_apart),
        cmocka_unit_test(dropouts_come_where_little_light_returns),
        cmocka_unit_test(every_pass_is_off_by_what_was_asked),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
