/* Panoramas with poses: faces look where the panorama's axes say, cubes are six photographs, and what is wrong with an
 * entry is named with its file, its field and its value. */
#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <unistd.h>
#include <cmocka.h>

#include "base/memory.h"
#include "cloud/views.h"
#include "support/folder.h"

/* Images here are texts "WIDTH HEIGHT". */
static int read_size(const char *path, uint32_t *width, uint32_t *height, struct spl_error *err)
{
    FILE *file = fopen(path, "rb");
    if (!file)
        return spl_fail(err, SPL_E_NOT_FOUND, "%s: there is no such file", path);
    int count = fscanf(file, "%u %u", width, height);
    fclose(file);
    return count == 2 ? SPL_OK : spl_fail(err, SPL_E_INPUT, "%s: is no image", path);
}

static unsigned refused_count;
static struct spl_error refused_last;

static void refuse(void *context, const struct spl_error *why)
{
    (void)context;
    refused_count++;
    refused_last = *why;
}

static const struct spl_photograph_options strict = {.get_size = read_size},
                                           lenient = {.get_size = read_size, .refuse = refuse};

static void load(struct spl_view_list *list, const char *json)
{
    struct spl_error err = {0};
    folder_put_text("panoramas.json", json);
    if (spl_panoramas_load(list, test_folder, &strict, &err))
        fail_msg("%s", err.message);
}

static void assert_sees(const struct spl_camera *camera, double x, double y, double z, double u, double v)
{
    double pixel[2], depth;
    assert_true(spl_camera_project(camera, (double[3]){x, y, z}, pixel, &depth));
    assert_true(fabs(pixel[0] - u) < 1e-9 && fabs(pixel[1] - v) < 1e-9);
}

static void an_equirectangular_image_becomes_six_faces(void **state)
{
    struct spl_view_list list;
    static const char *const names[] = {"s-front", "s-left", "s-back", "s-right", "s-up", "s-down"};
    (void)state;
    folder_put_text("s.jpg", "628 314");
    /* a quarter about z: the panorama's x is the world's y */
    load(&list, "{\"mapping\": \"\", \"panoramas\": [{\"name\": \"s\", \"color\": \"s.jpg\", \"range\": \"s.npy\","
                "\"position\": [10, 20, 30], \"rotation\": [0, -1, 0, 1, 0, 0, 0, 0, 1]},"
                "{\"name\": \"t\", \"color\": \"s.jpg\", \"width\": 628, \"height\": 314, \"position\": [1, 2, 3],"
                "\"quaternion\": [1, 0, 0, 1]}]}");
    assert_int_equal(list.count, 12);
    for (size_t i = 0; i < 6; i++) {
        const struct spl_named_view *view = &list.views[i];
        assert_string_equal(view->name, names[i]);
        assert_string_equal(view->photograph, in_folder("s.jpg"));
        assert_int_equal(view->panorama, 1);
        assert_int_equal(list.views[6 + i].panorama, 2);
        assert_true(view->inner->is_panorama && !view->inner->at && view->inner->width == 628);
        assert_string_equal(view->inner->path, in_folder("s.jpg"));
        assert_int_equal(view->camera.width, 200);
        for (int k = 0; k < 9; k++)
            assert_true(fabs(view->camera.rotation[k] - list.views[6 + i].camera.rotation[k]) < 1e-12);
    }
    assert_sees(&list.views[0].camera, 10, 20 + 7, 30, 100, 100);
    assert_sees(&list.views[1].camera, 10 - 7, 20, 30, 100, 100);
    assert_sees(&list.views[4].camera, 10, 20, 30 + 7, 100, 100);
    assert_sees(&list.views[4].camera, 10, 20 + 7, 30 + 7, 100, 200); /* what is in front is at its lower edge */
    spl_view_list_finish(&list);
}

