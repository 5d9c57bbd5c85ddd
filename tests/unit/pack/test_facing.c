/* Two sides of a wall, of which one is scanned less densely than the wall is thick: each keeps to its own points, where
 * stations or normals tell them apart, however rough the other side is and however aslant both are seen; what lies on
 * one side, though others see it, stays together. */
#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>

#include <cmocka.h>

#include "base/memory.h"
#include "clouds.h"
#include "pack/order.h"

enum { points_most = 100000 };
static const double smooth = 0.002;

struct scene {
    double (*position)[3];
    uint16_t *station;
    float (*normal)[3];
    size_t count;
    uint64_t random;
};

static struct scene begin(void)
{
    struct scene s = {.position = spl_alloc(points_most, sizeof(double[3]), NULL),
                      .station = spl_alloc(points_most + SPL_POINTS_PAD, sizeof(uint16_t), NULL),
                      .normal = spl_alloc(points_most + SPL_POINTS_PAD, sizeof(float[3]), NULL),
                      .random = 5};
    assert_true(s.position && s.station && s.normal);
    return s;
}

/* The rectangle from `low` to `high`, which are the same in one coordinate, of so many stations by turns from the first
 * on; its normal is `sign` along that coordinate, where points are off by `noise` at most. */
static void add_rough_sheet(struct scene *s, const double low[3], const double high[3], double spacing, int first,
                            int stations, int sign, double noise)
{
    int flat = low[0] == high[0] ? 0 : low[1] == high[1] ? 1 : 2, u = (flat + 1) % 3, v = (flat + 2) % 3;
    for (double a = low[u]; a <= high[u]; a += spacing)
        for (double b = low[v]; b <= high[v]; b += spacing) {
            double *at = s->position[s->count];
            assert_true(s->count < points_most);
            at[flat] = low[flat] + noise * (2 * uniform(&s->random) - 1);
            at[u] = a + 0.3 * spacing * uniform(&s->random);
            at[v] = b + 0.3 * spacing * uniform(&s->random);
            s->normal[s->count][flat] = (float)sign;
            s->station[s->count] = (uint16_t)(first + (int)(s->count % (size_t)stations));
            s->count++;
        }
}

static void add_sheet(struct scene *s, const double low[3], const double high[3], double spacing, int first,
                      int stations, int sign)
{
    add_rough_sheet(s, low, high, spacing, first, stations, sign, smooth);
}

enum told { BY_STATIONS, BY_NORMALS, BY_ONE_STATION };

/* Ordered, with normals and radii; the scene stays. */
static struct spl_points finish(const struct scene *s, enum told told, const double stations[2][3])
{
    struct spl_points p = cloud_of((const double(*)[3])s->position, s->count);
    struct spl_stage stage = quiet_stage(2);
    if (told == BY_NORMALS) {
        p.normal = spl_alloc(s->count + SPL_POINTS_PAD, sizeof *p.normal, NULL);
        memcpy(p.normal, s->normal, s->count * sizeof *p.normal);
    } else {
        p.station = spl_alloc(s->count + SPL_POINTS_PAD, sizeof *p.station, NULL);
        p.stations = spl_alloc(2, sizeof *p.stations, NULL);
        p.station_count = 2;
        for (int k = 0; k < 2; k++)
            for (int c = 0; c < 3; c++)
                p.stations[k][4 * c + 3] = stations[k][c];
        for (size_t i = 0; i < s->count; i++)
            p.station[i] = told == BY_STATIONS ? s->station[i] : 0;
    }
    assert_int_equal(spl_points_order(&p, &stage, NULL), 0);
    assert_int_equal(spl_surface(&p, 12, true, &stage, NULL), 0);
    return p;
}

static void clear(struct scene *s)
{
    free(s->position);
    free(s->station);
    free(s->normal);
}

/* Of a wall across x from 0 to `thick`, outside at least `rim` from its edges: all show to -x, with radii that close.
 */
static void check_outside(const struct spl_points *p, double thick, double spacing, double rim)
{
    size_t outside = 0, turned = 0, small = 0;
    for (size_t i = 0; i < p->count; i++) {
        const double y = p->axis[1][i], z = p->axis[2][i];
        if (p->axis[0][i] > thick / 2 || y < rim || y > 4 - rim || z < rim || z > 4 - rim)
            continue;
        outside++;
        turned += p->normal[i][0] > -0.98f;
        small += p->radius[i] < 0.6 * spacing || p->radius[i] > 2.5 * spacing;
    }
    assert_true(outside > 80);
    if (turned || small > outside / 50)
        fail_msg("%zu of %zu are turned, %zu have another radius than their surface's", turned, outside, small);
}

static const double both_sides[2][3] = {{-5, 1, 1.5}, {3, 2.5, 1.5}};

