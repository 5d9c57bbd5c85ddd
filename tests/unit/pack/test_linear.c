/* What is taken for a wire, a pole or a cable, and above all what is not: surfaces, their edges, far scan lines, noise.
 */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>

#include <cmocka.h>

#include <time.h>

#include "clouds.h"
#include "pack/linear.h"
#include "support/sanitised.h"

enum { most = 200000 };

struct cloud {
    double position[most][3];
    size_t count;
    uint64_t random;
    double noise;
};

static struct cloud *new_cloud(double noise)
{
    struct cloud *c = calloc(1, sizeof *c);
    c->random = 77;
    c->noise = noise;
    return c;
}

static void add(struct cloud *c, double x, double y, double z)
{
    const double at[3] = {x, y, z};
    assert_true(c->count < most);
    for (int a = 0; a < 3; a++)
        c->position[c->count][a] = at[a] + c->noise * (uniform(&c->random) + uniform(&c->random) - 1);
    c->count++;
}

/* A square of edge `size` around the origin at height z: points `along` apart on lines `across` apart, which start
 * anywhere. */
static void add_plane(struct cloud *c, double size, double along, double across, double z)
{
    for (double y = -size / 2; y < size / 2; y += across)
        for (double x = -size / 2 + along * uniform(&c->random); x < size / 2; x += along)
            add(c, x, y, z);
}

static void add_line(struct cloud *c, const double from[3], const double to[3], double spacing)
{
    double length = sqrt((to[0] - from[0]) * (to[0] - from[0]) + (to[1] - from[1]) * (to[1] - from[1]) +
                         (to[2] - from[2]) * (to[2] - from[2]));
    for (double s = 0; s < 1; s += spacing / length)
        add(c, from[0] + s * (to[0] - from[0]), from[1] + s * (to[1] - from[1]), from[2] + s * (to[2] - from[2]));
}

/* Shares of points [0, split) and [split, count) that are marked; frees the cloud. */
static void shares(struct cloud *c, size_t split, double share[2])
{
    struct spl_points p = cloud_of((const double(*)[3])c->position, c->count);
    struct spl_stage stage = quiet_stage(2);
    size_t marked[2] = {0};
    assert_int_equal(spl_points_order(&p, &stage, NULL), 0);
    assert_int_equal(spl_linear_find(&p, &stage, NULL), 0);
    for (size_t i = 0; p.linear && i < p.count; i++)
        marked[p.color_class[i] >= split] += p.linear[i];
    share[0] = (double)marked[0] / (double)(split ? split : 1);
    share[1] = (double)marked[1] / (double)(c->count - split ? c->count - split : 1);
    printf("marked: %.2f %% of %zu, %.2f %% of %zu\n", 100 * share[0], split, 100 * share[1], c->count - split);
    spl_points_finish(&p);
    free(c);
}

static void test_wire_over_a_plane(void **state)
{
    (void)state;
    double share[2];
    struct cloud *c = new_cloud(0.005);
    add_plane(c, 20, 0.1, 0.1, 0);
    size_t split = c->count;
    add_line(c, (double[3]){-10, -4, 3}, (double[3]){10, 5, 3.5}, 0.1);
    shares(c, split, share);
    assert_true(share[0] == 0 && share[1] > 0.95);
}

/* Scanned in stretches too short to be told from anything else. */
static void test_wire_with_gaps(void **state)
{
    (void)state;
    double share[2];
    struct cloud *c = new_cloud(0.005);
    add_plane(c, 20, 0.1, 0.1, 0);
    size_t split = c->count;
    for (double x = -9; x < 9; x += 2.2)
        add_line(c, (double[3]){x, 0.1 * x, 3}, (double[3]){x + 0.7, 0.1 * x + 0.07, 3}, 0.1);
    shares(c, split, share);
    assert_true(share[0] == 0 && share[1] > 0.9);
    c = new_cloud(0.005); /* the same stretches, none of which goes on where another ends */
    add_plane(c, 20, 0.1, 0.1, 0);
    split = c->count;
    for (double x = -9; x < 9; x += 2.2)
        add_line(c, (double[3]){x, fmod(3 * x, 7), 3}, (double[3]){x + 0.7, fmod(3 * x, 7) + 0.07, 3}, 0.1);
    shares(c, split, share);
    assert_true(share[0] == 0 && share[1] == 0);
}

