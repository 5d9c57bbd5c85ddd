/* The way between keys: through every key, without a jump in place, speed or spin, closed where it is said to be,
 * whatever the signs of quaternions and however uneven the times. */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <math.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <cmocka.h>

#include "geom/camera_path.h"
#include "geom/quaternion.h"

enum { keys = 6 };

static const double origin[3] = {400000, 5600000, 100}; /* UTM: cancellation would show */
static const double eyes[keys][3] = {{0, 0, 0}, {1, 0, 0.5}, {5, 2, 1}, {5.2, 2.1, 1}, {4, 6, 3}, {-2, 3, 0}};
static const double uneven[keys] = {-3, -1.5, 0, 0.25, 4, 5};

static struct spl_camera make_camera(int i)
{
    struct spl_camera camera = {.fx = 500 + 40 * i,
                                .fy = 510,
                                .cx = 320 + i,
                                .cy = 240,
                                .width = 640,
                                .height = 480,
                                .near = 0.1 + i,
                                .far = INFINITY};
    double eye[3], target[3];
    for (int a = 0; a < 3; a++) {
        eye[a] = origin[a] + eyes[i][a];
        target[a] = eye[a] + (a == 0 ? cos(1.7 * i) : a == 1 ? sin(1.7 * i) : 0.3 * i - 0.5);
    }
    assert_int_equal(spl_camera_look_at(&camera, eye, target, (double[3]){0, 0, 1}, NULL), 0);
    return camera;
}

static struct spl_camera_path make_path(int count, const double *times)
{
    struct spl_camera_path path = {0};
    for (int i = 0; i < count; i++) {
        struct spl_camera camera = make_camera(i);
        assert_int_equal(spl_camera_path_add(&path, &camera, times ? times[i] : NAN, NULL), 0);
    }
    return path;
}

static double angle_between(const struct spl_camera *a, const struct spl_camera *b)
{
    double p[4], q[4], turn[3];
    spl_quaternion_from_matrix(a->rotation, p);
    spl_quaternion_from_matrix(b->rotation, q);
    spl_quaternion_turn(p, q, true, turn);
    return sqrt(turn[0] * turn[0] + turn[1] * turn[1] + turn[2] * turn[2]);
}

static double distance(const struct spl_camera *a, const struct spl_camera *b)
{
    return hypot(hypot(a->eye[0] - b->eye[0], a->eye[1] - b->eye[1]), a->eye[2] - b->eye[2]);
}

static struct spl_camera *sample(const struct spl_camera_path *path, struct spl_path_motion motion, size_t frames)
{
    struct spl_camera *out = calloc(frames, sizeof *out);
    struct spl_error err = {0};
    assert_int_equal(spl_camera_path_sample(path, &motion, frames, out, &err), 0);
    return out;
}

static void assert_same(const struct spl_camera *a, const struct spl_camera *b)
{
    assert_true(distance(a, b) < 1e-8 && angle_between(a, b) < 1e-7);
    assert_true(fabs(a->fx - b->fx) < 1e-9 && fabs(a->cx - b->cx) < 1e-9 && fabs(a->near - b->near) < 1e-9);
}

/* Evenly timed keys lie on every (n-1)/(keys-1)th frame. */
static void test_passes_through_keys(void **state)
{
    (void)state;
    const double even[keys] = {0, 1, 2, 3, 4, 5};
    for (int kind = 0; kind < SPL_POSITIONS_COUNT * SPL_ROTATIONS_COUNT; kind++) {
        struct spl_camera_path path = make_path(keys, even);
        struct spl_path_motion motion = {.positions = kind / 2, .rotations = kind % 2};
        struct spl_camera *frames = sample(&path, motion, 10 * (keys - 1) + 1);
        for (size_t i = 0; i < keys; i++)
            assert_same(&frames[10 * i], &path.cameras[i]);
        free(frames);
        spl_camera_path_finish(&path);
    }
}

/* Between inner keys, whatever their times, a parabola is met exactly: its slopes are what the keys around say. */
static void test_parabolas_are_exact(void **state)
{
    (void)state;
    const double times[4] = {0, 1, 3, 4};
    struct spl_camera_path path = {0};
    for (int i = 0; i < 4; i++) {
        struct spl_camera camera = make_camera(0);
        camera.eye[0] += times[i] * times[i];
        camera.eye[1] -= 3 * times[i] * times[i] + times[i];
        assert_int_equal(spl_camera_path_add(&path, &camera, times[i], NULL), 0);
    }
    struct spl_camera *frames = sample(&path, (struct spl_path_motion){0}, 41), first = make_camera(0);
    for (int i = 10; i <= 30; i++) {
        double t = 0.1 * i;
        assert_true(fabs(frames[i].eye[0] - first.eye[0] - t * t) < 1e-6);
        assert_true(fabs(frames[i].eye[1] - first.eye[1] + 3 * t * t + t) < 1e-6);
    }
    free(frames);
    spl_camera_path_finish(&path);
}

