/* Planes of clouds whose planes are known: what must be one, what must stay apart, what is none. After each search all
 * that planes.h promises is held against the points: bounds, errors, numbers, linear points. */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>

#include <cmocka.h>

#include "base/memory.h"
#include "clouds.h"
#include "pack/planes/moments.h"
#include "pack/planes/planes.h"
#include "support/sanitised.h"

enum { most = 120000, kinds = 64, stations_most = 4 };

struct scene {
    double position[most][3];
    uint32_t kind[most]; /* of the thing that the point lies on */
    uint16_t station[most];
    size_t count;
    double stations[stations_most][3];
    uint32_t station_count;
    uint64_t random;
    double noise; /* sigma */
};

struct result {
    struct scene *scene;
    struct spl_points points;
    struct spl_planes planes;
};

static struct scene *new_scene(double noise)
{
    struct scene *s = calloc(1, sizeof *s);
    s->random = 5;
    s->noise = noise;
    return s;
}

static uint16_t add_station(struct scene *s, double x, double y, double z)
{
    const double at[3] = {x, y, z};
    assert_true(s->station_count < stations_most);
    memcpy(s->stations[s->station_count], at, sizeof at);
    return (uint16_t)s->station_count++;
}

static double normal_noise(struct scene *s)
{
    double radius = sqrt(-2 * log(1 - uniform(&s->random)));
    return s->noise * radius * cos(2 * M_PI * uniform(&s->random));
}

/* A point of `kind` that is off along the unit vector `n` by the scene's noise. */
static void add(struct scene *s, uint32_t kind, uint16_t station, const double at[3], const double n[3])
{
    double off = s->noise > 0 ? normal_noise(s) : 0;
    assert_true(s->count < most);
    for (int c = 0; c < 3; c++)
        s->position[s->count][c] = at[c] + off * n[c];
    s->kind[s->count] = kind;
    s->station[s->count++] = station;
}

/* Points at random on the rectangle origin + [0,1] u + [0,1] v. */
static void add_sheet(struct scene *s, uint32_t kind, uint16_t station, size_t count, const double origin[3],
                      const double u[3], const double v[3])
{
    double n[3] = {u[1] * v[2] - u[2] * v[1], u[2] * v[0] - u[0] * v[2], u[0] * v[1] - u[1] * v[0]}, length = 0;
    for (int c = 0; c < 3; c++)
        length += n[c] * n[c];
    for (int c = 0; c < 3; c++)
        n[c] /= sqrt(length);
    for (size_t i = 0; i < count; i++) {
        double a = uniform(&s->random), b = uniform(&s->random), at[3];
        for (int c = 0; c < 3; c++)
            at[c] = origin[c] + a * u[c] + b * v[c];
        add(s, kind, station, at, n);
    }
}

/* A level sheet [x, x + size] × [y, y + size] at height z. */
static void add_level(struct scene *s, uint32_t kind, uint16_t station, size_t count, double x, double y, double z,
                      double size)
{
    add_sheet(s, kind, station, count, (const double[3]){x, y, z}, (const double[3]){size, 0, 0},
              (const double[3]){0, size, 0});
}

static void prepare(struct result *r, struct scene *s, unsigned threads)
{
    struct spl_stage stage = quiet_stage(threads);
    *r = (struct result){.scene = s, .points = cloud_of((const double(*)[3])s->position, s->count)};
    if (s->station_count) {
        r->points.station = malloc((s->count + SPL_POINTS_PAD) * sizeof *r->points.station);
        memcpy(r->points.station, s->station, s->count * sizeof *s->station);
        r->points.stations = calloc(s->station_count, sizeof *r->points.stations);
        r->points.station_count = s->station_count;
        for (uint32_t k = 0; k < s->station_count; k++)
            for (int c = 0; c < 3; c++)
                r->points.stations[k][4 * c + 3] = s->stations[k][c];
    }
    assert_int_equal(spl_points_order(&r->points, &stage, NULL), 0);
    assert_int_equal(spl_surface(&r->points, 12, true, &stage, NULL), 0);
}

static double off_plane(const struct result *r, size_t i)
{
    const struct spl_plane *plane = &r->planes.list[r->points.plane[i]];
    double off = 0;
    for (int c = 0; c < 3; c++)
        off += plane->normal[c] * (r->points.axis[c][i] - plane->origin[c]);
    return fabs(off);
}

