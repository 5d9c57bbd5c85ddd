/* Where the pixels of a map lie, and the numbers of coordinate systems in texts. */
#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <stdlib.h>
#include <string.h>
#include <cmocka.h>

#include "base/error.h"
#include "geom/ground.h"

static struct spl_camera looking(const double eye[3], const double target[3], const double up[3])
{
    struct spl_camera camera = {.near = 1, .far = INFINITY};
    assert_int_equal(spl_camera_set_orthographic(&camera, 64, 800, 640, NULL), SPL_OK); /* a tenth of a unit a pixel */
    assert_int_equal(spl_camera_look_at(&camera, eye, target, up, NULL), SPL_OK);
    return camera;
}

/* In UTM's range a corner is right to a hundredth of a millimetre, of a world that is metres. */
static void corners_are_right_far_away(void **state)
{
    (void)state;
    static const double eye[3] = {406000.125, 5405000.0625, 812.5}, ups[3][3] = {{0, 1, 0}, {0, 7, 0}, {-0.6, 0.8, 0}};
    for (int u = 0; u < 3; u++) {
        struct spl_camera camera = looking(eye, (double[]){eye[0], eye[1], -3}, ups[u]);
        struct spl_ground ground;
        assert_int_equal(spl_camera_get_ground(&camera, &ground, NULL), SPL_OK);
        assert_int_equal(spl_ground_is_north_up(&ground), u < 2);
        assert_true(ground.placed && ground.height == 812.5);
        static const double pixels[4][2] = {{0, 0}, {800, 0}, {0, 640}, {123.25, 77.5}};
        for (int i = 0; i < 4; i++) {
            double at[3] = {0, 0, 100}, pixel[2], depth;
            for (int a = 0; a < 2; a++)
                at[a] = ground.origin[a] + pixels[i][0] * ground.across[a] + pixels[i][1] * ground.down[a];
            assert_true(spl_camera_project(&camera, at, pixel, &depth));
            assert_true(fabs(pixel[0] - pixels[i][0]) < 1e-4 && fabs(pixel[1] - pixels[i][1]) < 1e-4);
        }
        char text[SPL_WORLD_FILE_BYTES];
        if (u == 0)
            assert_string_equal(
                spl_ground_print_world_file(&ground, text),
                "0.10000000000000001\n0\n0\n-0.10000000000000001\n405960.17499999999\n5405032.0125000002\n");
    }
}

static void what_is_no_map_is_refused(void **state)
{
    (void)state;
    struct spl_camera camera = looking((double[]){0, 0, 9}, (double[]){0, 0.001, 0}, (double[]){0, 1, 0});
    struct spl_ground ground;
    struct spl_error err = {0};
    assert_int_equal(spl_camera_get_ground(&camera, &ground, &err), SPL_E_INPUT);
    assert_string_equal(err.field, "format");
    assert_false(ground.placed);
    camera = looking((double[]){0, 0, -9}, (double[]){0, 0, 0}, (double[]){0, 1, 0});
    assert_int_equal(spl_camera_get_ground(&camera, &ground, NULL), SPL_E_INPUT); /* from below it is mirrored */
    camera = looking((double[]){0, 0, 9}, (double[]){0, 0, 0}, (double[]){0, 1, 0});
    camera.projection = SPL_PERSPECTIVE;
    assert_int_equal(spl_camera_get_ground(&camera, &ground, NULL), SPL_E_INPUT);
}

static void numbers_of_systems(void **state)
{
    (void)state;
    static const struct {
        const char *text;
        uint32_t number;
    } rows[] = {
        {NULL, 0},
        {"", 0},
        {"EPSG:2994", 2994},
        {"epsg:2994+EPSG:5703", 2994},
        {"EPSG:", 0},
        {"EPSG:1234567", 0},
        {"PROJCS[\"a\",GEOGCS[\"b\",AUTHORITY[\"EPSG\",\"4269\"]],UNIT[\"m\",1,AUTHORITY[\"EPSG\",\"9001\"]],"
         "AUTHORITY[\"EPSG\",\"26910\"]]", 26910},
        {"PROJCS[\"a\",GEOGCS[\"b\",AUTHORITY[\"EPSG\",\"4269\"]],UNIT[\"m\",1]]", 0},
        {"COMPD_CS[\"c\",PROJCS[\"a [x]\",GEOGCS[\"b\",AUTHORITY[\"EPSG\",\"4269\"]],AUTHORITY[\"EPSG\",\"2994\"]],"
         "VERT_CS[\"v\",AUTHORITY[\"EPSG\",\"5703\"]]]", 2994},
        {"PROJCRS[\"a\",BASEGEOGCRS[\"b\",ID[\"EPSG\",4326]],ID[\"EPSG\",32633]]", 32633},
        {"GEOGCS[\"b\",AUTHORITY[\"EPSG\",\"4326\"]]", 4326},
        {"PROJCS[\"a\",AUTHORITY[\"ESRI\",\"102100\"]]", 0},
        {"PROJCS[\"never closed\",AUTHORITY[\"EPSG\",", 0},
        {"PROJCS", 0},
    };
    for (size_t i = 0; i < sizeof rows / sizeof *rows; i++)
        if (spl_epsg_from_text(rows[i].text) != rows[i].number)
            fail_msg("'%s': %u instead of %u", rows[i].text, spl_epsg_from_text(rows[i].text), rows[i].number);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(corners_are_right_far_away),
        cmocka_unit_test(what_is_no_map_is_refused),
        cmocka_unit_test(numbers_of_systems),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