static void a_cut_panorama_says_its_elevations(void **state)
{
    struct spl_view_list list;
    (void)state;
    folder_put_text("c.jpg", "720 300");
    load(&list, "{\"panoramas\": [{\"name\": \"c\", \"color\": \"c.jpg\", \"elevation\": [-60, 90],"
                "\"position\": [0, 0, 0], \"quaternion\": [1, 0, 0, 0]}]}");
    assert_int_equal(list.count, 6);
    const struct spl_panorama *p = &list.views[0].inner->panorama;
    double place[2];
    assert_true(spl_panorama_place(p, &list.views[0].camera, (double[2]){list.views[0].camera.cx,
                                                                        list.views[0].camera.cy}, place));
    assert_true(fabs(place[0] - 360) < 1e-9 && fabs(place[1] - 180) < 1e-9);
    p = &list.views[5].inner->panorama;
    assert_false(spl_panorama_place(p, &list.views[5].camera, (double[2]){list.views[5].camera.cx,
                                                                         list.views[5].camera.cy}, place));
    spl_view_list_finish(&list);
}

static void a_cube_is_six_photographs(void **state)
{
    struct spl_view_list list;
    (void)state;
    folder_put_text("f.png", "64 64");
    folder_put_text("u.png", "32 32");
    load(&list, "{\"panoramas\": [{\"name\": \"c\", \"faces\": {\"up\": \"u.png\", \"front\": \"f.png\"},"
                "\"position\": [1, 2, 3], \"quaternion\": [2, 0, 0, 0]}]}");
    assert_int_equal(list.count, 2);
    assert_string_equal(list.views[0].name, "c-front");
    assert_string_equal(list.views[1].name, "c-up");
    assert_string_equal(list.views[1].photograph, in_folder("u.png"));
    assert_null(list.views[0].inner);
    assert_int_equal(list.views[1].panorama, 1);
    assert_sees(&list.views[0].camera, 1 + 5, 2, 3, 32, 32);
    assert_sees(&list.views[0].camera, 1 + 5, 2 + 5, 3, 0, 32);
    assert_sees(&list.views[1].camera, 1, 2, 3 + 5, 16, 16);
    spl_view_list_finish(&list);
}