/* What planes.h promises of every result. */
static void check_promises(const struct result *r)
{
    const struct spl_points *p = &r->points;
    uint32_t met = 0;
    struct spl_plane *sums = calloc(r->planes.count + 1, sizeof *sums);
    assert_non_null(p->plane);
    for (size_t i = 0; i < p->count; i++) {
        uint32_t plane = p->plane[i];
        if (plane == SPL_NO_PLANE)
            continue;
        assert_true(plane <= met && plane < r->planes.count); /* in the order of their first points */
        met += plane == met;
        assert_false(p->linear && p->linear[i]);
        double off = off_plane(r, i);
        assert_true(off <= r->planes.bound * (1 + 1e-6) + 1e-9);
        sums[plane].points++;
        sums[plane].error_rms += off * off;
        sums[plane].error_max = fmax(sums[plane].error_max, off);
    }
    assert_int_equal(met, r->planes.count);
    for (uint32_t k = 0; k < r->planes.count; k++) {
        const struct spl_plane *plane = &r->planes.list[k];
        assert_int_equal(plane->points, sums[k].points);
        assert_true(plane->points >= SPL_PLANE_POINTS);
        assert_true(fabs(plane->error_max - sums[k].error_max) < 1e-6);
        assert_true(fabs(plane->error_rms - sqrt(sums[k].error_rms / (double)plane->points)) < 1e-6);
        assert_true(fabs(hypot(hypot(plane->normal[0], plane->normal[1]), plane->normal[2]) - 1) < 1e-9);
    }
    free(sums);
}

static void search(struct result *r, struct scene *s, double error, unsigned threads)
{
    struct spl_stage stage = quiet_stage(threads);
    struct spl_error err = {0};
    prepare(r, s, threads);
    assert_int_equal(spl_planes_find(&r->planes, &r->points, &(struct spl_planes_options){error}, &stage, &err), 0);
    check_promises(r);
}

static void finish(struct result *r)
{
    spl_planes_finish(&r->planes);
    spl_points_finish(&r->points);
    free(r->scene);
}

/* The share of all points that lie on planes. */
static double share_on_planes(const struct result *r)
{
    size_t on = 0;
    for (size_t i = 0; i < r->points.count; i++)
        on += r->points.plane[i] != SPL_NO_PLANE;
    return (double)on / (double)r->points.count;
}

/* The share of points on planes that are on one which most of whose points are of another kind. */
static double share_mixed(const struct result *r)
{
    uint32_t(*table)[kinds] = calloc(r->planes.count + 1, sizeof *table);
    size_t mixed = 0, on = 0;
    for (size_t i = 0; i < r->points.count; i++)
        if (r->points.plane[i] != SPL_NO_PLANE)
            table[r->points.plane[i]][r->scene->kind[r->points.color_class[i]]]++;
    for (uint32_t k = 0; k < r->planes.count; k++) {
        uint32_t largest = 0;
        for (int kind = 0; kind < kinds; kind++)
            largest = table[k][kind] > largest ? table[k][kind] : largest;
        mixed += r->planes.list[k].points - largest;
        on += r->planes.list[k].points;
    }
    free(table);
    return on ? (double)mixed / (double)on : 0;
}

static void print(const char *what, const struct result *r)
{
    printf("%s: %u planes, %.2f %% of %zu points, %.3f %% mixed, noise %.4g, bound %.4g\n", what, r->planes.count,
           100 * share_on_planes(r), r->points.count, 100 * share_mixed(r), r->planes.noise, r->planes.bound);
}

static void test_exact_plane(void **state)
{
    (void)state;
    struct result r;
    struct scene *s = new_scene(0);
    uint16_t above = add_station(s, 0, 0, 5);
    add_sheet(s, 0, above, 5000, (const double[3]){-1, -1, 0}, (const double[3]){2, 0, 0.4},
              (const double[3]){0, 2, -0.2});
    search(&r, s, 0, 2);
    print("exact plane", &r);
    assert_int_equal(r.planes.count, 1);
    assert_int_equal(r.planes.list[0].points, r.points.count);
    assert_true(r.planes.list[0].error_max < 1e-9);
    assert_true(r.planes.noise < 1e-9);
    assert_true(r.planes.list[0].normal[2] > 0.9); /* towards the station */
    finish(&r);
}

