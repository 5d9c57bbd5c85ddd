/* Lists of views: our JSON and COLMAP's text model give the cameras that they describe, and what is wrong is refused
 * with file, view and field. The COLMAP numbers are the golden vectors of api/cameras.md. */
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
#include "support/folder.h"

#define POSE                                                                                                           \
    "-0.55772847375664971 -0.76215345285486739 -0.30022022910563139 0.13389875988314353 "                              \
    "-0.06410832213881687 0.16613728300474614 4.6401280721795111"
#define LOOK "\"camera\":{\"eye\":[3,-4,2],\"target\":[0,1,1.5],\"fov\":60}"

static const char *put(const char *name, const char *text)
{
    folder_put_text(name, text);
    return in_folder(name);
}

static void put_model(const char *cameras, const char *images)
{
    put("cameras.txt", cameras);
    put("images.txt", images);
}

static void assert_refused(const char *path, int code, const char *field, const char *says)
{
    struct spl_view_list list;
    struct spl_error err = {0};
    memset(&list, 0x55, sizeof list);
    assert_int_equal(spl_view_list_load(&list, path, &err), code);
    assert_int_equal(err.code, code);
    assert_string_equal(err.field, field);
    if (!strstr(err.message, says))
        fail_msg("'%s' lacks '%s'", err.message, says);
    assert_null(list.views);
    assert_int_equal(list.count, 0);
}

static void broken_json_is_refused_by_name(void **state)
{
    (void)state;
    static const struct {
        const char *text, *field, *says;
    } rows[] = {
        {"", "", "empty"},
        {"{", "", "line 1"},
        {"[]", "views", "missing"},
        {"{\"views\":{}}", "views", "an object"},
        {"{\"views\":[]}", "views", "no view"},
        {"{\"views\":[3]}", "views", "a number"},
        {"{\"views\":[{" LOOK "}]}", "name", "view 1"},
        {"{\"views\":[{\"name\":7," LOOK "}]}", "name", "a number"},
        {"{\"views\":[{\"name\":\"a/b\"," LOOK "}]}", "name", "'a/b'"},
        {"{\"views\":[{\"name\":\"\"," LOOK "}]}", "name", "1 to 100"},
        {"{\"views\":[{\"name\":\"..\"," LOOK "}]}", "name", "'..'"},
        {"{\"views\":[{\"name\":\"a\\nb\"," LOOK "}]}", "name", "control"},
        {"{\"views\":[{\"name\":\"a\"," LOOK "},{\"name\":\"a\"," LOOK "}]}", "name", "two views are called 'a'"},
        {"{\"views\":[{\"name\":\"a\",\"photograph\":1," LOOK "}]}", "photograph", "view 1"},
        {"{\"views\":[{\"name\":\"a\"}]}", "camera", "missing"},
        {"{\"views\":[{\"name\":\"a\",\"camera\":[]}]}", "camera", "an array"},
        {"{\"views\":[{\"name\":\"a\",\"lod\":1," LOOK "}]}", "lod", "unknown"},
        {"{\"views\":[{\"name\":\"a\",\"eye\":[1,2,3]," LOOK "}]}", "eye", "\"camera\""},
        {"{\"views\":[{\"name\":\"a\",\"camera\":{\"POI\":[1,2,3]}}]}", "POI", "unknown"},
        {"{\"views\":[{\"name\":\"a\",\"camera\":{\"target\":[1,2,3],\"fov\":60}}]}", "eye", "missing"},
        {"{\"views\":[{\"name\":\"a\",\"camera\":{\"eye\":[1,2,3],\"fov\":60}}]}", "target", "needed"},
        {"{\"views\":[{\"name\":\"a\",\"camera\":{\"eye\":[1,2,3],\"target\":[0,0,0]}}]}", "fov", "missing"},
        {"{\"views\":[{\"name\":\"east\",\"camera\":{\"eye\":[1,2,3],\"target\":[1,2,3],\"fov\":60}}]}", "target",
         "'east'"},
        {"{\"views\":[{\"name\":\"a\",\"width\":9,\"camera\":{\"eye\":[1,2,3],\"target\":[1,2,4],\"width\":9}}]}",
         "width", "twice"},
        {"{\"views\":[{\"name\":\"a\",\"width\":65536," LOOK "}]}", "width", "65536"},
        {"{\"views\":[{\"name\":\"a\",\"width\":65535,\"height\":65535," LOOK "}]}", "width", "limit"},
        {"{\"views\":[{\"name\":\"a\",\"near\":0," LOOK "}]}", "near", "near"},
        {"{\"views\":[{\"name\":\"a\",\"near\":5,\"far\":4," LOOK "}]}", "far", "near"},
    };
    for (size_t i = 0; i < sizeof rows / sizeof *rows; i++)
        assert_refused(put("views.json", rows[i].text), SPL_E_INPUT, rows[i].field, rows[i].says);
    assert_refused("/nowhere/views.json", SPL_E_NOT_FOUND, "", "/nowhere/views.json");
}