/* Points so far apart on its outside and its inside. */
static void check_wall(double thick, double outside, double inside)
{
    struct scene s = begin();
    add_sheet(&s, (double[3]){0, 0, 0}, (double[3]){0, 4, 4}, outside, 0, 1, -1);
    add_sheet(&s, (double[3]){thick, 0, 0}, (double[3]){thick, 4, 4}, inside, 1, 1, 1);
    for (int told = BY_STATIONS; told <= BY_NORMALS; told++) {
        struct spl_points p = finish(&s, told, both_sides);
        check_outside(&p, thick, outside, 0.5);
        spl_points_finish(&p);
    }
    clear(&s);
}

static void test_a_wall_is_thinner_than_its_points_are_apart(void **state)
{
    (void)state;
    check_wall(0.24, 0.25, 0.05);
}

/* All of the nearest 64 and more are the other side's. */
static void test_a_partition_is_a_twentieth_as_dense_on_one_side(void **state)
{
    (void)state;
    check_wall(0.05, 0.1, 0.0225);
}

/* Standard deviations of 0.2 and 0.3 of the spacing: its own neighbours lie in no plane. */
static void test_the_other_side_is_rough(void **state)
{
    (void)state;
    for (int tenths = 2; tenths <= 3; tenths++) {
        struct scene s = begin();
        add_sheet(&s, (double[3]){0, 0, 0}, (double[3]){0, 4, 4}, 0.1, 0, 1, -1);
        add_rough_sheet(&s, (double[3]){0.12, 0, 0}, (double[3]){0.12, 4, 4}, 0.02, 1, 1, 1,
                        0.02 * tenths / 10 * sqrt(3));
        struct spl_points p = finish(&s, BY_STATIONS, both_sides);
        check_outside(&p, 0.12, 0.1, 0.5);
        spl_points_finish(&p);
        clear(&s);
    }
}

/* From stations 1 m off the wall and 4 m aside: both look at it in nearly one direction. */
static void test_both_sides_are_seen_aslant(void **state)
{
    (void)state;
    struct scene s = begin();
    add_sheet(&s, (double[3]){0, 0, 0}, (double[3]){0, 4, 4}, 0.1, 0, 1, -1);
    add_sheet(&s, (double[3]){0.12, 0, 0}, (double[3]){0.12, 4, 4}, 0.0225, 1, 1, 1);
    struct spl_points p = finish(&s, BY_STATIONS, (const double[2][3]){{-1, -4, 2}, {1.12, -4, 2}});
    check_outside(&p, 0.12, 0.1, 0.5);
    spl_points_finish(&p);
    clear(&s);
}

/* As where one station saw all of it, but for so many. */
static void check_same(const struct scene *s, const double stations[2][3], size_t but)
{
    struct spl_points p = finish(s, BY_STATIONS, stations), alone = finish(s, BY_ONE_STATION, stations);
    size_t others = 0;
    for (size_t i = 0; i < p.count; i++) {
        bool same = p.radius[i] == alone.radius[i];
        for (int c = 0; c < 3; c++)
            same &= fabsf(p.normal[i][c]) == fabsf(alone.normal[i][c]);
        others += !same;
    }
    if (others > but)
        fail_msg("%zu of %zu have another normal or radius", others, p.count);
    spl_points_finish(&p);
    spl_points_finish(&alone);
}

/* From two stations that look against each other. */
static void test_a_floor_between_stations_stays_together(void **state)
{
    (void)state;
    struct scene s = begin();
    add_sheet(&s, (double[3]){0, 0, 0}, (double[3]){4, 4, 0}, 0.05, 0, 2, 1);
    check_same(&s, (const double[2][3]){{-8, 2, 1}, {12, 2, 1}}, 0);
    clear(&s);
}

/* Each face is seen by one of them, and lies behind the other face. A row beside the edge may look like a sheet. */
static void test_faces_around_an_edge_are_neighbours(void **state)
{
    (void)state;
    struct scene s = begin();
    add_sheet(&s, (double[3]){0, 0, 0}, (double[3]){0, 2, 2}, 0.05, 0, 1, -1);
    add_sheet(&s, (double[3]){0, 0, 0}, (double[3]){2, 0, 2}, 0.05, 1, 1, -1);
    check_same(&s, (const double[2][3]){{-4, 1, 1}, {1, -4, 1}}, 0);
    clear(&s);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_a_wall_is_thinner_than_its_points_are_apart),
        cmocka_unit_test(test_a_partition_is_a_twentieth_as_dense_on_one_side),
        cmocka_unit_test(test_the_other_side_is_rough),
        cmocka_unit_test(test_both_sides_are_seen_aslant),
        cmocka_unit_test(test_a_floor_between_stations_stays_together),
        cmocka_unit_test(test_faces_around_an_edge_are_neighbours),
    };
    return cmocka_run_group_tests_name("facing", tests, NULL, NULL);
}