static void test_noisy_plane(void **state)
{
    (void)state;
    struct result r;
    struct scene *s = new_scene(0.0015);
    uint16_t below = add_station(s, 1, 1, -5);
    add_level(s, 0, below, 30000, 0, 0, 0, 3);
    search(&r, s, 0, 2);
    print("noise 1.5 mm", &r);
    assert_int_equal(r.planes.count, 1);
    assert_true(share_on_planes(&r) > 0.998);
    assert_true(fabs(r.planes.noise - 0.0015) < 0.0002);
    assert_true(fabs(r.planes.list[0].error_rms - 0.0015) < 0.0001);
    assert_true(r.planes.list[0].normal[2] < -1 + 1e-6);
    finish(&r);
}

/* Of two heaps far from each other, as of all of their points at once. */
static void test_moments_add_up(void **state)
{
    (void)state;
    struct spl_plane_moments part[3] = {0};
    for (int p = 0; p < 3; p++) { /* the first half, the second, all */
        const double origin[3] = {5, -3, 100};
        double count = 0, sum[3] = {0}, square[6] = {0};
        for (int i = p == 1 ? 40 : 0; i < (p == 0 ? 40 : 90); i++, count++) {
            double d[3] = {0.01 * i + (i < 40 ? 0 : 7), 0.02 * (i * i % 11), 0.3 * (i % 3) - (i < 40 ? 2 : 0)};
            for (int c = 0; c < 3; c++)
                sum[c] += d[c];
            for (int e = 0; e < 6; e++)
                square[e] += d[e < 3 ? 0 : e < 5 ? 1 : 2] * d[e < 3 ? e : e < 5 ? e - 2 : 2];
        }
        part[p] = spl_plane_moments_of(origin, count, sum, square);
    }
    spl_plane_moments_add(&part[0], &part[1]);
    assert_true(part[0].count == part[2].count);
    for (int c = 0; c < 3; c++)
        assert_float_equal(part[0].mean[c], part[2].mean[c], 1e-9);
    for (int e = 0; e < 6; e++)
        assert_float_equal(part[0].square[e], part[2].square[e], 1e-7);
}

/* Thin walls scanned from both sides. */
static void test_sheets_seen_from_both_sides(void **state)
{
    (void)state;
    const double gaps[] = {0.005, 0.01, 0.001}, noises[] = {0, 0.0015}, errors[] = {0, 0.01};
    for (int k = 0; k < 12; k++) {
        struct result r;
        struct scene *s = new_scene(noises[k / 3 % 2]);
        uint16_t above = add_station(s, 1, 1, 4), below = add_station(s, 1, 1, -4);
        add_level(s, 0, above, 20000, 0, 0, gaps[k % 3], 2);
        add_level(s, 1, below, 20000, 0, 0, 0, 2);
        search(&r, s, errors[k / 6], 2);
        print("two sheets, both sides", &r);
        assert_true(share_mixed(&r) == 0);
        assert_true(share_on_planes(&r) > 0.99);
        assert_true(r.planes.count >= 2 && r.planes.count <= 4);
        assert_true(r.planes.list[0].normal[2] * r.planes.list[1].normal[2] < 0);
        finish(&r);
    }
}

/* Nobody knows from where: what is left are the distances. */
static void test_sheets_without_stations(void **state)
{
    (void)state;
    const double noises[] = {0, 0.0005, 0.001};
    for (int k = 0; k < 3; k++) {
        struct result r;
        struct scene *s = new_scene(noises[k]);
        add_level(s, 0, 0, 20000, 0, 0, 0.005, 1);
        add_level(s, 1, 0, 20000, 0, 0, 0, 1);
        search(&r, s, 0, 2);
        print("two sheets, no stations", &r);
        assert_true(share_mixed(&r) < 0.01);
        assert_true(share_on_planes(&r) > 0.95);
        finish(&r);
    }
}

static void test_steps_stay_apart(void **state)
{
    (void)state;
    const double noises[] = {0, 0.0015};
    for (int k = 0; k < 2; k++) {
        struct result r;
        struct scene *s = new_scene(noises[k]);
        uint16_t above = add_station(s, 1, 1, 6);
        for (uint32_t step = 0; step < 8; step++)
            add_sheet(s, step, above, 6000, (const double[3]){0.3 * step, 0, 0.02 * step}, (const double[3]){0.3, 0, 0},
                      (const double[3]){0, 2, 0});
        search(&r, s, 0.01, 2);
        print("steps of 20 mm", &r);
        assert_true(share_mixed(&r) < 0.005);
        assert_true(share_on_planes(&r) > 0.97);
        assert_true(r.planes.count >= 8 && r.planes.count <= 12);
        finish(&r);
    }
}

