/* Cameras at stations: a query's, a body's and a pick's are the same; what goes with them, and what is refused. */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <math.h>
#include <string.h>
#include <cmocka.h>

#include "service/request/request.h"

static const struct spl_camera_defaults defaults = {
    .eye = {10, 0, 0}, .target = {0, 0, 0}, .up = {0, 0, 1}, .fov = 60, .near = 0.01, .far = INFINITY};
static const struct spl_camera_limits limits = {.side_px = 8192, .pixels = 64 << 20};

/* One that looks straight down, up is +y. */
static int find_door(const struct spl_camera_names *names, const char *name, struct spl_camera_defaults *out,
                     struct spl_error *err)
{
    static const double view[3][3] = {{0, 0, 9}, {0, 0, 0}, {0, 1, 0}};
    (void)names;
    (void)name;
    (void)err;
    memcpy(out->eye, view[0], sizeof out->eye);
    memcpy(out->target, view[1], sizeof out->target);
    memcpy(out->up, view[2], sizeof out->up);
    out->settings[0] = 0;
    out->fov = out->fit[0] = out->fit[1] = 70;
    return 0;
}

/* A scanner that leans, turned to +y, and a camera that looks along -x and down. */
static const double poses[2][16] = {{0, -1, 0, 5, 0.8, 0, -0.6, 6, 0.6, 0, 0.8, 7, 0, 0, 0, 1},
                                    {0, 0.6, -0.8, 1e6, 1, 0, 0, 2e6, 0, -0.8, -0.6, 3, 0, 0, 0, 1}};
static const struct spl_dataset_info scanned = {
    .id = "hall", .default_up = {0, 0, 2}, .station_count = 2, .stations = poses};

static int at_station(const char *text, struct spl_view_request *r, struct spl_error *err)
{
    struct spl_camera_defaults known = defaults;
    const struct spl_camera_names door = {find_door};
    known.dataset = &scanned;
    known.names = &door;
    *err = (struct spl_error){0};
    return *text == '{' ? spl_view_request_from_json(text, strlen(text), &known, &limits, r, err)
           : strstr(text, "x=") == text
               ? spl_pick_request_from_query(text, strlen(text), &known, &limits, r, err)
               : spl_view_request_from_query(text, strlen(text), &known, &limits, r, err);
}

static void a_station_is_where_one_stands(void **state)
{
    (void)state;
    struct spl_view_request r, other;
    struct spl_error err;
    assert_int_equal(at_station("station=0", &r, &err), 0);
    const double *rotation = r.view.camera.rotation, *eye = r.view.camera.eye;
    assert_true(eye[0] == 5 && eye[1] == 6 && eye[2] == 7);
    assert_true(fabs(rotation[7] - 1) < 1e-15 && fabs(rotation[5] + 1) < 1e-15); /* forward +y, down -z */
    assert_int_equal(at_station("{\"camera\": {\"station\": 0}}", &other, &err), 0);
    assert_memory_equal(&r.view.camera, &other.view.camera, sizeof r.view.camera);
    assert_int_equal(at_station("x=1&y=1&station=0", &other, &err), 0);
    assert_memory_equal(&r.view.camera, &other.pick.camera, sizeof r.view.camera);
    assert_int_equal(at_station("station=1", &r, &err), 0); /* directions are exact however far away it is */
    assert_true(eye[0] == 1e6 && rotation[6] == -1 && rotation[7] == 0 && rotation[8] == 0);
    assert_int_equal(at_station("station=0&target=5,6,0&up=0,1,0&fov=50&near=2", &r, &err), 0);
    assert_true(eye[2] == 7 && rotation[8] == -1 && r.view.camera.near == 2);
    assert_int_equal(at_station("station=0&projection=equirectangular", &r, &err), 0);
    assert_true(r.view.camera.projection == SPL_EQUIRECTANGULAR && eye[2] == 7 && fabs(rotation[7] - 1) < 1e-15);
    assert_int_equal(at_station("station=0&projection=equirectangular&target=9,6,-20", &r, &err), 0);
    assert_true(fabs(rotation[6] - 1) < 1e-15 && rotation[8] == 0); /* upright, however steeply */
    assert_int_equal(at_station("station=0&view=door", &r, &err), 0); /* of that view what is no pose */
    assert_true(eye[0] == 5 && fabs(360 / r.view.camera.fy - tan(35 * M_PI / 180)) < 1e-9);
    assert_int_equal(at_station("station=0&view_height=3", &r, &err), 0);
    assert_true(r.view.camera.projection == SPL_ORTHOGRAPHIC);
    assert_int_equal(at_station("station=0&view_height=3&target=5,6,0", &r, &err), 0); /* a plan: up is +y */
    assert_true(rotation[8] == -1 && rotation[4] == -1);
}

static void what_is_no_station_is_refused(void **state)
{
    (void)state;
    struct spl_view_request r;
    struct spl_error err;
    static const struct {
        const char *text, *field, *part;
    } wrong[] = {
        {"station=2", "station", "has 0 to 1"},
        {"station=-1", "station", "whole number"},
        {"station=0.5", "station", "whole number"},
        {"station=", "station", "number"},
        {"station=nan", "station", "finite"},
        {"station=1e15", "station", "has 0 to 1"},
        {"station=0&station=0", "station", "twice"},
        {"station=0&eye=1,2,3", "station", "exclude"},
        {"x=1&y=1&station=7", "station", "has 0 to 1"},
        {"{\"camera\": {\"station\": 0, \"q\": [1, 0, 0, 0], \"t\": [0, 0, 0]}}", "station", "exclude"},
        {"{\"camera\": {\"station\": \"0\"}}", "station", "number"},
        {"{\"station\": 0}", "station", "camera"},
        {"station=0&projection=orthographic", "view_height", "needs"},
        {"station=0&up=0,0,0", "up", "zero"},
        {"station=0&target=5,6,7", "target", "equals eye"},
    };
    for (size_t i = 0; i < sizeof wrong / sizeof *wrong; i++) {
        assert_int_equal(at_station(wrong[i].text, &r, &err), SPL_E_INPUT);
        assert_string_equal(err.field, wrong[i].field);
        assert_non_null(strstr(err.message, wrong[i].part));
    }
    err = (struct spl_error){0};
    assert_int_equal(spl_view_request_from_query("station=0", 9, &defaults, &limits, &r, &err), SPL_E_INPUT);
    assert_true(!strcmp(err.field, "station") && strstr(err.message, "no dataset"));
    const struct spl_dataset_info none = {.id = "tree", .default_up = {0, 0, 1}};
    struct spl_camera_defaults bare = defaults;
    bare.dataset = &none;
    err = (struct spl_error){0};
    assert_int_equal(spl_view_request_from_query("station=0", 9, &bare, &limits, &r, &err), SPL_E_INPUT);
    assert_true(!strcmp(err.field, "station") && strstr(err.message, "'tree'"));
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(a_station_is_where_one_stands),
        cmocka_unit_test(what_is_no_station_is_refused),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