/* Steps of `frames` frames differ by no more than a bound that falls with the square of the step: no jump in speed. */
static double largest_bend(const struct spl_camera_path *path, struct spl_path_motion motion, size_t frames,
                           double *spin)
{
    struct spl_camera *f = sample(path, motion, frames);
    double bend = 0;
    *spin = 0;
    for (size_t i = 1; i + 1 < frames; i++) {
        double a[4], b[4], c[4], in[3], out[3], jump[3];
        spl_quaternion_from_matrix(f[i - 1].rotation, a);
        spl_quaternion_from_matrix(f[i].rotation, b);
        spl_quaternion_from_matrix(f[i + 1].rotation, c);
        spl_quaternion_turn(a, b, true, in);
        spl_quaternion_turn(b, c, true, out);
        for (int k = 0; k < 3; k++) {
            jump[k] = out[k] - in[k];
            bend = fmax(bend, fabs(f[i + 1].eye[k] - 2 * f[i].eye[k] + f[i - 1].eye[k]));
            *spin = fmax(*spin, fabs(jump[k]));
        }
    }
    free(f);
    return bend;
}

static void test_velocity_is_continuous(void **state)
{
    (void)state;
    for (int kind = 0; kind < 6; kind++) {
        struct spl_camera_path path = make_path(keys, kind % 3 == 2 ? uneven : NULL);
        path.closed = kind >= 3;
        struct spl_path_motion motion = {.positions =
                                             kind % 3 == 1 ? SPL_POSITIONS_UNIFORM : SPL_POSITIONS_CENTRIPETAL};
        double spin[2], bend[2];
        for (int i = 0; i < 2; i++)
            bend[i] = largest_bend(&path, motion, i ? 40001 : 4001, &spin[i]);
        assert_true(bend[1] < bend[0] / 50 && spin[1] < spin[0] / 50); /* 1/100 when smooth, 1/10 with a corner */
        motion.rotations = SPL_ROTATIONS_SLERP;
        motion.positions = SPL_POSITIONS_LINEAR;
        for (int i = 0; i < 2; i++)
            bend[i] = largest_bend(&path, motion, i ? 40001 : 4001, &spin[i]);
        assert_true(bend[1] > bend[0] / 50 && spin[1] > spin[0] / 50); /* the check sees corners */
        spl_camera_path_finish(&path);
    }
}

static void test_closed_loop_closes(void **state)
{
    (void)state;
    struct spl_camera_path path = make_path(keys, NULL);
    path.closed = true;
    struct spl_path_motion motion = {0};
    struct spl_camera *f = sample(&path, motion, 1000), *twice = sample(&path, motion, 2000);
    assert_same(&f[0], &path.cameras[0]);
    double step = distance(&f[999], &f[0]), before = distance(&f[998], &f[999]);
    assert_true(step > 0.5 * before && step < 2 * before);
    for (size_t i = 0; i < 1000; i++)
        assert_same(&f[i], &twice[2 * i]);
    free(twice);
    free(f);
    spl_camera_path_finish(&path);
}

/* q and -q are one rotation: matrices make either, and a turn takes the short way in both. */
static void test_signs_of_quaternions_do_not_matter(void **state)
{
    (void)state;
    double a[4] = {0.6, 0.8, 0, 0}, b[4] = {-0.5, -0.5, 0.5, -0.5}, minus[4] = {0.5, 0.5, -0.5, 0.5}, v[3], w[3], q[4];
    spl_quaternion_turn(a, b, true, v);
    spl_quaternion_turn(a, minus, true, w);
    assert_memory_equal(v, w, sizeof v);
    assert_true(sqrt(v[0] * v[0] + v[1] * v[1] + v[2] * v[2]) <= M_PI);
    spl_quaternion_advance(a, v, 1, q);
    double same = q[0] * b[0] + q[1] * b[1] + q[2] * b[2] + q[3] * b[3];
    assert_true(fabs(fabs(same) - 1) < 1e-15);
    for (int i = 0; i < 720; i++) { /* right round: matrix and back, then small steps all along */
        double angle = i * M_PI / 90, m[9], p[4], back[9];
        spl_quaternion_exp((double[3]){0.2 * angle, angle, -0.7 * angle}, p);
        spl_quaternion_to_matrix(p, m);
        spl_quaternion_from_matrix(m, q);
        spl_quaternion_to_matrix(q, back);
        for (int k = 0; k < 9; k++)
            assert_true(fabs(back[k] - m[k]) < 1e-14);
    }
}