/* A board of 5 mm on a floor, too small a share of it to make the floor uneven, is no part of it. */
static void test_a_low_board_on_a_large_floor(void **state)
{
    (void)state;
    struct result r;
    struct scene *s = new_scene(0.0003);
    uint16_t above = add_station(s, 2, 2, 3);
    size_t board = 0, on_floor = 0;
    for (int k = 0; k < 4; k++) { /* the floor around it */
        const double at[4][4] = {{0, 0, 1.8, 4}, {2.13, 0, 1.87, 4}, {1.8, 0, 0.33, 1.8}, {1.8, 2.13, 0.33, 1.87}};
        add_sheet(s, 0, above, (size_t)(6250 * at[k][2] * at[k][3]), (const double[3]){at[k][0], at[k][1], 0},
                  (const double[3]){at[k][2], 0, 0}, (const double[3]){0, at[k][3], 0});
    }
    add_level(s, 1, above, 700, 1.8, 1.8, 0.005, 0.33);
    search(&r, s, 0.0055, 2);
    print("board of 5 mm", &r);
    for (size_t i = 0; i < r.points.count; i++) {
        uint32_t plane = r.points.plane[i];
        if (s->kind[r.points.color_class[i]] != 1)
            continue;
        board++;
        on_floor += plane != SPL_NO_PLANE && fabs(r.planes.list[plane].origin[2]) < 0.0005;
    }
    assert_int_equal(board, 700);
    assert_true(on_floor < 140); /* next to nothing but what shares a run with the floor */
    finish(&r);
}

/* A table a metre away and the noisy floor of a far room: the table's front, 20 mm high, is less than four sigma of
 * that floor, and no part of the table's top. */
static void test_noise_is_what_it_is_nearby(void **state)
{
    (void)state;
    struct result r;
    struct scene *s = new_scene(0.0005);
    uint16_t station = add_station(s, 0.5, -1, 1);
    size_t front = 0, on_top = 0;
    add_level(s, 0, station, 24000, 0, 0, 0, 1);
    add_sheet(s, 1, station, 900, (const double[3]){0, 0, -0.02}, (const double[3]){1, 0, 0},
              (const double[3]){0, 0, 0.02});
    s->noise = 0.01;
    add_level(s, 2, station, 50000, -20, 20, -1, 10);
    search(&r, s, 0, 2);
    print("a table and a far floor", &r);
    for (size_t i = 0; i < r.points.count; i++) {
        uint32_t plane = r.points.plane[i];
        if (s->kind[r.points.color_class[i]] != 1)
            continue;
        front++;
        on_top += plane != SPL_NO_PLANE && fabs(r.planes.list[plane].normal[2]) > 0.9;
    }
    assert_int_equal(front, 900);
    assert_true(on_top < 180); /* within 4 mm of the edge */
    assert_true(r.planes.bound > 0.03);
    assert_true(share_on_planes(&r) > 0.97);
    finish(&r);
}

/* A cube seen from outside: away from the edges each point is on its own face's plane, at them on one of the two. */
static void test_edges_of_a_box(void **state)
{
    (void)state;
    struct result r;
    struct scene *s = new_scene(0.001);
    size_t wrong = 0, inner = 0, on = 0;
    uint16_t near = add_station(s, 4, 4, 4), far = add_station(s, -4, -4, -4);
    for (int c = 0; c < 3; c++)
        for (int side = 0; side < 2; side++) {
            double origin[3] = {0}, u[3] = {0}, v[3] = {0};
            origin[c] = side;
            u[(c + 1) % 3] = v[(c + 2) % 3] = 1;
            add_sheet(s, (uint32_t)(2 * c + side), side ? near : far, 10000, origin, u, v);
        }
    search(&r, s, 0, 2);
    print("box", &r);
    for (size_t i = 0; i < r.points.count; i++) {
        uint32_t kind = s->kind[r.points.color_class[i]], plane = r.points.plane[i];
        double edge = 1;
        for (int c = 0; c < 3; c++)
            if (c != (int)kind / 2)
                edge = fmin(edge, fmin(r.points.axis[c][i], 1 - r.points.axis[c][i]));
        if (edge < 2 * r.planes.bound)
            continue;
        inner++;
        if (plane == SPL_NO_PLANE)
            continue;
        on++;
        wrong += fabs(r.planes.list[plane].normal[kind / 2]) < 0.99;
    }
    assert_int_equal(wrong, 0);
    assert_true((double)on > 0.99 * (double)inner);
    assert_true(share_on_planes(&r) > 0.98);
    assert_true(r.planes.count >= 6 && r.planes.count <= 9);
    finish(&r);
}

