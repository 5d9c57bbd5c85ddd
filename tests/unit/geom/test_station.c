/* Poses of scanners: which are poses at all, and where somebody looks who stands there. */
#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <string.h>
#include <cmocka.h>

#include "geom/station.h"

static const double upright[3] = {0, 0, 1};

/* Columns x, y and z of the pose. */
static void make_pose(double pose[16], const double x[3], const double y[3], const double z[3])
{
    memset(pose, 0, 16 * sizeof *pose);
    for (int i = 0; i < 3; i++) {
        pose[4 * i] = x[i];
        pose[4 * i + 1] = y[i];
        pose[4 * i + 2] = z[i];
    }
    pose[15] = 1;
}

static void assert_looks(const double pose[16], const double about[3], const double wanted[3])
{
    double forward[3], up[3], length = hypot(hypot(about[0], about[1]), about[2]);
    spl_station_look(pose, about, forward, up);
    for (int i = 0; i < 3; i++) {
        assert_true(fabs(forward[i] - wanted[i]) < 1e-12);
        assert_true(fabs(up[i] - about[i] / length) < 1e-12);
    }
}

static void scanners_look_ahead_and_level(void **state)
{
    (void)state;
    double pose[16];
    const double s = sin(0.3), c = cos(0.3);
    make_pose(pose, (double[]){0, 1, 0}, (double[]){-1, 0, 0}, upright);
    assert_looks(pose, upright, (double[]){0, 1, 0});
    assert_looks(pose, (double[]){0, 0, 2.5e200}, (double[]){0, 1, 0}); /* its length says nothing */
    make_pose(pose, (double[]){0, c, s}, (double[]){-1, 0, 0}, (double[]){0, -s, c}); /* leans back */
    assert_looks(pose, upright, (double[]){0, 1, 0});
    make_pose(pose, (double[]){1, 0, 0}, (double[]){0, -1, 0}, (double[]){0, 0, -1}); /* hangs from a ceiling */
    assert_looks(pose, upright, (double[]){1, 0, 0});
    make_pose(pose, (double[]){1, 0, 0}, (double[]){0, 0, -1}, (double[]){0, 1, 0}); /* in a world whose up is -y */
    assert_looks(pose, (double[]){0, 3, 0}, (double[]){1, 0, 0});
}

static void cameras_look_along_z(void **state)
{
    (void)state;
    double pose[16];
    const double s = sin(0.7), c = cos(0.7); /* 40 degrees below the horizon */
    make_pose(pose, (double[]){0, -1, 0}, (double[]){0, 0, -1}, (double[]){1, 0, 0});
    assert_looks(pose, upright, (double[]){1, 0, 0});
    make_pose(pose, (double[]){0, -1, 0}, (double[]){-s, 0, -c}, (double[]){c, 0, -s});
    assert_looks(pose, upright, (double[]){1, 0, 0});
}

/* Whatever numbers a file has, what comes out is a direction. */
static void what_is_no_rotation_stands_upright(void **state)
{
    (void)state;
    double pose[16];
    make_pose(pose, (double[]){0, 1, 0}, (double[]){1, 0, 0}, upright); /* mirrored */
    assert_looks(pose, upright, (double[]){1, 0, 0});
    make_pose(pose, (double[]){0, 0, 0}, (double[]){0, 0, 0}, (double[]){0, 0, 0});
    assert_looks(pose, upright, (double[]){1, 0, 0});
    assert_looks(pose, (double[]){1, 0, 0}, (double[]){0, 0, 1}); /* the axis beside it */
    make_pose(pose, (double[]){1e15, 1e15, 0}, (double[]){-1e15, 0, 3}, (double[]){0, 1, 1e-300});
    assert_looks(pose, upright, (double[]){1, 0, 0});
    make_pose(pose, (double[]){0, 0.9999, 0.0001}, (double[]){-1.0001, 0, 0}, upright); /* six digits are one, though */
    double forward[3], up[3];
    spl_station_look(pose, upright, forward, up);
    assert_true(fabs(forward[1] - 1) < 1e-6);
}

static void poses_are_judged(void **state)
{
    (void)state;
    double pose[16];
    make_pose(pose, (double[]){1, 0, 0}, (double[]){0, 1, 0}, upright);
    pose[3] = -1e15;
    assert_null(spl_station_judge(pose));
    static const double bad[] = {1.001e15, -1e300, INFINITY, NAN};
    for (size_t i = 0; i < sizeof bad / sizeof *bad; i++)
        for (int at = 0; at < 12; at++) {
            double other[16];
            memcpy(other, pose, sizeof other);
            other[at] = bad[i];
            assert_non_null(strstr(spl_station_judge(other), "1e15"));
        }
    for (int at = 12; at < 16; at++) {
        double other[16];
        memcpy(other, pose, sizeof other);
        other[at] += 1e-5;
        assert_non_null(strstr(spl_station_judge(other), "0 0 0 1"));
        other[at] = NAN;
        assert_non_null(spl_station_judge(other));
    }
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(scanners_look_ahead_and_level),
        cmocka_unit_test(cameras_look_along_z),
        cmocka_unit_test(what_is_no_rotation_stands_upright),
        cmocka_unit_test(poses_are_judged),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
