/* The colour of a scan's point against the mean of many rays through the cell of the grid that the point stands for. */
#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <stdlib.h>
#include <string.h>
#include <cmocka.h>

#include "synth/footprint.h"
#include "synth/light.h"
#include "synth/random.h"
#include "geom/vector.h"

enum { fine = 20 };

/* Light of the rays through a cell that hit the central ray's primitive; their share. */
static double mean_of_cell(const struct spl_scene *scene, const struct spl_scan_grid *grid, uint64_t column,
                           uint64_t row, uint32_t primitive, double light[3])
{
    struct spl_scan_grid finer = {grid->columns * fine, grid->rows * fine, 0};
    struct spl_pulse pulse;
    struct spl_hit hit;
    unsigned count = 0;
    memset(light, 0, 3 * sizeof *light);
    for (int i = 0; i < fine * fine; i++) {
        spl_scanner_pulse(scene, &finer, 0, column * fine + (uint64_t)(i % fine), row * fine + (uint64_t)(i / fine),
                          &pulse);
        if (!spl_scene_hit(scene, pulse.origin, pulse.direction, &hit) || hit.primitive != primitive)
            continue;
        for (int c = 0; c < 3; c++)
            light[c] += light_of_level(hit.color[c]);
        count++;
    }
    for (int c = 0; c < 3; c++)
        light[c] /= count;
    return (double)count / (fine * fine);
}

static void a_coarse_scan_sees_means(void **state)
{
    (void)state;
    struct spl_scene *scene = NULL;
    assert_int_equal(spl_scene_create("courtyard", &scene, NULL), 0);
    const struct spl_scan_grid grid = {1440, 600, 0};
    unsigned seen = 0, off = 0, own_off = 0;
    double bias = 0;
    for (uint64_t i = 0; seen < 300; i++) {
        uint64_t column = hash64(i) % grid.columns, row = hash64(hash64(i)) % grid.rows;
        struct spl_pulse pulse;
        struct spl_hit hit;
        double light[3];
        uint8_t color[3];
        spl_scanner_pulse(scene, &grid, 0, column, row, &pulse);
        if (!spl_scene_hit(scene, pulse.origin, pulse.direction, &hit) ||
            fabs(dot3(hit.normal, pulse.direction)) < 0.5 ||
            mean_of_cell(scene, &grid, column, row, hit.primitive, light) < 1)
            continue;
        spl_footprint_color(scene, &grid, 0, column, row, &hit, color);
        for (int c = 0; c < 3; c++) {
            double level = level_of_light(light[c]);
            off += fabs(color[c] - level) > 6;
            own_off += fabs(hit.color[c] - level) > 6;
            bias += color[c] - level;
        }
        seen++;
    }
    assert_true(off <= 3 * seen / 20);
    assert_true(off < own_off / 2); /* the point's own colour would not do */
    assert_true(fabs(bias) / (3 * seen) < 0.7);
    spl_scene_destroy(scene);
}

static void a_fine_scan_sees_points(void **state)
{
    (void)state;
    struct spl_scene *scene = NULL;
    assert_int_equal(spl_scene_create("courtyard", &scene, NULL), 0);
    const struct spl_scan_grid grid = {400000, 160000, 0};
    for (uint64_t i = 0; i < 200; i++) {
        uint64_t column = hash64(i) % grid.columns, row = grid.rows / 3 + i;
        struct spl_pulse pulse;
        struct spl_hit hit;
        uint8_t color[3];
        spl_scanner_pulse(scene, &grid, 0, column, row, &pulse);
        if (!spl_scene_hit(scene, pulse.origin, pulse.direction, &hit))
            continue;
        spl_footprint_color(scene, &grid, 0, column, row, &hit, color);
        assert_memory_equal(color, hit.color, 3);
    }
    spl_scene_destroy(scene);
}

/* Of a sweep the patch has the area of a pulse's share: all of them together have that of the sweep. */
static void a_sweep_is_shared_out(void **state)
{
    (void)state;
    struct spl_scene *scene = NULL;
    assert_int_equal(spl_scene_create("density", &scene, NULL), 0);
    const struct spl_scan_grid grid = {100, 100, 0};
    double area = 0, steps[2][3];
    for (uint64_t i = 0; i < grid.columns * grid.rows; i++) {
        spl_scanner_spacing(scene, &grid, 0, i / grid.rows, i % grid.rows, steps);
        area += sqrt(dot3(steps[0], steps[0]) * dot3(steps[1], steps[1]));
    }
    double whole = scene->scanner.length * scene->scanner.width;
    assert_true(fabs(area - whole) < 0.01 * whole);
    spl_scene_destroy(scene);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(a_coarse_scan_sees_means),
        cmocka_unit_test(a_fine_scan_sees_points),
        cmocka_unit_test(a_sweep_is_shared_out),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