/* Curved things become facets; that they keep to the bound, check_promises() sees. */
static void test_curved_things_are_facets(void **state)
{
    (void)state;
    for (int sphere = 0; sphere < 2; sphere++) {
        struct result r;
        struct scene *s = new_scene(0.0005);
        uint16_t out = add_station(s, 9, 0, 0);
        for (int i = 0; i < 40000; i++) {
            double angle = 2 * M_PI * uniform(&s->random), z = 2 * uniform(&s->random) - 1;
            double flat = sphere ? sqrt(1 - z * z) : 1;
            const double n[3] = {flat * cos(angle), flat * sin(angle), sphere ? z : 0};
            const double at[3] = {0.5 * n[0], 0.5 * n[1], sphere ? 0.5 * n[2] : z};
            if (n[0] > 0.15)
                add(s, 0, out, at, n);
        }
        search(&r, s, 0.006, 2);
        print(sphere ? "sphere" : "cylinder", &r);
        assert_true(share_on_planes(&r) > 0.8);
        assert_true(r.planes.count > 6 && r.planes.count < 400);
        for (uint32_t k = 0; k < r.planes.count; k++) /* half the bound: no facet is off to one side */
            assert_true(r.planes.list[k].error_rms < 0.003);
        finish(&r);
    }
}

static void test_a_volume_has_no_planes(void **state)
{
    (void)state;
    for (int k = 0; k < 2; k++) {
        struct result r;
        struct scene *s = new_scene(0);
        for (int i = 0; i < 40000; i++) {
            const double at[3] = {2 * uniform(&s->random), 2 * uniform(&s->random), 2 * uniform(&s->random)};
            add(s, 0, 0, at, (const double[3]){0, 0, 1});
        }
        search(&r, s, k ? 0.01 : 0, 2);
        print("volume", &r);
        assert_int_equal(r.planes.count, 0);
        finish(&r);
    }
}

/* A wall behind foliage is a plane, and takes nothing of the foliage that its plane runs through. */
static void test_a_plane_ends_at_foliage(void **state)
{
    (void)state;
    struct result r;
    struct scene *s = new_scene(0.001);
    size_t taken = 0;
    add_level(s, 0, 0, 20000, 0, 0, 0, 2);
    for (int i = 0; i < 40000; i++) {
        const double at[3] = {2 + 2 * uniform(&s->random), 2 * uniform(&s->random), 2 * uniform(&s->random) - 1};
        add(s, 1, 0, at, (const double[3]){0, 0, 1});
    }
    search(&r, s, 0, 2);
    print("plane beside foliage", &r);
    for (size_t i = 0; i < r.points.count; i++)
        taken += r.points.plane[i] != SPL_NO_PLANE && s->kind[r.points.color_class[i]] == 1;
    assert_true(taken < 100);
    assert_true(share_on_planes(&r) > 0.32);
    finish(&r);
}

static void test_far_scan_lines(void **state)
{
    (void)state;
    struct result r;
    struct scene *s = new_scene(0.0015);
    uint16_t station = add_station(s, 5, -2, 1.7);
    for (double y = 0; y < 10; y += 0.3)
        for (double x = 0.01 * uniform(&s->random); x < 10; x += 0.01)
            add(s, 0, station, (const double[3]){x, y, 0}, (const double[3]){0, 0, 1});
    search(&r, s, 0, 2);
    print("scan lines", &r);
    assert_true(share_on_planes(&r) > 0.99);
    assert_true(r.planes.count <= 3);
    finish(&r);
}

static void test_density_steps(void **state)
{
    (void)state;
    struct result r;
    struct scene *s = new_scene(0.001);
    size_t sparse = 0;
    uint16_t station = add_station(s, 0, 0, 3);
    add_level(s, 0, station, 40000, 0, 0, 0, 1);
    add_sheet(s, 1, station, 3000, (const double[3]){1, 0, 0}, (const double[3]){3, 0, 0}, (const double[3]){0, 3, 0});
    search(&r, s, 0, 2);
    print("density step", &r);
    for (size_t i = 0; i < r.points.count; i++)
        sparse += s->kind[r.points.color_class[i]] == 1 && r.points.plane[i] != SPL_NO_PLANE;
    assert_true(sparse > 2950);
    assert_true(r.planes.count <= 2);
    finish(&r);
}

