/* Smooth pieces of clouds whose surfaces are known: what bends becomes pieces that lie on it, steps are not bridged,
 * what is no surface gives none. After each search what planes.h promises is held against the points. */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>

#include <cmocka.h>

#include "base/memory.h"
#include "clouds.h"
#include "pack/planes/heights.h"
#include "pack/planes/planes.h"
#include "support/sanitised.h"

enum { most = 60000 };

struct scene {
    double position[most][3];
    size_t count;
    uint64_t random;
};

struct result {
    struct spl_points points;
    struct spl_planes planes;
    size_t flat, bent; /* points on planes, on pieces with relief */
};

static struct scene *new_scene(void)
{
    struct scene *s = calloc(1, sizeof *s);
    s->random = 11;
    return s;
}

static double noise_of(struct scene *s, double sigma)
{
    double radius = sqrt(-2 * log(1 - uniform(&s->random)));
    return sigma * radius * cos(2 * M_PI * uniform(&s->random));
}

static void add(struct scene *s, double x, double y, double z)
{
    assert_true(s->count < most);
    s->position[s->count][0] = x;
    s->position[s->count][1] = y;
    s->position[s->count++][2] = z;
}

static void add_sphere(struct scene *s, size_t count, double radius, double sigma)
{
    for (size_t i = 0; i < count; i++) {
        double angle = 2 * M_PI * uniform(&s->random), z = 2 * uniform(&s->random) - 1, flat = sqrt(1 - z * z);
        double r = radius + noise_of(s, sigma);
        add(s, r * flat * cos(angle), r * flat * sin(angle), r * z);
    }
}

static void add_column(struct scene *s, size_t count, double radius, double height, double sigma)
{
    for (size_t i = 0; i < count; i++) {
        double angle = 2 * M_PI * uniform(&s->random), r = radius + noise_of(s, sigma);
        add(s, 5 + r * cos(angle), r * sin(angle), height * uniform(&s->random));
    }
}

static double wave(double x, double y)
{
    return 0.08 * sin(3 * x) * cos(2 * y) + 0.03 * sin(7 * y);
}

/* Waves over 4 x 4 m, lower by `step` where x < 0. */
static void add_waves(struct scene *s, size_t count, double sigma, double step)
{
    for (size_t i = 0; i < count; i++) {
        double x = 4 * uniform(&s->random) - 2, y = 4 * uniform(&s->random) - 2;
        add(s, x, y, wave(x, y) + noise_of(s, sigma) - (x < 0 ? step : 0));
    }
}

/* Surfaces are what the search is for: normals and radii as neighbours give them. */
static void search(struct result *r, const struct scene *s, double error, unsigned threads)
{
    struct spl_stage stage = quiet_stage(threads);
    const struct spl_planes_options options = {.error = error, .relief = true};
    *r = (struct result){.points = cloud_of((const double(*)[3])s->position, s->count)};
    assert_int_equal(spl_points_order(&r->points, &stage, NULL), 0);
    assert_int_equal(spl_surface(&r->points, 12, true, &stage, NULL), 0);
    assert_int_equal(spl_planes_find(&r->planes, &r->points, &options, &stage, NULL), 0);
    uint64_t *count = calloc((size_t)r->planes.count + 1, sizeof *count);
    bool relief = false;
    assert_true(r->planes.flat <= r->planes.count);
    for (size_t i = 0; i < r->points.count; i++) {
        uint32_t k = r->points.plane[i];
        if (k == SPL_NO_PLANE)
            continue;
        assert_true(k < r->planes.count);
        const struct spl_plane *plane = &r->planes.list[k];
        count[k]++;
        *(plane->heights ? &r->bent : &r->flat) += 1;
        if (plane->heights) {
            double off = spl_heights_off(plane->heights, &r->points, i, NULL);
            assert_true(off <= plane->error_max && off <= r->planes.bound);
        }
    }
    for (uint32_t k = 0; k < r->planes.count; k++) {
        assert_int_equal(count[k], r->planes.list[k].points);
        assert_true(!relief || r->planes.list[k].heights); /* flat ones first */
        relief = r->planes.list[k].heights;
        assert_true(relief == (k >= r->planes.flat));
        assert_true(r->planes.list[k].error_rms <= r->planes.list[k].error_max);
    }
    free(count);
}

static void finish(struct result *r)
{
    spl_planes_finish(&r->planes);
    spl_points_finish(&r->points);
}

static double share(const struct result *r, size_t of)
{
    return (double)of / (double)r->points.count;
}