static void test_turning_in_place_takes_time(void **state)
{
    (void)state;
    struct spl_camera_path path = {0};
    for (int i = 0; i < 3; i++) {
        struct spl_camera camera = make_camera(i);
        memcpy(camera.eye, origin, sizeof camera.eye);
        assert_int_equal(spl_camera_path_add(&path, &camera, NAN, NULL), 0);
    }
    struct spl_camera *f = sample(&path, (struct spl_path_motion){0}, 5);
    assert_same(&f[2], &path.cameras[1]);
    assert_true(angle_between(&f[0], &f[1]) > 0.1 && distance(&f[1], &f[0]) == 0);
    free(f);
    spl_camera_path_finish(&path);
}

static void test_ease_and_single_camera(void **state)
{
    (void)state;
    struct spl_camera_path path = make_path(2, NULL), one = make_path(1, NULL);
    double first[SPL_EASE_COUNT], last[SPL_EASE_COUNT];
    for (int kind = 0; kind < SPL_EASE_COUNT; kind++) {
        struct spl_camera *f = sample(&path, (struct spl_path_motion){.ease = kind}, 101);
        assert_same(&f[0], &path.cameras[0]);
        assert_same(&f[100], &path.cameras[1]);
        first[kind] = distance(&f[0], &f[1]);
        last[kind] = distance(&f[99], &f[100]);
        free(f);
    }
    assert_true(first[SPL_EASE_IN] < first[SPL_EASE_NONE] / 10 && last[SPL_EASE_IN] > last[SPL_EASE_NONE]);
    assert_true(last[SPL_EASE_OUT] < last[SPL_EASE_NONE] / 10 && first[SPL_EASE_OUT] > first[SPL_EASE_NONE]);
    assert_true(first[SPL_EASE_IN_OUT] < first[SPL_EASE_NONE] / 10 && last[SPL_EASE_IN_OUT] < last[SPL_EASE_NONE] / 10);
    struct spl_camera *f = sample(&one, (struct spl_path_motion){.ease = SPL_EASE_IN_OUT}, 7);
    assert_same(&f[6], &one.cameras[0]);
    free(f);
    one.closed = true;
    free(sample(&one, (struct spl_path_motion){0}, 3));
    spl_camera_path_finish(&one);
    spl_camera_path_finish(&path);
}

static void test_a_whole_path_stays_as_it_is(void **state)
{
    (void)state;
    struct spl_camera_path path = make_path(keys, NULL);
    path.whole = true;
    struct spl_camera *f = sample(&path, (struct spl_path_motion){0}, keys);
    for (int i = 0; i < keys; i++)
        assert_memory_equal(f[i].rotation, path.cameras[i].rotation, sizeof f[i].rotation);
    free(f);
    spl_camera_path_finish(&path);
}

static void refused(struct spl_camera_path *path, const struct spl_camera *camera, double time, const char *field)
{
    struct spl_error err = {0};
    size_t before = path->count;
    assert_true(spl_camera_path_add(path, camera, time, &err) < 0);
    assert_string_equal(err.field, field);
    assert_int_equal(path->count, before);
}

static void test_add_refuses(void **state)
{
    (void)state;
    struct spl_camera_path path = make_path(2, uneven), plain = make_path(2, NULL);
    struct spl_camera camera = make_camera(2), wide = camera;
    wide.width++;
    refused(&path, &wide, 9, "width");
    refused(&path, &camera, NAN, "time");
    refused(&path, &camera, INFINITY, "time");
    refused(&path, &camera, uneven[1], "time");
    refused(&path, &camera, 1e21, "time"); /* differences would overflow, and name the eye between two keys */
    refused(&path, &camera, nextafter(uneven[1], 1e9), "time");
    refused(&plain, &camera, 1, "time");
    struct spl_camera_path scans = {0}; /* whose rays nothing lies between */
    struct spl_camera scan = make_camera(0);
    assert_int_equal(spl_camera_set_around(&scan, SPL_EQUIRECTANGULAR, 360, 20, NULL), 0);
    assert_int_equal(spl_camera_path_add(&scans, &scan, NAN, NULL), 0);
    assert_int_equal(spl_camera_path_add(&scans, &scan, NAN, NULL), 0);
    for (int i = 0; i < 4; i++) {
        struct spl_camera other = scan;
        *(double *[]){&other.fx, &other.cx, &other.fy, &other.cy}[i] *= 1.5;
        refused(&scans, &other, NAN, i < 2 ? "azimuth" : "elevation");
    }
    spl_camera_path_finish(&scans);
    /* the farthest and the closest times that are taken, over the longest way */
    static const double extremes[] = {-1e20, 0, 1e-12, 1e20};
    struct spl_camera_path far = {0};
    struct spl_camera frames[9];
    for (int i = 0; i < 4; i++) {
        camera.eye[0] = i % 2 ? 1e12 : -1e12;
        assert_int_equal(spl_camera_path_add(&far, &camera, extremes[i], NULL), 0);
    }
    assert_int_equal(
        spl_camera_path_sample(&far, &(struct spl_path_motion){.positions = SPL_POSITIONS_LINEAR}, 9, frames, NULL), 0);
    spl_camera_path_finish(&far);
    assert_int_equal(
        spl_camera_path_sample(&(struct spl_camera_path){0}, &(struct spl_path_motion){0}, 1, &camera, NULL),
        SPL_E_INPUT);
    spl_camera_path_finish(&path);
    spl_camera_path_finish(&plain);
    spl_camera_path_finish(NULL);
}

