/* Photographs with poses and lenses: COLMAP's binary model means what its text means, distorted lenses project as the
 * formulas of OpenCV say, and a fault of one photograph either fails or is handed out and passed over. */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <unistd.h>
#include <cmocka.h>

#include "base/memory.h"
#include "cloud/views.h"
#include "geom/camera_json.h"
#include "support/folder.h"

static char bytes[4096];
static size_t used;

static void add(const void *value, size_t length)
{
    assert_true(used + length <= sizeof bytes);
    memcpy(bytes + used, value, length);
    used += length;
}

static void add_camera(uint32_t id, int32_t model, uint64_t width, uint64_t height, unsigned count, const double *n)
{
    add(&id, 4);
    add(&model, 4);
    add(&width, 8);
    add(&height, 8);
    add(n, count * sizeof *n);
}

static void add_image(uint32_t camera, const double pose[7], const char *name, uint64_t points)
{
    static const double point[3];
    uint32_t id = 17;
    add(&id, 4);
    add(pose, 7 * sizeof *pose);
    add(&camera, 4);
    add(name, strlen(name) + 1);
    add(&points, 8);
    for (uint64_t i = 0; i < points && i < 4; i++)
        add(point, sizeof point);
}

static const double pose[7] = {-0.55772847375664971, -0.76215345285486739, -0.30022022910563139, 0.13389875988314353,
                               -0.06410832213881687, 0.16613728300474614,  4.6401280721795111};
static const double pinhole[4] = {500, 510, 331.25, 228.5};
static const double opencv[8] = {500, 510, 331.25, 228.5, -0.2, 0.05, 0.001, -0.002};

static void put_model(int32_t model, unsigned count, const double *params, const double q[7])
{
    uint64_t one = 1, two = 2;
    used = 0;
    add(&two, 8);
    add_camera(7, 1, 640, 480, 4, pinhole);
    add_camera(9, model, 640, 480, count, params);
    folder_put("cameras.bin", bytes, used);
    used = 0;
    add(&one, 8);
    add_image(9, q, "east/a.jpg", 2);
    folder_put("images.bin", bytes, used);
}

struct refused {
    int count;
    struct spl_error first;
};

static void note(void *context, const struct spl_error *why)
{
    struct refused *refused = context;
    if (!refused->count++)
        refused->first = *why;
}

static int fixed_size(const char *path, uint32_t *width, uint32_t *height, struct spl_error *err)
{
    if (access(path, F_OK))
        return spl_fail(err, SPL_E_NOT_FOUND, "%s: there is no such file", path);
    *width = 640;
    *height = 480;
    return 0;
}

static int load(struct spl_view_list *list, const char *path, const char *images, struct refused *refused,
                struct spl_error *err)
{
    struct spl_photograph_options options = {
        .images = images, .get_size = fixed_size, .refuse = refused ? note : NULL, .context = refused};
    memset(list, 0x55, sizeof *list);
    return spl_view_list_load_photographs(list, path, &options, err);
}

static void assert_refused(const char *path, int code, const char *field, const char *says)
{
    struct spl_view_list list;
    struct spl_error err = {0};
    assert_int_equal(load(&list, path, NULL, NULL, &err), code);
    assert_string_equal(err.field, field);
    if (!strstr(err.message, says))
        fail_msg("'%s' lacks '%s'", err.message, says);
    assert_null(list.views);
}

static void images_that_are_no_folder_are_named_by_their_flag(void **state)
{
    (void)state;
    struct spl_view_list list;
    struct spl_error err = {0};
    assert_int_equal(load(&list, test_folder, in_folder("none"), NULL, &err), SPL_E_NOT_FOUND);
    assert_string_equal(err.field, "images");
    assert_non_null(strstr(err.message, "--images '"));
    assert_non_null(strstr(err.message, "none' is no folder"));
}

static int clean(void **state)
{
    (void)state;
    char command[300];
    snprintf(command, sizeof command, "rm -rf %s/*", test_folder);
    return system(command);
}