#define POSE "\"position\": [0, 0, 0], \"quaternion\": [1, 0, 0, 0]"
static void what_is_wrong_is_named(void **state)
{
    static const struct {
        const char *entry, *field, *part;
    } cases[] = {
        {"3", "name", "name must be text"},
        {"{\"color\": \"s.jpg\", " POSE "}", "name", "name must be text"},
        {"{\"name\": \"a/b\", \"color\": \"s.jpg\", " POSE "}", "name", "file name"},
        {"{\"name\": \"a\", \"color\": \"s.jpg\", \"quaternion\": [1, 0, 0, 0]}", "position", "no position"},
        {"{\"name\": \"a\", \"color\": \"s.jpg\", \"position\": [0, 0], \"quaternion\": [1, 0, 0, 0]}", "position",
         "array of 2"},
        {"{\"name\": \"a\", \"color\": \"s.jpg\", \"position\": [0, 0, 1e13], \"quaternion\": [1, 0, 0, 0]}", "matrix",
         "1e+13"},
        {"{\"name\": \"a\", \"color\": \"s.jpg\", \"position\": [0, 0, 0]}", "rotation", "no rotation"},
        {"{\"name\": \"a\", \"color\": \"s.jpg\", " POSE ", \"rotation\": [1,0,0,0,1,0,0,0,1]}", "rotation",
         "leave one out"},
        {"{\"name\": \"a\", \"color\": \"s.jpg\", \"position\": [0, 0, 0], \"rotation\": [1,0,0,0,-1,0,0,0,1]}",
         "rotation", "mirrors"},
        {"{\"name\": \"a\", \"color\": \"s.jpg\", \"position\": [0, 0, 0], \"rotation\": [0,0,0,0,0,0,0,0,0]}",
         "rotation", "determinant 0, is no rotation"},
        {"{\"name\": \"a\", \"color\": \"s.jpg\", \"position\": [0, 0, 0], \"rotation\": [1,0,0,0,1,0,0,1,0]}",
         "rotation", "determinant 0, is no rotation"},
        {"{\"name\": \"a\", \"color\": \"s.jpg\", \"position\": [0, 0, 0], \"rotation\": [2,0,0,0,2,0,0,0,2]}",
         "rotation", "no rotation"},
        {"{\"name\": \"a\", \"color\": \"s.jpg\", \"position\": [0, 0, 0], \"quaternion\": [0, 0, 0, 0]}", "quaternion",
         "no rotation"},
        {"{\"name\": \"a\", " POSE "}", "color", "no color"},
        {"{\"name\": \"a\", \"color\": null, \"position\": [0, 0, 0]}", "rotation", "no rotation"},
        {"{\"name\": \"a\", \"color\": \"s.jpg\", \"faces\": {}, " POSE "}", "color", "leave one out"},
        {"{\"name\": \"a\", \"color\": 7, " POSE "}", "color", "must be the path"},
        {"{\"name\": \"a\", \"color\": \"none.jpg\", " POSE "}", "", "no such file"},
        {"{\"name\": \"a\", \"color\": \"empty.jpg\", " POSE "}", "", "is no image"},
        {"{\"name\": \"a\", \"color\": \"cut.jpg\", " POSE "}", "height", "[-57.32, 57.32]"},
        {"{\"name\": \"a\", \"color\": \"square.jpg\", " POSE "}", "height", "628 x 314: is it two"},
        {"{\"name\": \"a\", \"color\": \"cut.jpg\", \"elevation\": [-60, 60], " POSE "}", "height",
         "-60 to 60 degrees has 209 rows"},
        {"{\"name\": \"a\", \"color\": \"cut.jpg\", \"elevation\": [60, -60], " POSE "}", "elevation", "60 to -60"},
        {"{\"name\": \"a\", \"color\": \"cut.jpg\", \"elevation\": [-90, 91], " POSE "}", "elevation", "-90 to 91"},
        {"{\"name\": \"a\", \"color\": \"s.jpg\", \"width\": 4096, " POSE "}", "width", "628 x 314 pixels, not 4096"},
        {"{\"name\": \"a\", \"color\": \"s.jpg\", \"width\": -1, " POSE "}", "width", "whole number"},
        {"{\"name\": \"a\", \"color\": \"huge.jpg\", " POSE "}", "width", "halve it"},
        {"{\"name\": \"a\", \"faces\": {\"front\": \"s.jpg\"}, " POSE "}", "front", "square"},
        {"{\"name\": \"a\", \"faces\": {\"front\": \"f.png\", \"bottom\": \"f.png\"}, " POSE "}", "faces",
         "'bottom', which is none of front, left"},
        {"{\"name\": \"a\", \"faces\": [], " POSE "}", "faces", "not an array"},
        {"{\"name\": \"a\", \"faces\": {}, " POSE "}", "faces", "faces is empty"},
    };
    char json[1024];
    (void)state;
    folder_put_text("s.jpg", "628 314");
    folder_put_text("f.png", "64 64");
    folder_put_text("cut.jpg", "628 200");
    folder_put_text("square.jpg", "628 628");
    folder_put_text("huge.jpg", "20000 10000");
    folder_put_text("empty.jpg", "");
    for (size_t i = 0; i < sizeof cases / sizeof *cases; i++) {
        struct spl_view_list list;
        struct spl_error err = {0};
        snprintf(json, sizeof json, "{\"panoramas\": [%s, {\"name\": \"good\", \"color\": \"s.jpg\", " POSE "}]}",
                 cases[i].entry);
        folder_put_text("panoramas.json", json);
        assert_true(spl_panoramas_load(&list, test_folder, &strict, &err) < 0);
        assert_null(list.views);
        if (strcmp(err.field, cases[i].field) || !strstr(err.message, cases[i].part) ||
            (!strstr(err.message, "panorama 1") && strcmp(cases[i].field, "name")))
            fail_msg("case %zu: [%s] \"%s\" instead of [%s] \"%s\"", i, err.field, err.message, cases[i].field,
                     cases[i].part);
        refused_count = 0; /* the others are taken, and nothing of a bad one */
        assert_int_equal(spl_panoramas_load(&list, test_folder, &lenient, NULL), 0);
        assert_int_equal(refused_count, 1);
        assert_non_null(strstr(refused_last.message, cases[i].part));
        assert_int_equal(list.count, 6);
        assert_string_equal(list.views[0].name, "good-front");
        spl_view_list_finish(&list);
    }
}