static void json_gives_cameras_and_photographs(void **state)
{
    (void)state;
    const char *path =
        put("views.json", "{\"views\":[{\"name\":\"east\",\"width\":640,\"height\":480," LOOK "},"
                          "{\"name\":\"wést 2\",\"near\":0.5,\"far\":90,\"photograph\":\"photos/w.jpg\",\"camera\":{"
                          "\"q\":[1,0,0,0],\"t\":[0,0,0],\"fx\":500,\"fy\":510,\"cx\":331.25,\"cy\":228.5}},"
                          "{\"name\":\"c\",\"photograph\":\"/p/c.png\",\"camera\":{\"eye\":[0,0,0],\"target\":[1,0,0],"
                          "\"width\":100,\"height\":50,\"fx\":80}}]}");
    struct spl_view_list list;
    struct spl_error err = {0};
    if (spl_view_list_load(&list, path, &err))
        fail_msg("%s", err.message);
    assert_int_equal(list.count, 3);
    assert_string_equal(list.views[0].name, "east");
    assert_null(list.views[0].photograph);
    const struct spl_camera *c = &list.views[0].camera;
    assert_true(c->near == 0.01 && isinf(c->far) && c->width == 640 && c->height == 480);
    double pixel[2], depth;
    assert_true(spl_camera_project(c, (double[]){0.5, 0.25, 1}, pixel, &depth)); /* golden vector of api/cameras.md */
    assert_true(fabs(pixel[0] - 323.56596303319333) < 1e-9 && fabs(pixel[1] - 287.83174284533473) < 1e-9);
    assert_string_equal(list.views[1].name, "wést 2");
    assert_int_equal(strncmp(list.views[1].photograph, test_folder, strlen(test_folder)), 0);
    assert_non_null(strstr(list.views[1].photograph, "/photos/w.jpg"));
    c = &list.views[1].camera;
    assert_true(c->near == 0.5 && c->far == 90 && c->fx == 500 && c->fy == 510 && c->cx == 331.25 && c->cy == 228.5);
    assert_true(c->width == 1280 && c->height == 720);
    assert_string_equal(list.views[2].photograph, "/p/c.png");
    assert_true(list.views[2].camera.fy == 80 && list.views[2].camera.cx == 50);
    spl_view_list_finish(&list);
    assert_null(list.views);
    spl_view_list_finish(NULL);
}

static void broken_colmap_is_refused_by_line(void **state)
{
    (void)state;
    static const char good_camera[] = "1 PINHOLE 640 480 500 510 331.25 228.5\n",
                      good_image[] = "1 " POSE " 1 a.jpg\n\n";
    static const struct {
        const char *cameras, *images, *field, *says;
    } rows[] = {
        {"x PINHOLE 640 480 500 510 3 2\n", good_image, "CAMERA_ID", "line 1"},
        {"# c\n1\n", good_image, "MODEL", "line 2"},
        {"1 FISHEYE 640 480 500 510 3 2\n", good_image, "MODEL", "FISHEYE"},
        {"1 PINHOLE wide 480 500 510 3 2\n", good_image, "WIDTH", "'wide'"},
        {"1 PINHOLE 640.5 480 500 510 3 2\n", good_image, "WIDTH", "whole"},
        {"1 PINHOLE 640 -1 500 510 3 2\n", good_image, "HEIGHT", "whole"},
        {"1 PINHOLE 0 480 500 510 3 2\n", good_image, "width", "width 0"},
        {"1 PINHOLE 640 480 500 510 3\n", good_image, "params", "4 numbers, not 3"},
        {"1 PINHOLE 640 480 500 nan 3 2\n", good_image, "PARAMS", "nan"},
        {"1 PINHOLE 640 480 1 1 1 1 1 1 1 1 1 1 1 1 1 1 1 1 1\n", good_image, "PARAMS", "more than 16"},
        {"1 OPENCV 640 480 500 500 3 2 0.1 0 0 0\n", good_image, "params", "0.1"},
        {"1 PINHOLE 640 480 0 510 3 2\n", good_image, "fx", "line 1"},
        {"1 PINHOLE 64 48 5 5 3 2\n1 PINHOLE 64 48 5 5 3 2\n", good_image, "CAMERA_ID", "twice"},
        {good_camera, "# none\n", "views", "no view"},
        {good_camera, "1 " POSE " 2 a.jpg\n\n", "CAMERA_ID", "no camera 2"},
        {good_camera, "1 " POSE " 1\n\n", "NAME", "line 1"},
        {good_camera, "1 1 2 3\n\n", "QUATERNION", "line 1"},
        {good_camera, "1 0 0 0 0 1 2 3 1 a.jpg\n\n", "q", "line 1"},
        {good_camera, "1 " POSE " 1 a.jpg\n2 " POSE " 1 b.jpg\n", "POINTS2D", "line 2"},
        {good_camera, "1 " POSE " 1 a.jpg\n\n2 " POSE " 1 a.png\n\n", "name", "'a'"},
        {good_camera, "1 " POSE " 1 .jpg\n\n", "name", "'.jpg'"},
    };
    for (size_t i = 0; i < sizeof rows / sizeof *rows; i++) {
        put_model(rows[i].cameras, rows[i].images);
        assert_refused(test_folder, SPL_E_INPUT, rows[i].field, rows[i].says);
    }
    put_model(good_camera, good_image);
    remove(in_folder("images.txt"));
    assert_refused(test_folder, SPL_E_NOT_FOUND, "", "images.txt");
}