/* The rms of how far the surface under each point of a piece is from the truth, by a function of the place. */
static double rms_off(const struct result *r, double (*off)(const double at[3]))
{
    double sum = 0, count = 0;
    for (size_t i = 0; i < r->points.count; i++) {
        if (r->points.plane[i] == SPL_NO_PLANE || !r->planes.list[r->points.plane[i]].heights)
            continue;
        const struct spl_heights *h = r->planes.list[r->points.plane[i]].heights;
        double at[3], place[3], height;
        spl_heights_place(h, &r->points, i, at);
        assert_true(spl_heights_get(h, at[0], at[1], 0, &height, NULL));
        for (int c = 0; c < 3; c++)
            place[c] = h->origin[c] + at[0] * h->u[c] + at[1] * h->v[c] + height * h->normal[c];
        sum += off(place) * off(place);
        count++;
    }
    return count > 0 ? sqrt(sum / count) : 0;
}

static double off_sphere(const double at[3])
{
    return sqrt(at[0] * at[0] + at[1] * at[1] + at[2] * at[2]) - 0.5;
}

static double off_column(const double at[3])
{
    return hypot(at[0] - 5, at[1]) - 0.15;
}

static double off_waves(const double at[3])
{
    return at[2] - wave(at[0], at[1]);
}

static void test_sphere(void **state)
{
    struct scene *s = new_scene();
    struct result r;
    (void)state;
    add_sphere(s, 20000, 0.5, 0.001);
    search(&r, s, 0, 2);
    assert_true(share(&r, r.bent + r.flat) >= 0.97);
    assert_true(share(&r, r.bent) >= 0.9);
    assert_true(rms_off(&r, off_sphere) <= 0.0007);
    finish(&r);
    free(s);
}

static void test_column(void **state)
{
    struct scene *s = new_scene();
    struct result r;
    (void)state;
    add_column(s, 10000, 0.15, 2, 0.001);
    search(&r, s, 0, 2);
    assert_true(share(&r, r.bent + r.flat) >= 0.95);
    assert_true(share(&r, r.bent) >= 0.9);
    assert_true(rms_off(&r, off_column) <= 0.0007);
    finish(&r);
    free(s);
}

static void test_waves(void **state)
{
    struct scene *s = new_scene();
    struct result r;
    (void)state;
    add_waves(s, 40000, 0.002, 0);
    search(&r, s, 0, 2);
    assert_true(share(&r, r.bent + r.flat) >= 0.98);
    assert_true(rms_off(&r, off_waves) <= 0.001);
    finish(&r);
    free(s);
}

/* No piece has points of both sides of a step of twice the bound, but for those in its edge. */
static void test_step(void **state)
{
    struct scene *s = new_scene();
    struct result r;
    size_t stray = 0;
    (void)state;
    add_waves(s, 40000, 0.001, 0.02);
    search(&r, s, 0.01, 2);
    size_t(*side)[2] = calloc(r.planes.count, sizeof *side);
    for (size_t i = 0; i < r.points.count; i++)
        if (r.points.plane[i] != SPL_NO_PLANE)
            side[r.points.plane[i]][r.points.axis[0][i] < 0]++;
    for (uint32_t k = 0; k < r.planes.count; k++)
        stray += side[k][0] < side[k][1] ? side[k][0] : side[k][1];
    assert_true(share(&r, r.bent + r.flat) >= 0.97);
    assert_true(share(&r, stray) <= 0.002);
    free(side);
    finish(&r);
    free(s);
}

static void test_noise(void **state)
{
    struct scene *s = new_scene();
    struct result r;
    (void)state;
    for (size_t i = 0; i < 30000; i++)
        add(s, uniform(&s->random), uniform(&s->random), uniform(&s->random));
    search(&r, s, 0, 2);
    assert_int_equal(r.bent, 0);
    finish(&r);
    free(s);
}

/* What is flat to the last digit is a plane, however much closer a surface is to its rounding. */
static void test_exactly_flat(void **state)
{
    (void)state;
    for (int across = 10; across <= 60; across += 10) {
        struct scene *s = new_scene();
        struct result r;
        for (int i = 0; i < across * across; i++)
            add(s, 0.1 * (i % across), 0.1 * (int)(i / across), across % 20 ? 0 : 5);
        search(&r, s, 0, 2);
        assert_int_equal(r.bent, 0);
        assert_true(share(&r, r.flat) > 0.99);
        finish(&r);
        free(s);
    }
}

