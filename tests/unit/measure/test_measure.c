/* Order statistics and camera paths of measurements. */
#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

#include <cmocka.h>

#include "measure/path.h"
#include "measure/summary.h"

static void test_summary(void **state)
{
    (void)state;
    double values[] = {9, 1, 4, 2, 3};
    struct spl_summary s = spl_summarise(values, 5);
    assert_true(s.min == 1 && s.q1 == 2 && s.median == 3 && s.q3 == 4 && s.max == 9);
    double even[] = {4, 1, 2, 3};
    s = spl_summarise(even, 4);
    assert_true(s.q1 == 1.75 && s.median == 2.5 && s.q3 == 3.25);
    double one[] = {7};
    s = spl_summarise(one, 1);
    assert_true(s.min == 7 && s.q1 == 7 && s.median == 7 && s.max == 7);
    s = spl_summarise(NULL, 0);
    assert_true(s.median == 0);
}

/* Loads `json` from a file; returns the status. */
static int load(const char *json, const char *set, struct spl_path *path, struct spl_error *err)
{
    char name[] = "/tmp/splatd-views-XXXXXX";
    int fd = mkstemp(name);
    assert_true(fd >= 0);
    assert_int_equal(write(fd, json, strlen(json)), (ssize_t)strlen(json));
    close(fd);
    memset(err, 0, sizeof *err);
    int status = spl_path_load(path, name, set, err);
    unlink(name);
    return status;
}

#define VIEW(eye)                                                                                                      \
    "{\"eye\": " eye ", \"target\": [0, 0, 1], \"up\": [0, 0, 1], \"vfov_deg\": 40, \"near\": 0.5, \"far\": 9}"
#define HALL "\"hall\": {\"overview\": " VIEW("[4, 0, 1]") ", \"close\": " VIEW("[2, 0, 1]") "}"

static void test_path_between_views(void **state)
{
    (void)state;
    struct spl_path path;
    struct spl_error err;
    struct spl_camera camera;
    assert_int_equal(load("{\"_note\": \"any\", " HALL "}", NULL, &path, &err), 0);
    for (int i = 0; i <= 2; i++) {
        assert_int_equal(spl_path_get_camera(&path, i / 2., 1280, 720, &camera, &err), 0);
        assert_true(camera.eye[0] == 4 - i && camera.eye[1] == 0 && camera.eye[2] == 1);
        double pixel[2], depth;
        assert_true(spl_camera_project(&camera, path.from.target, pixel, &depth));
        assert_true(fabs(pixel[0] - 640) < 1e-6 && fabs(pixel[1] - 360) < 1e-6 && fabs(depth - (4 - i)) < 1e-9);
        assert_true(camera.near == 0.5 && camera.far == 9);
    }
}

static void test_path_turns(void **state)
{
    (void)state;
    struct spl_path path;
    struct spl_error err;
    struct spl_camera camera;
    assert_int_equal(load("{" HALL "}", "hall", &path, &err), 0);
    path.turn = 2 * M_PI;
    assert_int_equal(spl_path_get_camera(&path, 0.25, 64, 64, &camera, &err), 0);
    /* a quarter of the way round, counter-clockwise seen from above, at distance 3.5 */
    assert_true(fabs(camera.eye[0]) < 1e-9 && fabs(camera.eye[1] - 3.5) < 1e-9 && fabs(camera.eye[2] - 1) < 1e-9);
}

static void test_path_refusals(void **state)
{
    (void)state;
    static const struct {
        const char *json, *set, *said;
    } bad[] = {
        {"{", NULL, "line 1"},
        {"[]", NULL, "not one set"},
        {"{}", NULL, "not one set"},
        {"{" HALL ", \"yard\": {}}", NULL, "not one set"},
        {"{" HALL "}", "yard", "'yard'"},
        {"{\"hall\": {\"overview\": " VIEW("[4, 0, 1]") "}}", "hall", "'close' is missing"},
        {"{\"hall\": {\"overview\": " VIEW("[4, 0]") "}}", "hall", "'eye'"},
        {"{\"hall\": {\"overview\": " VIEW("[4, 0, \"1\"]") "}}", "hall", "'eye'"},
        {"{\"hall\": {\"overview\": {\"eye\": [1, 2, 3], \"target\": [0, 0, 0], \"up\": [0, 0, 1]}}}", "hall",
         "'vfov_deg'"},
    };
    for (size_t i = 0; i < sizeof bad / sizeof *bad; i++) {
        struct spl_path path;
        struct spl_error err;
        assert_int_equal(load(bad[i].json, bad[i].set, &path, &err), SPL_E_INPUT);
        assert_non_null(strstr(err.message, bad[i].said));
    }
    struct spl_path path;
    struct spl_error err;
    assert_int_equal(spl_path_load(&path, "/nowhere/views.json", NULL, &(struct spl_error){0}), SPL_E_INPUT);
    /* A path through its own target is refused where it gets there, not drawn as nonsense. */
    assert_int_equal(load("{" HALL "}", "hall", &path, &err), 0);
    path.to.eye[0] = -4;
    struct spl_camera camera;
    assert_true(spl_path_get_camera(&path, 0.5, 64, 64, &camera, &err) < 0);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_summary),
        cmocka_unit_test(test_path_between_views),
        cmocka_unit_test(test_path_turns),
        cmocka_unit_test(test_path_refusals),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