static void colmap_gives_cameras_and_photographs(void **state)
{
    (void)state;
    put_model("# Camera list\n7 PINHOLE 640 480 500 510 331.25 228.5\r\n 9 SIMPLE_RADIAL 100 50 80 50 25 0\n",
              "# Image list\n4 " POSE " 7 east/IMG 1.v2.jpg\n1.5 2.5 -1 3 4 17\n\n5 1 0 0 0 0 0 0 9 b.png\n");
    mkdir(in_folder("images"), 0700);
    struct spl_view_list list;
    struct spl_error err = {0};
    if (spl_view_list_load(&list, test_folder, &err))
        fail_msg("%s", err.message);
    assert_int_equal(list.count, 2);
    assert_string_equal(list.views[0].name, "east_IMG 1.v2");
    assert_string_equal(list.views[1].name, "b");
    assert_string_equal(list.views[0].photograph, in_folder("images/east/IMG 1.v2.jpg"));
    double pixel[2], depth;
    assert_true(spl_camera_project(&list.views[0].camera, (double[]){-0.577054497069, 3.30876147309, -1.46753054758},
                                   pixel, &depth));
    assert_true(fabs(pixel[0] - 412.5) < 1e-9 && fabs(pixel[1] - 273.125) < 1e-9 && fabs(depth - 8) < 1e-9);
    const struct spl_camera *c = &list.views[1].camera;
    assert_true(c->width == 100 && c->height == 50 && c->fx == 80 && c->fy == 80 && c->cx == 50 && c->cy == 25);
    spl_view_list_finish(&list);
}

/* sparse/0 beside images/, as COLMAP lays a project out. */
static void photographs_are_found_where_colmap_keeps_them(void **state)
{
    (void)state;
    static const char *const folders[] = {"project", "project/sparse", "project/sparse/0", "project/images"};
    for (int i = 0; i < 4; i++)
        assert_int_equal(mkdir(in_folder(folders[i]), 0700), 0);
    put("project/sparse/0/cameras.txt", "1 PINHOLE 640 480 500 510 331.25 228.5\n");
    put("project/sparse/0/images.txt", "1 " POSE " 1 a.jpg\n\n");
    put("project/images/a.jpg", "a");
    struct spl_view_list list;
    assert_int_equal(spl_view_list_load(&list, in_folder("project/sparse/0"), NULL), 0);
    assert_int_equal(access(list.views[0].photograph, R_OK), 0);
    spl_view_list_finish(&list);
    assert_refused(in_folder("project/sparse"), SPL_E_NOT_FOUND, "", "did you mean");
    assert_refused(in_folder("project/sparse"), SPL_E_NOT_FOUND, "", "project/sparse/0'?");
    assert_refused(in_folder("project"), SPL_E_NOT_FOUND, "", "project/sparse/0'?");
    assert_refused(in_folder("project/images"), SPL_E_NOT_FOUND, "", "cameras.txt");
}

static void no_refused_allocation_is_passed_over(void **state)
{
    (void)state;
    put_model("1 PINHOLE 640 480 500 510 331.25 228.5\n", "1 " POSE " 1 a.jpg\n\n");
    const char *path = put("views.json", "{\"views\":[{\"name\":\"a\",\"photograph\":\"p\"," LOOK "}]}");
    for (int colmap = 0; colmap < 2; colmap++) {
        int rc = SPL_E_NOMEM, n = 0;
        while (rc == SPL_E_NOMEM) {
            struct spl_view_list list;
            struct spl_error err = {0};
            spl_memory_fail_after(++n);
            rc = spl_view_list_load(&list, colmap ? test_folder : path, &err);
            spl_memory_fail_after(0);
            assert_int_equal(err.code, rc);
            spl_view_list_finish(&list);
        }
        assert_int_equal(rc, 0);
        assert_true(n > 5);
    }
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(broken_json_is_refused_by_name),
        cmocka_unit_test(json_gives_cameras_and_photographs),
        cmocka_unit_test(broken_colmap_is_refused_by_line),
        cmocka_unit_test(colmap_gives_cameras_and_photographs),
        cmocka_unit_test(photographs_are_found_where_colmap_keeps_them),
        cmocka_unit_test(no_refused_allocation_is_passed_over),
    };
    return cmocka_run_group_tests(tests, folder_make, folder_remove);
}