/* As thick as three cells of the finest level, seen all round; its foot may count as the plane's. */
static void test_pole(void **state)
{
    (void)state;
    double share[2];
    struct cloud *c = new_cloud(0.003);
    add_plane(c, 20, 0.1, 0.1, 0);
    size_t split = c->count;
    for (double z = 0.05; z < 6; z += 0.05)
        for (int k = 0; k < 12; k++)
            add(c, 0.08 * cos(k * M_PI / 6 + z), 0.08 * sin(k * M_PI / 6 + z), z);
    shares(c, split, share);
    assert_true(share[0] < 1e-3 && share[1] > 0.8);
}

static void test_edges_of_planes(void **state)
{
    (void)state;
    double share[2];
    struct cloud *c = new_cloud(0.005);
    add_plane(c, 10, 0.05, 0.05, 0);
    for (double z = 0.05; z < 4; z += 0.05) /* a wall on it, and its top */
        for (double x = -5; x < 5; x += 0.05)
            add(c, x, 1, z);
    shares(c, c->count, share);
    assert_true(share[0] == 0);
}

static void test_crossing_wires(void **state)
{
    (void)state;
    double share[2];
    struct cloud *c = new_cloud(0.004);
    add_plane(c, 16, 0.1, 0.1, 0);
    size_t split = c->count;
    add_line(c, (double[3]){-8, 0, 4}, (double[3]){8, 1, 4}, 0.08);
    add_line(c, (double[3]){1, -8, 4}, (double[3]){-1, 8, 4.1}, 0.08);
    add_line(c, (double[3]){-8, 0, 5.2}, (double[3]){8, 1, 5.2}, 0.08); /* a parallel one, fifteen spacings away */
    shares(c, split, share);
    assert_true(share[0] == 0 && share[1] > 0.9);
}

/* Lines of a scanned surface, up to sixty times denser along than across; three wires as far apart are none. */
static void test_scan_lines(void **state)
{
    (void)state;
    static const double across[] = {0.1, 0.25, 0.5, 1, 1.5, 2.5, 3};
    for (size_t row = 0; row < sizeof across / sizeof *across; row++) {
        double share[2];
        struct cloud *c = new_cloud(0.004);
        add_plane(c, 30, 0.05, across[row], 0);
        shares(c, c->count, share);
        assert_true(share[0] < (across[row] > 2 ? 0.05 : 0.002)); /* a part of the outermost of ten */
    }
    double share[2];
    struct cloud *c = new_cloud(0.004);
    for (int wire = 0; wire < 3; wire++)
        add_line(c, (double[3]){-15, 3 * wire, 0}, (double[3]){15, 3 * wire, 0}, 0.05);
    shares(c, c->count, share);
    assert_true(share[0] > 0.99);
    c = new_cloud(0.004);
    for (double y = 2, step = 0.05; y < 40; y += step, step = 0.01 * y * y) /* as from a tripod: ever farther apart */
        for (double x = -8; x < 8; x += 0.02 * y)
            add(c, x, y, 0);
    shares(c, c->count, share);
    assert_true(share[0] < 0.03); /* a part of the outermost, which nothing lies behind */
}

static void test_noise(void **state)
{
    (void)state;
    double share[2];
    struct cloud *c = new_cloud(0);
    for (int i = 0; i < 60000; i++)
        add(c, 3 * uniform(&c->random), 3 * uniform(&c->random), 3 * uniform(&c->random));
    size_t split = c->count;
    for (int i = 0; i < 500; i++) /* strays */
        add(c, 60 * uniform(&c->random), 60 * uniform(&c->random), 60 * uniform(&c->random));
    shares(c, split, share);
    assert_true(share[0] < 1e-3 && share[1] == 0);
}

static void test_length(void **state)
{
    (void)state;
    static const struct {
        double length;
        bool marked;
    } rows[] = {{0.5, false}, {0.9, false}, {3, true}};
    for (size_t row = 0; row < sizeof rows / sizeof *rows; row++) {
        double share[2];
        struct cloud *c = new_cloud(0.003);
        add_plane(c, 20, 0.1, 0.1, 0);
        size_t split = c->count;
        add_line(c, (double[3]){0, 0, 3}, (double[3]){rows[row].length, 0.1, 3}, 0.05);
        shares(c, split, share);
        assert_true(share[0] == 0 && (rows[row].marked ? share[1] > 0.9 : share[1] == 0));
    }
}