static void refused(const char *path, int code, const char *part)
{
    struct spl_view_list list;
    struct spl_error err = {0};
    assert_int_equal(spl_panoramas_load(&list, path, &strict, &err), code);
    if (!strstr(err.message, part))
        fail_msg("\"%s\" lacks \"%s\"", err.message, part);
    assert_null(list.views);
}

static void lists_and_folders(void **state)
{
    struct spl_view_list list;
    (void)state;
    refused(in_folder("nowhere"), SPL_E_NOT_FOUND, "nowhere");
    unlink(in_folder("panoramas.json"));
    refused(test_folder, SPL_E_NOT_FOUND, "no panoramas.json");
    assert_int_equal(mkdir(in_folder("0"), 0777), 0);
    folder_put_text("0/cameras.txt", "");
    refused(test_folder, SPL_E_NOT_FOUND, "did you mean");
    unlink(in_folder("0/cameras.txt"));
    rmdir(in_folder("0"));
    folder_put_text("panoramas.json", "");
    refused(test_folder, SPL_E_INPUT, "is empty");
    folder_put_text("panoramas.json", "{\"panoramas\": [");
    refused(test_folder, SPL_E_INPUT, "broken JSON");
    folder_put_text("panoramas.json", "ply\nformat ascii 1.0");
    refused(test_folder, SPL_E_INPUT, "is no JSON");
    folder_put_text("panoramas.json", "\xef\xbb\xbf \n");
    refused(test_folder, SPL_E_INPUT, "is no JSON");
    folder_put_text("panoramas.json", "{\"Panoramas\": []}");
    refused(test_folder, SPL_E_INPUT, "one of panoramas {");
    folder_put_text("panoramas.json", "{\"panoramas\": {}}");
    refused(test_folder, SPL_E_INPUT, "must be an array");
    folder_put_text("panoramas.json", "{\"panoramas\": []}");
    refused(test_folder, SPL_E_INPUT, "holds no view");
    folder_put_text("panoramas.json", "\xff\xd8\xff\xe0 and so on");
    refused(in_folder("panoramas.json"), SPL_E_INPUT, "is an image");
    folder_put_text("s.jpg", "628 314");
    folder_put_text("panoramas.json", "{\"panoramas\": [{\"name\": \"a\", \"color\": \"s.jpg\", " POSE "},"
                          "{\"name\": \"a\", \"color\": \"s.jpg\", " POSE "}]}");
    refused(test_folder, SPL_E_INPUT, "two views are called 'a-");
    /* as synth writes it: the folder above will do */
    folder_put_text("panoramas.json",
                    "\xef\xbb\xbf{\"panoramas\": [{\"name\": \"a\", \"color\": \"s.jpg\", " POSE "}]}");
    char inner[256];
    snprintf(inner, sizeof inner, "%s", in_folder("panoramas"));
    assert_int_equal(mkdir(inner, 0777), 0);
    assert_int_equal(rename(in_folder("panoramas.json"), strcat(inner, "/panoramas.json")), 0);
    folder_put_text("panoramas/s.jpg", "628 314");
    assert_int_equal(spl_panoramas_load(&list, test_folder, &strict, NULL), 0);
    assert_int_equal(list.count, 6);
    assert_string_equal(list.views[0].photograph, in_folder("panoramas/s.jpg"));
    spl_view_list_finish(&list);
    for (long n = 1;; n++) {
        struct spl_error err = {0};
        spl_memory_fail_after(n);
        int rc = spl_panoramas_load(&list, test_folder, &lenient, &err);
        spl_memory_fail_after(0);
        spl_view_list_finish(&list);
        if (!rc)
            break;
        assert_int_equal(rc, SPL_E_NOMEM);
        assert_in_range(n, 1, 100);
    }
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(an_equirectangular_image_becomes_six_faces),
        cmocka_unit_test(a_cut_panorama_says_its_elevations),
        cmocka_unit_test(a_cube_is_six_photographs),
        cmocka_unit_test(what_is_wrong_is_named),
        cmocka_unit_test(lists_and_folders),
    };
    return cmocka_run_group_tests(tests, folder_make, folder_remove);
}