/* Walls, a floor, a thin wall, a sphere, foliage. */
static struct scene *mixed_scene(double noise, const double offset[3])
{
    struct scene *s = new_scene(noise);
    uint16_t a = add_station(s, 2 + offset[0], 2 + offset[1], 1.5 + offset[2]);
    uint16_t b = add_station(s, 3.5 + offset[0], 3 + offset[1], 1.5 + offset[2]);
    add_level(s, 0, a, 15000, 0, 0, 0, 4);
    add_sheet(s, 1, b, 10000, (double[3]){0, 0, 0}, (double[3]){4, 0, 0}, (double[3]){0, 0, 2});
    add_sheet(s, 2, a, 8000, (double[3]){2.5, 0, 0}, (double[3]){0, 4, 0}, (double[3]){0, 0, 2});
    add_sheet(s, 3, b, 8000, (double[3]){2.51, 0, 0}, (double[3]){0, 4, 0}, (double[3]){0, 0, 2});
    for (int i = 0; i < 8000; i++) {
        double angle = 2 * M_PI * uniform(&s->random), z = 2 * uniform(&s->random) - 1, flat = sqrt(1 - z * z);
        const double n[3] = {flat * cos(angle), flat * sin(angle), z};
        add(s, 4, a, (const double[3]){1 + 0.4 * n[0], 1 + 0.4 * n[1], 1 + 0.4 * n[2]}, n);
        for (int k = 0; k < 1; k++)
            add(s, 5, b, (const double[3]){3 + uniform(&s->random), 1 + uniform(&s->random), uniform(&s->random)}, n);
    }
    for (size_t i = 0; i < s->count; i++)
        for (int c = 0; c < 3; c++) /* a grid that doubles keep wherever it lies */
            s->position[i][c] = ldexp(round(ldexp(s->position[i][c], 20)), -20) + offset[c];
    return s;
}

static void test_utm(void **state)
{
    (void)state;
    struct result here, there;
    const double offset[3] = {406000, 5400000, 128};
    search(&here, mixed_scene(0.001, (const double[3]){0, 0, 0}), 0, 2);
    search(&there, mixed_scene(0.001, offset), 0, 2);
    print("at UTM coordinates", &there);
    assert_int_equal(here.planes.count, there.planes.count);
    assert_memory_equal(here.points.plane, there.points.plane, here.points.count * sizeof *here.points.plane);
    for (uint32_t k = 0; k < here.planes.count; k++)
        for (int c = 0; c < 3; c++) {
            assert_true(fabs(here.planes.list[k].normal[c] - there.planes.list[k].normal[c]) < 1e-6);
            assert_true(fabs(here.planes.list[k].origin[c] + offset[c] - there.planes.list[k].origin[c]) < 1e-6);
        }
    finish(&here);
    finish(&there);
}

static void test_threads_agree(void **state)
{
    (void)state;
    struct result one, other;
    const double none[3] = {0};
    search(&one, mixed_scene(0.0015, none), 0, 1);
    print("mixed", &one);
    for (unsigned threads = 2; threads <= 5; threads += 3) {
        search(&other, mixed_scene(0.0015, none), 0, threads);
        assert_int_equal(one.planes.count, other.planes.count);
        assert_memory_equal(one.points.plane, other.points.plane, one.points.count * sizeof *one.points.plane);
        assert_memory_equal(one.planes.list, other.planes.list, one.planes.count * sizeof *one.planes.list);
        finish(&other);
    }
    finish(&one);
}

/* A scan line on a floor that was taken for a wire is none; a wire above it is. */
static void test_wires_are_no_planes(void **state)
{
    (void)state;
    struct result r;
    struct spl_stage stage = quiet_stage(2);
    struct scene *s = new_scene(0);
    add_level(s, 0, 0, 5000, 0, 0, 0, 1);
    for (int i = 0; i < 300; i++)
        add(s, 1, 0, (const double[3]){i / 300.0, 0.4, 0.05}, (const double[3]){0, 0, 1});
    prepare(&r, s, 2);
    r.points.linear = calloc(r.points.count, 1);
    for (size_t i = 0; i < r.points.count; i++)
        r.points.linear[i] = i % 3 == 0 || s->kind[r.points.color_class[i]] == 1;
    assert_int_equal(spl_planes_find(&r.planes, &r.points, &(struct spl_planes_options){0}, &stage, NULL), 0);
    check_promises(&r);
    for (size_t i = 0; i < r.points.count; i++) {
        bool wire = s->kind[r.points.color_class[i]] == 1;
        assert_int_equal(r.points.linear[i], wire);
        assert_int_equal(r.points.plane[i], wire ? SPL_NO_PLANE : 0);
    }
    finish(&r);
}