/* Leaves of 4 cm at all angles in a ball of 1 m, with a dozen points each. */
static void test_bush(void **state)
{
    struct scene *s = new_scene();
    struct result r;
    (void)state;
    for (size_t leaf = 0; leaf < 2500; leaf++) {
        double at[3], n[3], length = 0, reach = 0;
        for (int c = 0; c < 3; c++) {
            at[c] = 2 * uniform(&s->random) - 1;
            n[c] = noise_of(s, 1);
            length += n[c] * n[c];
            reach += at[c] * at[c];
        }
        for (int i = 0; i < 12 && reach <= 1; i++) {
            double d[3], along = 0;
            for (int c = 0; c < 3; c++) {
                d[c] = 0.02 * (2 * uniform(&s->random) - 1);
                along += d[c] * n[c] / length;
            }
            add(s, at[0] + d[0] - along * n[0], at[1] + d[1] - along * n[1], at[2] + d[2] - along * n[2]);
        }
    }
    search(&r, s, 0, 2);
    assert_true(share(&r, r.bent) <= 0.005);
    finish(&r);
    free(s);
}

/* A ground with a column and a ball, and nothing that depends on how many threads there are. */
static void test_threads(void **state)
{
    struct scene *s = new_scene();
    struct result one, four;
    (void)state;
    add_waves(s, 30000, 0.001, 0);
    add_sphere(s, 10000, 0.5, 0.001);
    add_column(s, 8000, 0.2, 1, 0.001);
    search(&one, s, 0, 1);
    search(&four, s, 0, 4);
    assert_true(one.bent > 30000);
    assert_int_equal(one.planes.count, four.planes.count);
    assert_memory_equal(one.points.plane, four.points.plane, one.points.count * sizeof *one.points.plane);
    for (uint32_t k = 0; k < one.planes.count; k++) {
        const struct spl_heights *a = one.planes.list[k].heights, *b = four.planes.list[k].heights;
        assert_true(!a == !b);
        assert_memory_equal(one.planes.list[k].origin, four.planes.list[k].origin, sizeof one.planes.list[k].origin);
        if (!a)
            continue;
        assert_int_equal(a->count, b->count);
        for (uint32_t v = 0; v < a->count; v++)
            assert_memory_equal(a->vertices[v].q, b->vertices[v].q, sizeof a->vertices[v].q);
    }
    finish(&one);
    finish(&four);
    free(s);
}

/* Without the option nothing has relief. */
static void test_off(void **state)
{
    struct scene *s = new_scene();
    struct spl_stage stage = quiet_stage(2);
    struct spl_planes planes;
    (void)state;
    add_sphere(s, 5000, 0.5, 0);
    struct spl_points points = cloud_of((const double(*)[3])s->position, s->count);
    assert_int_equal(spl_points_order(&points, &stage, NULL), 0);
    assert_int_equal(spl_surface(&points, 12, true, &stage, NULL), 0);
    assert_int_equal(spl_planes_find(&planes, &points, &(struct spl_planes_options){0}, &stage, NULL), 0);
    for (uint32_t k = 0; k < planes.count; k++)
        assert_null(planes.list[k].heights);
    spl_planes_finish(&planes);
    spl_points_finish(&points);
    free(s);
}

/* Whichever allocation fails, nothing is left behind. */
static void test_no_memory(void **state)
{
    struct scene *s = new_scene();
    struct spl_stage stage = quiet_stage(1);
    struct spl_planes planes;
    int rc = SPL_E_NOMEM;
    long n = 0;
    (void)state;
    add_sphere(s, 4000, 0.5, 0.001);
    struct spl_points points = cloud_of((const double(*)[3])s->position, s->count);
    assert_int_equal(spl_points_order(&points, &stage, NULL), 0);
    assert_int_equal(spl_surface(&points, 12, true, &stage, NULL), 0);
    while (rc) {
        struct spl_error err = {0};
        const struct spl_planes_options options = {.relief = true};
        spl_memory_fail_after(++n);
        rc = spl_planes_find(&planes, &points, &options, &stage, &err);
        spl_memory_fail_after(0);
        assert_true(rc == 0 || (rc == SPL_E_NOMEM && err.code == SPL_E_NOMEM));
        assert_true(rc == 0 || (!points.plane && !planes.list));
    }
    assert_true(n > 60 && planes.count > planes.flat);
    spl_planes_finish(&planes);
    spl_points_finish(&points);
    free(s);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_sphere),  cmocka_unit_test(test_column), cmocka_unit_test(test_waves),
        cmocka_unit_test(test_step),    cmocka_unit_test(test_noise),  cmocka_unit_test(test_bush),
        cmocka_unit_test(test_exactly_flat),
        cmocka_unit_test(test_threads), cmocka_unit_test(test_off),    cmocka_unit_test(test_no_memory),
    };
    only_threads_under_tsan();
    return cmocka_run_group_tests(tests, NULL, NULL);
}