static void binary_means_what_text_means(void **state)
{
    (void)state;
    struct spl_view_list binary, text;
    struct spl_error err = {0};
    put_model(4, 8, opencv, pose);
    if (load(&binary, test_folder, NULL, NULL, &err))
        fail_msg("%s", err.message);
    remove(in_folder("cameras.bin"));
    folder_put_text("cameras.txt", "7 PINHOLE 640 480 500 510 331.25 228.5\n"
                                   "9 OPENCV 640 480 500 510 331.25 228.5 -0.2 0.05 0.001 -0.002\n");
    folder_put_text("images.txt",
                    "17 -0.55772847375664971 -0.76215345285486739 -0.30022022910563139 0.13389875988314353 "
                    "-0.06410832213881687 0.16613728300474614 4.6401280721795111 9 east/a.jpg\n\n");
    if (load(&text, test_folder, NULL, NULL, &err))
        fail_msg("%s", err.message);
    assert_int_equal(binary.count, 1);
    assert_int_equal(text.count, 1);
    assert_string_equal(binary.views[0].name, "east_a");
    assert_string_equal(binary.views[0].photograph, in_folder("images/east/a.jpg"));
    const struct spl_named_view *a = &binary.views[0], *b = &text.views[0];
    assert_memory_equal(a->camera.rotation, b->camera.rotation, sizeof a->camera.rotation);
    assert_memory_equal(a->camera.eye, b->camera.eye, sizeof a->camera.eye);
    assert_int_equal(a->distortion.kind, SPL_DISTORTION_RADIAL);
    double world[3] = {-0.577054497069, 3.30876147309, -1.46753054758}, pixel[2][2], depth;
    assert_true(spl_distortion_project(&a->camera, &a->distortion, world, pixel[0], &depth));
    assert_true(spl_distortion_project(&b->camera, &b->distortion, world, pixel[1], &depth));
    assert_memory_equal(pixel[0], pixel[1], sizeof pixel[0]);
    /* the golden vector's pinhole pixel is (412.5, 273.125): x = 0.1625, y = 0.0875 before the lens */
    double x = 0.1625, y = 0.0875, s = x * x + y * y, radial = 1 - 0.2 * s + 0.05 * s * s;
    double u = 500 * (x * radial + 2 * 0.001 * x * y - 0.002 * (s + 2 * x * x)) + 331.25;
    double v = 510 * (y * radial - 2 * 0.002 * x * y + 0.001 * (s + 2 * y * y)) + 228.5;
    assert_true(fabs(pixel[0][0] - u) < 1e-8 && fabs(pixel[0][1] - v) < 1e-8 && fabs(depth - 8) < 1e-9);
    spl_view_list_finish(&binary);
    spl_view_list_finish(&text);
    /* what is drawn is a pinhole */
    assert_int_equal(spl_view_list_load(&text, test_folder, &err), SPL_E_INPUT);
    assert_string_equal(err.field, "params");
}

static void broken_binary_models_are_refused_by_offset(void **state)
{
    (void)state;
    const double params[12] = {500, 510, 331.25, 228.5}, zero[7] = {0}, nan_pose[7] = {NAN, 0, 0, 0, 0, 0, 0};
    put_model(7, 5, params, pose);
    assert_refused(test_folder, SPL_E_INPUT, "MODEL", "'FOV'");
    put_model(10, 12, params, pose);
    assert_refused(test_folder, SPL_E_INPUT, "MODEL", "'THIN_PRISM_FISHEYE'");
    put_model(99, 4, params, pose);
    assert_refused(test_folder, SPL_E_INPUT, "MODEL", "model number 99");
    put_model(-1, 4, params, pose);
    assert_refused(test_folder, SPL_E_INPUT, "MODEL", "model number -1");
    put_model(1, 4, zero, pose);
    assert_refused(test_folder, SPL_E_INPUT, "fx", "fx");
    put_model(1, 4, params, zero);
    assert_refused(test_folder, SPL_E_INPUT, "q", "offset 8");
    put_model(1, 4, params, nan_pose);
    assert_refused(test_folder, SPL_E_INPUT, "q", "finite");
    put_model(2, 4, (double[]){500, 3, 2, -1e9}, pose);
    assert_refused(test_folder, SPL_E_INPUT, "params", "fold");

    put_model(1, 4, params, pose);
    uint64_t many = UINT64_MAX / 16;
    memcpy(bytes, &many, 8);
    folder_put("images.bin", bytes, used);
    assert_refused(test_folder, SPL_E_INPUT, "count", "do not fit");
    put_model(1, 4, params, pose);
    memcpy(bytes + used - 2 * 24 - 8, &many, 8);
    folder_put("images.bin", bytes, used);
    assert_refused(test_folder, SPL_E_INPUT, "POINTS2D", "do not fit");
    for (size_t length = 1; length < used; length++) { /* cut anywhere */
        put_model(1, 4, params, pose);
        folder_put("images.bin", bytes, length);
        struct spl_view_list list;
        assert_int_equal(load(&list, test_folder, NULL, NULL, NULL), SPL_E_INPUT);
    }
    put_model(1, 4, params, pose);
    add("x", 1);
    folder_put("images.bin", bytes, used);
    assert_refused(test_folder, SPL_E_INPUT, "count", "1 bytes follow");
    folder_put("images.bin", "", 0);
    assert_refused(test_folder, SPL_E_INPUT, "", "empty");
    remove(in_folder("images.bin"));
    assert_refused(test_folder, SPL_E_NOT_FOUND, "", "images.bin");
}