static void test_degenerate_clouds(void **state)
{
    (void)state;
    for (int shape = 0; shape < SHAPES; shape++)
        for (size_t count = 1; count < 40; count++) {
            double(*position)[3] = shape_points((enum shape)shape, count, count);
            struct spl_points p = cloud_of((const double(*)[3])position, count);
            struct spl_stage stage = quiet_stage(2);
            assert_int_equal(spl_points_order(&p, &stage, NULL), 0);
            assert_int_equal(spl_linear_find(&p, &stage, NULL), 0);
            for (size_t i = 0; p.linear && shape != SHAPE_LINE && shape != SHAPE_GRID && i < p.count; i++)
                assert_int_equal(p.linear[i], 0);
            free(position);
            spl_points_finish(&p);
        }
}

/* Far from the origin, on any number of threads: the same. */
static double cpu_s(void)
{
    struct timespec t;
    clock_gettime(CLOCK_PROCESS_CPUTIME_ID, &t);
    return (double)t.tv_sec + 1e-9 * (double)t.tv_nsec;
}

/* Wires side by side, each of which is compared with all around: who cancels does not wait for that. */
static void test_cancelled_within_a_level(void **state)
{
    (void)state;
    skip_under_tsan();
    struct cloud *c = new_cloud(0.002);
    double took[2];
    for (int w = 0; w < 60; w++)
        add_line(c, (double[]){0, 4 * w, 3 * (w % 4)}, (double[]){300, 4 * w, 3 * (w % 4)}, 0.1);
    for (int run = 0; run < 2; run++) {
        atomic_bool cancelled = run;
        struct spl_points p = cloud_of((const double(*)[3])c->position, c->count);
        struct spl_stage stage = {.threads = 2, .cancelled = &cancelled};
        struct spl_error err = {0};
        atomic_store(&cancelled, false);
        assert_int_equal(spl_points_order(&p, &stage, NULL), 0);
        atomic_store(&cancelled, run);
        took[run] = -cpu_s();
        assert_int_equal(spl_linear_find(&p, &stage, &err), run ? SPL_E_CANCELLED : SPL_OK);
        took[run] += cpu_s();
        assert_int_equal(p.linear != NULL, !run);
        spl_points_finish(&p);
    }
    free(c);
    if (took[1] > took[0] / 8)
        fail_msg("%.3f s until it is cancelled, %.3f s in all", took[1], took[0]);
}

static void test_place_and_threads_do_not_matter(void **state)
{
    (void)state;
    struct cloud *c = new_cloud(0.005);
    add_plane(c, 20, 0.1, 0.1, 0);
    add_line(c, (double[3]){-10, -4, 3}, (double[3]){10, 5, 3.5}, 0.1);
    for (size_t i = 0; i < c->count; i++) /* so that moving it rounds nothing */
        for (int a = 0; a < 3; a++)
            c->position[i][a] = round(c->position[i][a] * 4096) / 4096;
    struct spl_points points[3];
    for (int k = 0; k < 3; k++) {
        for (size_t i = 0; k == 2 && i < c->count; i++)
            for (int a = 0; a < 3; a++)
                c->position[i][a] += 4194304;
        points[k] = cloud_of((const double(*)[3])c->position, c->count);
        struct spl_stage stage = quiet_stage(k == 1 ? 3 : 1);
        assert_int_equal(spl_points_order(&points[k], &stage, NULL), 0);
        assert_int_equal(spl_linear_find(&points[k], &stage, NULL), 0);
        assert_non_null(points[k].linear);
        assert_int_equal(points[k].count, points[0].count);
        assert_memory_equal(points[k].linear, points[0].linear, points[0].count);
    }
    for (int k = 0; k < 3; k++)
        spl_points_finish(&points[k]);
    free(c);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_wire_over_a_plane),
        cmocka_unit_test(test_wire_with_gaps),
        cmocka_unit_test(test_pole),
        cmocka_unit_test(test_edges_of_planes),
        cmocka_unit_test(test_crossing_wires),
        cmocka_unit_test(test_scan_lines),
        cmocka_unit_test(test_noise),
        cmocka_unit_test(test_length),
        cmocka_unit_test(test_cancelled_within_a_level),
        cmocka_unit_test(test_degenerate_clouds),
        cmocka_unit_test(test_place_and_threads_do_not_matter),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
