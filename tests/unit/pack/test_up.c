/* Up from cameras: level images that look up or down, upright ones among them, all one way, straight down; and what
 * follows it in a dataset. Cameras that say nothing first. */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>
#include <cmocka.h>

#include <splatd/pack.h>

#include "dataset/chunk.h"
#include "dataset/dataset.h"
#include "pack/up.h"
#include "support/make_dataset.h"

enum { cameras_max = 64 };
static struct spl_named_view views[cameras_max];

/* Into a world whose up is `up`: the frame's third axis. */
static void turn(const double up[3], const double v[3], double out[3])
{
    double frame[3][3];
    spl_up_get_frame(up, frame);
    for (int c = 0; c < 3; c++)
        out[c] = frame[0][c] * v[0] + frame[1][c] * v[1] + frame[2][c] * v[2];
}

/* Looks to `heading`, `pitch` above level, `roll` about its axis; degrees, in a world whose up is `up`. */
static void aim(struct spl_named_view *view, const double up[3], double heading, double pitch, double roll)
{
    double h = heading * M_PI / 180, p = pitch * M_PI / 180, r = roll * M_PI / 180;
    const double right[3] = {sin(h), -cos(h), 0}, forward[3] = {cos(h) * cos(p), sin(h) * cos(p), sin(p)},
                 high[3] = {-cos(h) * sin(p), -sin(h) * sin(p), cos(p)};
    double axes[3][3], *rows[3] = {axes[0], axes[1], axes[2]};
    for (int c = 0; c < 3; c++) {
        rows[0][c] = cos(r) * right[c] + sin(r) * high[c];
        rows[1][c] = sin(r) * right[c] - cos(r) * high[c];
        rows[2][c] = forward[c];
    }
    for (int k = 0; k < 3; k++)
        turn(up, axes[k], &view->camera.rotation[3 * k]);
}

static double degrees_between(const double a[3], const double b[3])
{
    return acos(fmin(1, a[0] * b[0] + a[1] * b[1] + a[2] * b[2])) * 180 / M_PI;
}

static const double worlds[][3] = {{0, -1, 0}, {0, 0, -1}, {1, 0, 0}, {0.6, 0, -0.8}, {-0.48, 0.6, 0.64}};

static void check(size_t count, const double up[3], double degrees, const char *what)
{
    struct spl_view_list list = {views, count, count};
    double found[3] = {7, 7, 7};
    if (!spl_up_from_cameras(&list, found) || !(degrees_between(found, up) <= degrees))
        fail_msg("%s: %g %g %g instead of %g %g %g", what, found[0], found[1], found[2], up[0], up[1], up[2]);
    assert_true(fabs(found[0] * found[0] + found[1] * found[1] + found[2] * found[2] - 1) < 1e-12);
}

static void cameras_that_say_nothing(void **state)
{
    (void)state;
    double up[3] = {7, 7, 7};
    struct spl_view_list list = {views, 0, 0};
    assert_false(spl_up_from_cameras(&list, up));
    aim(&views[0], worlds[1], 0, 0, 0);
    aim(&views[1], worlds[1], 0, 0, 180);
    list.count = 2;
    assert_false(spl_up_from_cameras(&list, up)); /* one on its head */
    for (size_t i = 0; i < 12; i++) /* z to 4 degrees is what hands do */
        aim(&views[i], (double[]){sin(4 * M_PI / 180), 0, cos(4 * M_PI / 180)}, 30 * (double)i, 10, 0);
    list.count = 12;
    assert_false(spl_up_from_cameras(&list, up));
    assert_true(up[0] == 7 && up[1] == 7 && up[2] == 7);
}

static void images_are_level_however_they_are_pitched(void **state)
{
    (void)state;
    for (size_t w = 0; w < sizeof worlds / sizeof *worlds; w++) {
        for (size_t i = 0; i < 24; i++) /* a half circle around a tower, from below: upward sides lean 35 degrees */
            aim(&views[i], worlds[w], 7 * (double)i, 35, 0);
        check(24, worlds[w], 1e-6, "from below");
        for (size_t i = 0; i < 24; i++) /* and 3 degrees of hands */
            aim(&views[i], worlds[w], 7 * (double)i, -50, i % 2 ? 3 : -3);
        check(24, worlds[w], 2, "by hand from above");
        for (size_t i = 0; i < 24; i++) /* in strips to and fro, straight down: nothing has up in its image */
            aim(&views[i], worlds[w], i % 2 ? 180 : 0, -90, 0);
        for (size_t i = 0; i < 8; i++)
            aim(&views[i], worlds[w], i % 2 ? 90 : 270, -90, 0);
        check(24, worlds[w], 1e-6, "straight down");
    }
}