static void a_fault_of_one_photograph_is_handed_out(void **state)
{
    (void)state;
    struct spl_view_list list;
    struct refused refused = {0};
    struct spl_error err = {0};
    folder_put_text("cameras.txt", "1 PINHOLE 640 480 500 510 331.25 228.5\n2 FOV 640 480 500 510 331.25 228.5 0.9\n");
    folder_put_text("images.txt", "1 1 0 0 0 0 0 0 1 a.jpg\n\n2 0 0 0 0 0 0 0 1 b.jpg\n\n3 1 0 0 0 0 0 0 2 c.jpg\n\n");
    if (load(&list, test_folder, "/tmp", &refused, &err))
        fail_msg("%s", err.message);
    assert_int_equal(list.count, 1);
    assert_string_equal(list.views[0].photograph, "/tmp/a.jpg");
    assert_int_equal(refused.count, 3); /* the camera, b's pose, c for its camera */
    assert_non_null(strstr(refused.first.message, "FOV"));
    spl_view_list_finish(&list);
    folder_put_text("images.txt", "2 0 0 0 0 0 0 0 1 b.jpg\n\n");
    refused.count = 0;
    assert_int_equal(load(&list, test_folder, NULL, &refused, &err), SPL_E_INPUT);
    assert_string_equal(err.field, "views");
}

#define MATRIX "[[1,0,0,3],[0,0,-1,-4],[0,1,0,2],[0,0,0,1]]"
#define LENS "\"w\":640,\"h\":480,\"fl_x\":500,\"fl_y\":510,\"cx\":331.25,\"cy\":228.5,"