static void test_frames_are_counted(void **state)
{
    (void)state;
    struct spl_camera_path plain = make_path(keys, NULL), timed = make_path(keys, uneven),
                           whole = make_path(keys, NULL);
    whole.whole = true;
    whole.fps = 24;
    size_t count;
    double fps;
    const struct {
        const struct spl_camera_path *path;
        size_t frames;
        double fps, seconds;
        size_t count;
        double rate;
        const char *field; /* of the refusal */
    } cases[] = {
        {&plain, 100, NAN, NAN, 100, 30, NULL},
        {&plain, 0, 25, 4, 100, 25, NULL},
        {&plain, 0, NAN, 0.001, 1, 30, NULL},
        {&timed, 0, NAN, NAN, 240, 30, NULL},
        {&timed, 0, 10, NAN, 80, 10, NULL},
        {&whole, 0, NAN, NAN, keys, 24, NULL},
        {&whole, 0, 60, NAN, keys, 60, NULL},
        {&whole, 0, NAN, 10, 240, 24, NULL},
        {&plain, 0, NAN, NAN, 0, 0, "frames"},
        {&plain, 100, NAN, 4, 0, 0, "seconds"},
        {&plain, 100, 0, NAN, 0, 0, "fps"},
        {&plain, 100, INFINITY, NAN, 0, 0, "fps"},
        {&plain, 100, 1e-3, NAN, 100, 1e-3, NULL},
        {&plain, 100, 1e-300, NAN, 0, 0, "fps"},
        {&plain, 0, 30, 1e-300, 0, 0, "seconds"},
        {&plain, 0, 30, 0.9e-3, 0, 0, "seconds"},
        {&plain, 0, 10, -1, 0, 0, "seconds"},
        {&plain, 0, 1000, 86400, 0, 0, "seconds"},
        {&plain, SPL_CAMERA_PATH_MAX + 1, NAN, NAN, 0, 0, "frames"},
    };
    for (size_t i = 0; i < sizeof cases / sizeof *cases; i++) {
        struct spl_error err = {0};
        int rc =
            spl_camera_path_count(cases[i].path, cases[i].frames, cases[i].fps, cases[i].seconds, SPL_CAMERA_PATH_MAX,
                                  &count, &fps, &err);
        assert_int_equal(rc != 0, cases[i].field != NULL);
        if (rc)
            assert_string_equal(err.field, cases[i].field);
        else
            assert_true(count == cases[i].count && fps == cases[i].rate);
    }
    static const char *const fields[] = {"frames", "seconds", "time", "frames"};
    for (int i = 0; i < 4; i++) { /* the caller's limit is the one that is named, whatever asks for the frames */
        struct spl_error err = {0};
        const struct spl_camera_path *path = i == 3 ? &whole : i == 2 ? &timed : &plain;
        double seconds = i == 1 ? 1 : NAN;
        int rc = spl_camera_path_count(path, i ? 0 : 1000000, NAN, seconds, keys - 1, &count, &fps, &err);
        assert_int_equal(rc, SPL_E_LIMIT);
        assert_string_equal(err.field, fields[i]);
        char said[32];
        snprintf(said, sizeof said, "the limit is %d", (int)keys - 1);
        assert_non_null(strstr(err.message, said));
    }
    spl_camera_path_finish(&plain);
    spl_camera_path_finish(&timed);
    spl_camera_path_finish(&whole);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_parabolas_are_exact),
        cmocka_unit_test(test_passes_through_keys),         cmocka_unit_test(test_velocity_is_continuous),
        cmocka_unit_test(test_closed_loop_closes),          cmocka_unit_test(test_signs_of_quaternions_do_not_matter),
        cmocka_unit_test(test_turning_in_place_takes_time), cmocka_unit_test(test_ease_and_single_camera),
        cmocka_unit_test(test_a_whole_path_stays_as_it_is), cmocka_unit_test(test_add_refuses),
        cmocka_unit_test(test_frames_are_counted),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
