/* A dataset's world by other coordinate systems: what of a file's text gets to PROJ, heights in any unit, reach, and
 * that what is kept is not mistaken for another's. Where points lie is held against formulas by
 * tests/http/test_places.py. */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <math.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <cmocka.h>

#include "service/place/places.h"
#include "service/place/transform.h"
#include "support/make_dataset.h"

/* Of a dataset of two discs near (984250, 194305), which EPSG:2263 has at 74° W, 40.7° N. */
static struct spl_places *open(const char *unit, const char *crs, struct spl_places_hook *hook, bool waits)
{
    const struct make_splat discs[] = {
        {.position = {984250, 194305, 10}, .normal = {0, 0, 1}, .radius = 1},
        {.position = {984260, 194315, 30}, .normal = {0, 0, 1}, .radius = 1},
    };
    make_dataset_unit = unit;
    make_dataset_crs = crs;
    struct spl_dataset *dataset = make_dataset(discs, 2);
    struct spl_places *places = NULL;
    assert_int_equal(spl_places_create(dataset, &places, NULL), 0);
    spl_dataset_close(dataset);
    spl_places_hook_init(hook, places, waits);
    return places;
}

static int ask(struct spl_places_hook *hook, uint32_t crs, const double in[3], double out[3], struct spl_error *err)
{
    *err = (struct spl_error){0};
    return hook->hook.to_world(&hook->hook, crs, "eye", in, out, err);
}

static const double degrees[3] = {-74, 40.7, 10};

static void heights_are_in_the_units_of_both(void **state)
{
    (void)state;
    const struct {
        const char *unit, *crs;
        uint32_t asked;
        double in, world;
    } rows[] = {
        {"us-ft", "EPSG:2263", 4326, 12, 12 * 3937 / 1200.0},
        {"us-ft", "EPSG:2263+EPSG:6360", 4326, 12, 12 * 3937 / 1200.0},
        {"us-ft", "epsg:2263+6360", 4326, 12, 12 * 3937 / 1200.0},
        {"ft", "EPSG:2263", 4326, 12, 12 / 0.3048}, // who says a unit means it
        {"m", "EPSG:2263", 4326, 12, 12},
        {NULL, "EPSG:2263", 4326, 12, 12 * 3937 / 1200.0}, // else it is the system's
        {"us-ft", "EPSG:2263", 32618, 12, 12 * 3937 / 1200.0},
        {"us-ft", "EPSG:2263", 2263, 12, 12},
        {"m", "EPSG:2263", 2263, 12, 12 * 1200.0 / 3937},
    };
    for (size_t i = 0; i < sizeof rows / sizeof *rows; i++) {
        struct spl_places_hook hook;
        struct spl_places *places = open(rows[i].unit, rows[i].crs, &hook, true);
        struct spl_error err = {0};
        double in[3] = {-74, 40.7, rows[i].in}, out[3], back[3];
        if (rows[i].asked != 4326)
            assert_int_equal(
                spl_places_prepare(places, rows[i].asked, &err) ||
                    spl_places_from_world(places, rows[i].asked, true, (double[3]){984250, 194305, 0}, in, &err),
                0);
        in[2] = rows[i].in;
        assert_int_equal(ask(&hook, rows[i].asked, in, out, &err), 0);
        if (fabs(out[2] / rows[i].world - 1) > 1e-9 || fabs(out[0] - 984250) > 0.01 || fabs(out[1] - 194305) > 1)
            fail_msg("row %zu: %.17g %.17g %.17g", i, out[0], out[1], out[2]);
        assert_int_equal(spl_places_from_world(places, rows[i].asked, false, out, back, &err), 0);
        assert_true(fabs(back[0] - in[0]) < 1e-6 && fabs(back[1] - in[1]) < 1e-6 && fabs(back[2] - in[2]) < 1e-9);
        spl_places_destroy(places);
    }
}

static void only_codes_and_plain_wkt_are_read(void **state)
{
    (void)state;
    const struct {
        const char *crs, *why;
    } rows[] = {
        {NULL, "does not say"},
        {"", "does not say"},
        {"+proj=utm +zone=18", "neither EPSG:N nor WKT"},
        {"/etc/passwd", "neither EPSG:N nor WKT"},
        {"EPSG:2263+", "neither EPSG:N nor WKT"},
        {"EPSG:2263 ", "neither EPSG:N nor WKT"},
        {"EPSG:1234567", "neither EPSG:N nor WKT"},
        {"ESRI:102718", "neither EPSG:N nor WKT"},
        {"GEOGCS[\"@/etc/passwd\"]", "extensions, grids or files"},
        {"PROJCS[\"x\",extension[\"PROJ4\",\"\"]]", "extensions, grids or files"},
        {"BOUNDCRS[x,PARAMETERFILE[\"a\",\"/etc/passwd\"]]", "extensions, grids or files"},
        {"CONVERSION[METHOD[\"PROJ-based operation method\"]]", "extensions, grids or files"},
        {"EPSG:999999", "is none that PROJ knows"},
        {"EPSG:5703", "is none that PROJ knows"},
        {"GEOGCS[", "is none that PROJ knows"},
    };
    for (size_t i = 0; i < sizeof rows / sizeof *rows; i++) {
        struct spl_places_hook hook;
        struct spl_places *places = open("m", rows[i].crs, &hook, true);
        struct spl_error err;
        double out[3];
        assert_int_equal(ask(&hook, 4326, degrees, out, &err), SPL_E_INPUT);
        assert_string_equal(err.field, "crs");
        if (!strstr(err.message, rows[i].why))
            fail_msg("%s: %s", rows[i].crs ? rows[i].crs : "nothing", err.message);
        spl_places_destroy(places);
    }
}