static void transforms_give_cameras_and_lenses(void **state)
{
    (void)state;
    struct spl_view_list list;
    struct spl_error err = {0};
    folder_put_text("transforms.json",
                    "{" LENS "\"camera_model\":\"OPENCV\",\"k1\":-0.1,\"aabb_scale\":16,\"frames\":["
                    "{\"file_path\":\"./images/f_1.jpg\",\"transform_matrix\":" MATRIX ",\"sharpness\":9},"
                    "{\"file_path\":\"images/f_2\",\"transform_matrix\":" MATRIX ",\"k1\":0,\"w\":320,\"fl_x\":250},"
                    "{\"file_path\":\"f_3.png\",\"transform_matrix\":" MATRIX
                    ",\"k1\":0,\"camera_model\":\"OPENCV_FISHEYE\"}]}");
    if (load(&list, in_folder("transforms.json"), NULL, NULL, &err))
        fail_msg("%s", err.message);
    assert_int_equal(list.count, 3);
    assert_string_equal(list.views[0].name, "images_f_1");
    assert_int_equal(list.views[0].distortion.kind, SPL_DISTORTION_RADIAL);
    assert_int_equal(list.views[1].distortion.kind, SPL_DISTORTION_NONE);
    assert_int_equal(list.views[2].distortion.kind, SPL_DISTORTION_FISHEYE);
    assert_non_null(strstr(list.views[1].photograph, "/f_2.png"));
    assert_true(list.views[1].camera.width == 320 && list.views[1].camera.fx == 250);
    double pixel[2], depth; /* looks along +y from (3, -4, 2), z up */
    assert_true(spl_camera_project(&list.views[0].camera, (double[]){4, 1, 3}, pixel, &depth));
    assert_true(fabs(pixel[0] - (331.25 + 100)) < 1e-9 && fabs(pixel[1] - (228.5 - 102)) < 1e-9 && depth == 5);
    assert_true(
        spl_distortion_project(&list.views[2].camera, &list.views[2].distortion, (double[]){4, 1, 2}, pixel, &depth));
    assert_true(fabs(pixel[0] - (331.25 + 500 * atan(0.2))) < 1e-9);
    spl_view_list_finish(&list);

    static const struct {
        const char *text, *field, *says;
    } rows[] = {
        {"{\"frames\":{}}", "frames", "an object"},
        {"{\"frames\":[3]}", "file_path", "missing"},
        {"{\"frames\":[{\"file_path\":\"a\",\"transform_matrix\":" MATRIX "}]}", "", "a.png: there is no such file"},
        {"{\"w\":64,\"frames\":[{\"file_path\":\"a\",\"transform_matrix\":" MATRIX "}]}", "h", "frames[0]"},
        {"{\"w\":9e9,\"h\":9,\"frames\":[{\"file_path\":\"a\"}]}", "w", "9e+09"},
        {"{\"w\":64,\"h\":48,\"frames\":[{\"file_path\":\"a\",\"transform_matrix\":" MATRIX "}]}", "fl_x", "focal"},
        {"{" LENS "\"frames\":[{\"file_path\":\"a\",\"transform_matrix\":[[1,2],[3]]}]}", "transform_matrix", "row"},
        {"{" LENS "\"frames\":[{\"file_path\":\"a\",\"transform_matrix\":[[-1,0,0,3],[0,0,-1,-4],[0,1,0,2],[0,0,0,1]]}]"
         "}",
         "transform_matrix", "frames[0]"}, /* mirrored */
        {"{" LENS
         "\"frames\":[{\"file_path\":\"a\",\"transform_matrix\":[[2,0,0,3],[0,0,-2,-4],[0,2,0,2],[0,0,0,1]]}]}",
         "transform_matrix", "frames[0]"}, /* scaled */
        {"{" LENS "\"camera_model\":\"EQUIRECTANGULAR\",\"frames\":[{\"file_path\":\"a\",\"transform_matrix\":" MATRIX
         "}]}",
         "camera_model", "panoramas.json"},
        {"{\"w\":64,\"h\":32,\"camera_model\":\"EQUIRECTANGULAR\",\"frames\":[{\"file_path\":\"a\"}]}", "camera_model",
         "panoramas.json"},
        {"{" LENS "\"k1\":\"x\",\"frames\":[{\"file_path\":\"a\",\"transform_matrix\":" MATRIX "}]}", "k1", "text"},
    };
    for (size_t i = 0; i < sizeof rows / sizeof *rows; i++) {
        struct spl_error why = {0};
        folder_put_text("transforms.json", rows[i].text);
        assert_true(load(&list, in_folder("transforms.json"), NULL, NULL, &why) < 0);
        assert_string_equal(why.field, rows[i].field);
        if (!strstr(why.message, rows[i].says))
            fail_msg("'%s' lacks '%s'", why.message, rows[i].says);
    }
}

/* Blender and instant-ngp write a view's angle alone, and programs on Windows its slashes. */
static void transforms_without_a_size_have_their_images(void **state)
{
    static const struct {
        const char *file, *name, *photograph; /* photograph: below the folder */
    } rows[] = {{"images/a", "images_a", "images/a.png"},      {"./images\\\\a.png", "images_a", "images/a.png"},
                {"odd\\\\b.png", "odd\\b", "odd\\b.png"},      {"train\\\\gone.jpg", NULL, "/train/gone.jpg"},
                {"images/gone.jpg", NULL, "/images/gone.jpg"}, {"/none/gone.jpg", NULL, "/none/gone.jpg"}};
    char command[300], text[600];
    (void)state;
    snprintf(command, sizeof command, "mkdir -p %s/images", test_folder);
    assert_int_equal(system(command), 0);
    folder_put_text("images/a.png", "x");
    folder_put_text("odd\\b.png", "x");
    for (size_t i = 0; i < sizeof rows / sizeof *rows; i++) {
        struct spl_view_list list;
        struct spl_error err = {0};
        snprintf(text, sizeof text,
                 "{\"camera_angle_x\":1.2870022175866687,\"frames\":[{\"file_path\":\"%s\",\"transform_matrix\":" MATRIX
                 "}]}",
                 rows[i].file);
        folder_put_text("transforms.json", text);
        int rc = load(&list, in_folder("transforms.json"), NULL, NULL, &err);
        assert_int_equal(rc, rows[i].name ? 0 : SPL_E_NOT_FOUND);
        if (rc) {
            if (!strstr(err.message, rows[i].photograph) || strstr(err.message, "images/images"))
                fail_msg("row %zu: %s", i, err.message);
            continue;
        }
        const struct spl_camera *camera = &list.views[0].camera;
        assert_string_equal(list.views[0].name, rows[i].name);
        assert_non_null(strstr(list.views[0].photograph, rows[i].photograph));
        assert_true(camera->width == 640 && camera->height == 480 && camera->cx == 320 && camera->cy == 240);
        assert_true(fabs(camera->fx - 426.6666666) < 1e-6 && camera->fy == camera->fx);
        spl_view_list_finish(&list);
    }
}

