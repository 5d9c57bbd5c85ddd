/* Requests that are views by their own rules: lists of rays, whose frames and refusals are theirs; map tiles; plans
 * that were saved under a name. */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <stdio.h>
#include <math.h>
#include <string.h>
#include <cmocka.h>

#include "geom/ray_list.h"
#include "service/request/request.h"

static const struct spl_camera_defaults defaults = {
    .eye = {10, 0, 0}, .target = {0, 0, 0}, .up = {0, 0, 1}, .fov = 60, .near = 0.01, .far = INFINITY};
static const struct spl_camera_limits limits = {.side_px = 8192, .pixels = 64 << 20};

static void rays_look_along_their_frame(void **state)
{
    (void)state;
    static const struct {
        const char *query;
        double hit[3]; /* where the list's one direction goes in the world */
    } rows[] = {
        {"", {-0.8, 0, 0.6}}, /* an eye at x = 10 that looks along -x: its right is +y */
        {"frame=sensor", {0, -0.6, 0.8}},
        {"frame=world", {0.6, 0, 0.8}},
    };
    for (size_t i = 0; i < sizeof rows / sizeof *rows; i++) {
        const double list[][3] = {{0, -3, 4}, {0, 3, 4}, {3, 0, 4}}; /* up and ahead; left and up; the world's */
        struct spl_rays *rays;
        struct spl_view_request r;
        struct spl_error err = {0};
        assert_int_equal(spl_rays_create(list[i], 1, &rays, NULL), 0);
        assert_int_equal(
            spl_rays_request_from(NULL, rows[i].query, strlen(rows[i].query), rays, &defaults, &limits, &r, &err), 0);
        for (int k = 0; k < 3; k++) {
            const double *m = r.view.camera.rotation + k, *d = rays->directions[0];
            assert_true(fabs(m[0] * d[0] + m[3] * d[1] + m[6] * d[2] - rows[i].hit[k]) < 1e-12);
        }
        assert_true(r.view.rays == rays && r.view.layers == 1u << SPL_LAYER_RANGE && r.encode.format == SPL_FORMAT_NPY);
        static const char *const lenses[] = {"fov=50", "width=9", "projection=cube", "fx=100", "elevation=1,2,3"};
        for (size_t k = 0; k < sizeof lenses / sizeof *lenses; k++) {
            struct spl_error why = {0};
            assert_int_equal(
                spl_rays_request_from(NULL, lenses[k], strlen(lenses[k]), rays, &defaults, &limits, &r, &why),
                SPL_E_INPUT);
            assert_int_equal(strncmp(lenses[k], why.field, strlen(why.field)), 0);
        }
        spl_rays_destroy(rays);
    }
}

static void a_tile_lies_among_others(void **state)
{
    (void)state;
    const struct spl_tile_view tile = {
        .eye = {1, 2, 30}, .up = {0, 1}, .scale = {4, 4}, .side = 256, .format = SPL_FORMAT_PNG};
    struct spl_view_request r;
    struct spl_error err = {0};
    assert_int_equal(spl_tile_request_from_query("shade=edl", 9, &tile, &defaults, &limits, &r, &err), 0);
    assert_true(r.view.surrounded && r.view.camera.projection == SPL_ORTHOGRAPHIC && r.view.camera.width == 256);
    assert_int_equal(spl_tile_request_from_query("station=1", 9, &tile, &defaults, &limits, &r, &err), SPL_E_INPUT);
    assert_string_equal(err.field, "station"); /* and what a tile takes, known elsewhere or nowhere */
    assert_non_null(strstr(err.message, "a tile's path says where it lies"));
    err = (struct spl_error){0};
    assert_int_equal(spl_tile_request_from_query("rotation=1", 10, &tile, &defaults, &limits, &r, &err), SPL_E_INPUT);
    assert_non_null(strstr(err.message, "unknown parameter 'rotation'; a tile's path"));
    err = (struct spl_error){0};
    assert_int_equal(spl_tile_request_from_query("supersampling=2", 15, &tile, &defaults, &limits, &r, &err),
                     SPL_E_INPUT);
    assert_non_null(strstr(err.message, "'supersampling'; did you mean 'supersample'? a tile's path"));
    assert_int_equal(spl_view_request_from_query("shade=edl", 9, &defaults, &limits, &r, &err), 0);
    assert_false(r.view.surrounded);
}

static int find_plan(const struct spl_camera_names *names, const char *name, struct spl_camera_defaults *out,
                     struct spl_error *err)
{
    (void)names;
    (void)name;
    (void)err;
    out->view_height = 8;
    return 0;
}

static void a_plan_by_name_is_orthographic(void **state)
{
    (void)state;
    static const struct {
        const char *query;
        enum spl_projection projection;
        double fx; /* of an image that is 400 pixels high; 0: any */
    } rows[] = {
        {"view=plan", SPL_ORTHOGRAPHIC, 50},          {"view=plan&projection=orthographic", SPL_ORTHOGRAPHIC, 50},
        {"view=plan&eye=1,2,3", SPL_ORTHOGRAPHIC, 50}, {"view=plan&view_height=4", SPL_ORTHOGRAPHIC, 100},
        {"view=plan&fov=50", SPL_PERSPECTIVE, 0},     {"view=plan&fx=90", SPL_PERSPECTIVE, 90},
        {"view=plan&projection=fisheye", SPL_FISHEYE, 0},
    };
    const struct spl_camera_names names = {find_plan};
    struct spl_camera_defaults named = defaults;
    named.names = &names;
    for (size_t i = 0; i < sizeof rows / sizeof *rows; i++) {
        struct spl_view_request r;
        struct spl_error err = {0};
        char query[96];
        snprintf(query, sizeof query, "%s&width=600&height=400", rows[i].query);
        assert_int_equal(spl_view_request_from_query(query, strlen(query), &named, &limits, &r, &err), 0);
        assert_int_equal(r.view.camera.projection, rows[i].projection);
        assert_true(rows[i].fx == 0 || r.view.camera.fx == rows[i].fx);
    }
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(rays_look_along_their_frame),
        cmocka_unit_test(a_tile_lies_among_others),
        cmocka_unit_test(a_plan_by_name_is_orthographic),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