static void who_may_not_wait_is_told_what_is_missing(void **state)
{
    (void)state;
    struct spl_places_hook at_once, patient;
    struct spl_places *places = open("us-ft", "EPSG:2263", &at_once, false);
    struct spl_error err;
    double out[3];
    assert_int_equal(ask(&at_once, 4269, degrees, out, &err), SPL_E_BUSY);
    assert_int_equal(spl_places_get_missing(places), 4269);
    assert_int_equal(spl_places_prepare(places, 4269, &err), 0);
    assert_int_equal(ask(&at_once, 4269, degrees, out, &err), 0);
    assert_true(fabs(out[0] - 984250) < 0.01);
    // another dataset's system is another one, though the same was asked for
    spl_places_destroy(places);
    places = open("m", "EPSG:32618", &at_once, false);
    assert_int_equal(ask(&at_once, 4269, degrees, out, &err), SPL_E_BUSY);
    spl_places_hook_init(&patient, places, true);
    assert_int_equal(ask(&patient, 4269, NULL, NULL, &err), 0);
    assert_int_equal(spl_places_from_world(places, 4269, false, (double[3]){500000, 194305, 0}, out, &err), 0);
    assert_true(fabs(out[0] + 75) < 1e-9 && fabs(out[1] - 1.758) < 0.01);
    assert_int_equal(spl_places_from_world(places, 4269, false, (double[3]){500000, 4500000, 0}, out, &err),
                     SPL_E_INPUT);
    assert_string_equal(err.field, "world"); // 4306 km from the dataset
    // one request makes a few
    for (uint32_t zone = 0; zone < 3; zone++)
        assert_int_equal(ask(&patient, 26916 + zone, NULL, NULL, &err), 0);
    assert_int_equal(ask(&patient, 26920, NULL, NULL, &err), SPL_E_INPUT);
    assert_int_equal(ask(&patient, 26918, NULL, NULL, &err), 0); // what is there is free
    spl_places_destroy(places);
}

static void points_out_of_reach_are_refused_by_name(void **state)
{
    (void)state;
    struct spl_places_hook hook;
    struct spl_places *places = open("us-ft", "EPSG:2263", &hook, true);
    static const double far[][3] = {{40.7, -74, 10},   {10, 50, 10},        {-74, 140, 0},
                                    {-74, 40.7, 1e12}, {-74, 40.7, -1e300}, {1e300, 40.7, 0}};
    for (size_t i = 0; i < sizeof far / sizeof *far; i++) {
        struct spl_error err;
        double out[3];
        assert_int_equal(ask(&hook, 4326, far[i], out, &err), SPL_E_INPUT);
        assert_string_equal(err.field, "eye");
    }
    spl_places_destroy(places);
}

static void many_systems_push_the_oldest_out(void **state)
{
    (void)state;
    struct spl_places_hook hook;
    struct spl_places *places = open("us-ft", "EPSG:2263", &hook, false);
    struct spl_error err = {0};
    double out[3];
    assert_int_equal(spl_places_prepare(places, 4326, &err), 0);
    for (uint32_t zone = 1; zone <= 60; zone++) {
        assert_int_equal(spl_places_prepare(places, 32600 + zone, &err), 0);
        assert_int_equal(spl_places_prepare(places, 32700 + zone, &err), 0);
        assert_int_equal(ask(&hook, 4326, degrees, out, &err), 0); // in use, so it stays
    }
    assert_int_equal(ask(&hook, 32601, NULL, NULL, &err), SPL_E_BUSY);
    assert_int_equal(ask(&hook, 32760, NULL, NULL, &err), 0);
    spl_places_destroy(places);
}

int main(void)
{
    if (!spl_transform_is_built) {
        printf("skipped: built without PROJ\n");
        return 77;
    }
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(heights_are_in_the_units_of_both),
        cmocka_unit_test(only_codes_and_plain_wkt_are_read),
        cmocka_unit_test(who_may_not_wait_is_told_what_is_missing),
        cmocka_unit_test(points_out_of_reach_are_refused_by_name),
        cmocka_unit_test(many_systems_push_the_oldest_out),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