static void open3d_photographs_are_those_of_the_folder(void **state)
{
    (void)state;
    struct spl_view_list list;
    struct spl_error err = {0};
    folder_put_text(
        "trajectory.json",
        "{\"class_name\":\"PinholeCameraTrajectory\",\"parameters\":[{\"extrinsic\":[1,0,0,0,0,1,0,0,0,0,1,0,0,0,2,"
        "1],\"intrinsic\":{\"width\":640,\"height\":480,\"intrinsic_matrix\":[500,0,0,0,510,0,330.75,228,1]}}]}");
    assert_refused(in_folder("trajectory.json"), SPL_E_NOT_FOUND, "", "no folder");
    mkdir(in_folder("color"), 0700);
    assert_refused(in_folder("trajectory.json"), SPL_E_INPUT, "parameters", "0 photographs");
    folder_put_text("color/00001.jpg", "x");
    folder_put_text("color/notes.txt", "x");
    if (load(&list, in_folder("trajectory.json"), NULL, NULL, &err))
        fail_msg("%s", err.message);
    assert_int_equal(list.count, 1);
    assert_string_equal(list.views[0].photograph, in_folder("color/00001.jpg"));
    double pixel[2], depth;
    assert_true(spl_camera_project(&list.views[0].camera, (double[]){1, 1, 3}, pixel, &depth));
    assert_true(fabs(pixel[0] - 431.25) < 1e-9 && fabs(pixel[1] - 330.5) < 1e-9 && depth == 5);
    spl_view_list_finish(&list);
}

static void pose_folders_take_their_size_from_photographs(void **state)
{
    (void)state;
    struct spl_view_list list;
    struct refused refused = {0};
    struct spl_error err = {0};
    folder_put_text("camera-intrinsics.txt", "5e+02 0 330.75\n0 510 228\n0 0 1\n");
    assert_refused(test_folder, SPL_E_INPUT, "views", "no view");
    folder_put_text("f-1.pose.txt", "1 0 0 0\n0 1 0 0\n0 0 1 -2\n0 0 0 1\n");
    assert_refused(test_folder, SPL_E_NOT_FOUND, "", "f-1.color.jpg");
    folder_put_text("f-1.color.jpg", "x");
    folder_put_text("f-2.color.png", "x");
    folder_put_text("f-2.pose.txt", "1 0 0 0\n0 1 0 0\n0 0 -1 -2\n0 0 0 1\n"); /* mirrored */
    assert_refused(test_folder, SPL_E_INPUT, "matrix", "f-2.pose.txt");
    if (load(&list, test_folder, NULL, &refused, &err))
        fail_msg("%s", err.message);
    assert_int_equal(refused.count, 1);
    assert_int_equal(list.count, 1);
    assert_string_equal(list.views[0].name, "f-1.color");
    double pixel[2], depth;
    assert_true(spl_camera_project(&list.views[0].camera, (double[]){1, 1, 3}, pixel, &depth));
    assert_true(fabs(pixel[0] - 431.25) < 1e-9 && fabs(pixel[1] - 330.5) < 1e-9 && depth == 5);
    spl_view_list_finish(&list);
    static const char *const rows[][2] = {{"1 0 0\n", "3 numbers"},
                                          {"1 0 0 0 1 0 0 0 1 x\n", "'x'"},
                                          {"nan 0 0 0\n0 1 0 0\n0 0 1 -2\n0 0 0 1\n", "nan"},
                                          {"1 0 0 1e999\n0 1 0 0\n0 0 1 -2\n0 0 0 1\n", "inf"},
                                          {"", "empty"}};
    for (size_t i = 0; i < sizeof rows / sizeof *rows; i++) {
        folder_put_text("f-1.pose.txt", rows[i][0]);
        struct spl_error why = {0};
        assert_int_equal(load(&list, test_folder, NULL, NULL, &why), SPL_E_INPUT);
        if (!strstr(why.message, rows[i][1]))
            fail_msg("'%s' lacks '%s'", why.message, rows[i][1]);
    }
    folder_put_text("camera-intrinsics.txt", "500 1 330.75\n0 510 228\n0 0 1\n");
    assert_refused(test_folder, SPL_E_INPUT, "intrinsics", "skew");
}