static void test_few_points(void **state)
{
    (void)state;
    const size_t counts[] = {1, 2, 3, 29, SPL_PLANE_POINTS - 1, SPL_PLANE_POINTS};
    for (size_t k = 0; k < sizeof counts / sizeof *counts; k++) {
        struct result r;
        struct scene *s = new_scene(0);
        add_level(s, 0, 0, counts[k], 0, 0, 0, 1);
        search(&r, s, 0, 2);
        assert_int_equal(r.planes.count, counts[k] >= SPL_PLANE_POINTS);
        finish(&r);
    }
}

static void test_lines_have_no_plane(void **state)
{
    (void)state;
    struct result r;
    struct scene *s = new_scene(0);
    for (int i = 0; i < 5000; i++)
        add(s, 0, 0, (const double[3]){0.001 * i, 0.002 * i, 0.0005 * i}, (const double[3]){0, 0, 1});
    search(&r, s, 0, 2);
    assert_int_equal(r.planes.count, 0);
    finish(&r);
}

static void test_cancelled(void **state)
{
    (void)state;
    struct result r;
    atomic_bool cancelled = true;
    struct spl_stage stage = {.threads = 2, .cancelled = &cancelled};
    struct spl_error err = {0};
    struct scene *s = new_scene(0.001);
    add_level(s, 0, 0, 20000, 0, 0, 0, 1);
    prepare(&r, s, 2);
    assert_int_equal(spl_planes_find(&r.planes, &r.points, &(struct spl_planes_options){0}, &stage, &err),
                     SPL_E_CANCELLED);
    assert_null(r.points.plane);
    assert_null(r.planes.list);
    assert_int_equal(r.planes.count, 0);
    finish(&r);
}

static void test_out_of_memory(void **state)
{
    (void)state;
    struct result r;
    struct spl_stage stage = quiet_stage(1);
    const double none[3] = {0};
    prepare(&r, mixed_scene(0.001, none), 1);
    int rc = SPL_E_NOMEM;
    long n = 0;
    while (rc) {
        struct spl_error err = {0};
        spl_memory_fail_after(++n);
        rc = spl_planes_find(&r.planes, &r.points, &(struct spl_planes_options){0}, &stage, &err);
        spl_memory_fail_after(0);
        assert_true(rc == 0 || rc == SPL_E_NOMEM);
        assert_true(rc == 0 || (!r.points.plane && !r.planes.list && err.code == SPL_E_NOMEM));
        if (rc && n > 40)
            n += n / 8; /* lists of patches grow many times */
    }
    assert_true(n > 20);
    check_promises(&r);
    finish(&r);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_exact_plane),
        cmocka_unit_test(test_noisy_plane),
        cmocka_unit_test(test_moments_add_up),
        cmocka_unit_test(test_sheets_seen_from_both_sides),
        cmocka_unit_test(test_sheets_without_stations),
        cmocka_unit_test(test_steps_stay_apart),
        cmocka_unit_test(test_a_low_board_on_a_large_floor),
        cmocka_unit_test(test_noise_is_what_it_is_nearby),
        cmocka_unit_test(test_edges_of_a_box),
        cmocka_unit_test(test_curved_things_are_facets),
        cmocka_unit_test(test_a_volume_has_no_planes),
        cmocka_unit_test(test_a_plane_ends_at_foliage),
        cmocka_unit_test(test_far_scan_lines),
        cmocka_unit_test(test_density_steps),
        cmocka_unit_test(test_utm),
        cmocka_unit_test(test_threads_agree),
        cmocka_unit_test(test_wires_are_no_planes),
        cmocka_unit_test(test_few_points),
        cmocka_unit_test(test_lines_have_no_plane),
        cmocka_unit_test(test_cancelled),
        cmocka_unit_test(test_out_of_memory),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