static void upright_images_and_those_that_all_face_one_way(void **state)
{
    (void)state;
    for (size_t w = 0; w < sizeof worlds / sizeof *worlds; w++) {
        for (size_t i = 0; i < 24; i++)
            aim(&views[i], worlds[w], 15 * (double)i, 20, i % 3 ? 0 : 90);
        check(24, worlds[w], 1e-6, "a third upright");
        for (size_t i = 0; i < 24; i++)
            aim(&views[i], worlds[w], 15 * (double)i, 20, i % 5 ? 0 : i % 2 ? 180 : -90);
        check(24, worlds[w], 5, "some anyhow");
        for (size_t i = 0; i < 5; i++)
            aim(&views[i], worlds[w], 40, 2 * (double)i - 4, i == 2 ? 90 : 0);
        check(5, worlds[w], 2.1, "all one way");
        aim(&views[0], worlds[w], 40, 0, 0);
        check(1, worlds[w], 1e-6, "one");
    }
}

static void frames_are_right_handed_and_leave_z_alone(void **state)
{
    (void)state;
    double f[3][3];
    spl_up_get_frame((double[]){0, 0, 1}, f);
    for (int a = 0; a < 3; a++)
        for (int b = 0; b < 3; b++)
            assert_true(f[a][b] == (a == b) && !signbit(f[a][b]));
    for (size_t w = 0; w < sizeof worlds / sizeof *worlds; w++) {
        spl_up_get_frame(worlds[w], f);
        double determinant = 0;
        for (int c = 0; c < 3; c++)
            determinant += f[2][c] * (f[0][(c + 1) % 3] * f[1][(c + 2) % 3] - f[0][(c + 2) % 3] * f[1][(c + 1) % 3]);
        assert_true(fabs(determinant - 1) < 1e-12);
    }
}

/* A floor that is level to `up`, and a mast on it. */
static void write_floor(const char *path, const double up[3])
{
    FILE *f = fopen(path, "w");
    assert_non_null(f);
    for (int i = 0; i < 1600; i++) {
        double p[3];
        turn(up, (double[]){i % 40 * 0.1, i / 40 * 0.1, i == 820 ? 0.5 : 0.001 * (i * 7 % 5)}, p);
        fprintf(f, "%.9f %.9f %.9f\n", p[0], p[1], p[2]);
    }
    assert_int_equal(fclose(f), 0);
}

/* Normals of what is level go up, and the first view looks down on it. */
static void datasets_follow_it(void **state)
{
    (void)state;
    char folder[256], input[300], output[300];
    make_folder(folder);
    snprintf(input, sizeof input, "%s/up.xyz", folder);
    snprintf(output, sizeof output, "%s/up.spld", folder);
    const char *inputs[1] = {input};
    for (size_t w = 0; w < 1 + sizeof worlds / sizeof *worlds; w++) {
        const double z[3] = {0, 0, 1}, *up = w ? worlds[w - 1] : z;
        struct spl_pack_options options = {
            .size = sizeof options, .inputs = inputs, .input_count = 1, .output = output, .threads = 1};
        struct spl_dataset *dataset;
        struct spl_error err = {0};
        write_floor(input, up);
        for (int c = 0; c < 3; c++)
            options.up[c] = w ? 1e200 * up[c] : 0; /* of any length */
        if (spl_pack(&options, NULL, &err) || spl_dataset_open(output, true, &dataset, &err))
            fail_msg("%s", err.message);
        const struct spl_dataset_info *info = spl_dataset_get_info(dataset);
        const json_t *said = json_object_get(spl_dataset_get_meta(dataset), "up");
        double height = 0;
        uint64_t upward = 0;
        struct spl_splat splat;
        for (int c = 0; c < 3; c++)
            height += up[c] * (info->default_eye[c] - info->default_target[c]);
        assert_true(height > 1);
        assert_true(degrees_between(info->default_up, up) < 1e-5);
        assert_int_equal(said != NULL, w > 0);
        assert_true(!w || !strcmp(json_string_value(json_object_get(said, "from")), "given"));
        for (uint32_t id = 0; id < info->splats; id++) {
            assert_true(spl_dataset_find_splat(dataset, id, &splat));
            upward += splat.normal[0] * up[0] + splat.normal[1] * up[1] + splat.normal[2] * up[2] > 0;
        }
        assert_true(100 * upward >= 99 * info->splats);
        spl_dataset_close(dataset);
    }
    struct spl_pack_options odd = {
        .size = sizeof odd, .inputs = inputs, .input_count = 1, .output = output, .up = {NAN}};
    struct spl_error err = {0};
    assert_int_equal(spl_pack(&odd, NULL, &err), SPL_E_USAGE);
    assert_string_equal(err.field, "up");
    unlink(input);
    unlink(output);
    assert_int_equal(rmdir(folder), 0);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(cameras_that_say_nothing),
        cmocka_unit_test(images_are_level_however_they_are_pitched),
        cmocka_unit_test(upright_images_and_those_that_all_face_one_way),
        cmocka_unit_test(frames_are_right_handed_and_leave_z_alone),
        cmocka_unit_test(datasets_follow_it),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