static void lenses_have_an_end(void **state)
{
    (void)state;
    struct spl_camera camera = {
        .rotation = {1, 0, 0, 0, 1, 0, 0, 0, 1}, .fx = 100, .fy = 100, .width = 100, .height = 100};
    struct spl_distortion lens = {.kind = SPL_DISTORTION_RADIAL, .k = {-0.3}};
    double pixel[2], depth;
    assert_int_equal(spl_distortion_init(&lens, NULL), 0);
    assert_true(fabs(lens.reach - sqrt(1 / 0.9)) < 0.02); /* where r - 0.3 r^3 stops growing */
    assert_true(spl_distortion_project(&camera, &lens, (double[]){1, 0, 1}, pixel, &depth));
    assert_false(spl_distortion_project(&camera, &lens, (double[]){1.8, 0, 1}, pixel, &depth)); /* would fold back */
    assert_false(spl_distortion_project(&camera, &lens, (double[]){0, 0, -1}, pixel, &depth));
    struct spl_distortion fisheye = {.kind = SPL_DISTORTION_FISHEYE};
    assert_int_equal(spl_distortion_init(&fisheye, NULL), 0);
    assert_true(spl_distortion_project(&camera, &fisheye, (double[]){0, 0, 1}, pixel, &depth));
    assert_true(pixel[0] == 0 && pixel[1] == 0);
    assert_true(spl_distortion_project(&camera, &fisheye, (double[]){0, 10, 1}, pixel, &depth));
    assert_true(fabs(pixel[1] - 100 * atan(10)) < 1e-9);
    struct spl_distortion broken = {.kind = SPL_DISTORTION_RADIAL, .k = {NAN}};
    assert_int_equal(spl_distortion_init(&broken, NULL), SPL_E_INPUT);
}

static void no_refused_allocation_is_passed_over(void **state)
{
    (void)state;
    put_model(4, 8, opencv, pose);
    int rc = SPL_E_NOMEM, n = 0;
    while (rc == SPL_E_NOMEM) {
        struct spl_view_list list;
        struct spl_error err = {0};
        struct refused refused = {0};
        spl_memory_fail_after(++n);
        rc = load(&list, test_folder, NULL, &refused, &err);
        spl_memory_fail_after(0);
        assert_int_equal(err.code, rc);
        assert_int_equal(refused.count, 0);
        spl_view_list_finish(&list);
    }
    assert_int_equal(rc, 0);
    assert_true(n > 5);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(images_that_are_no_folder_are_named_by_their_flag),
        cmocka_unit_test_teardown(binary_means_what_text_means, clean),
        cmocka_unit_test_teardown(broken_binary_models_are_refused_by_offset, clean),
        cmocka_unit_test_teardown(a_fault_of_one_photograph_is_handed_out, clean),
        cmocka_unit_test_teardown(transforms_give_cameras_and_lenses, clean),
        cmocka_unit_test_teardown(transforms_without_a_size_have_their_images, clean),
        cmocka_unit_test_teardown(open3d_photographs_are_those_of_the_folder, clean),
        cmocka_unit_test_teardown(pose_folders_take_their_size_from_photographs, clean),
        cmocka_unit_test(lenses_have_an_end),
        cmocka_unit_test_teardown(no_refused_allocation_is_passed_over, clean),
    };
    return cmocka_run_group_tests(tests, folder_make, folder_remove);
}
