/* PTX: stations with their poses, cells in world coordinates, cells that saw nothing, and every broken line by number.
 */
#include "cloud_test.h"

#include <math.h>

/* Station 1: turned by 90 degrees about z and moved; station 2: moved by UTM-sized amounts. */
#define STATION1 "2\n3\n10 20 30\n0 1 0\n-1 0 0\n0 0 1\n0 1 0 0\n-1 0 0 0\n0 0 1 0\n10 20 30 1\n"
#define STATION2                                                                                                       \
    "1\n2\n406000.5 7405000.25 -3\n1 0 0\n0 1 0\n0 0 1\n1 0 0 0\n0 1 0 0\n0 0 1 0\n406000.5 7405000.25 -3 1\n"
#define HEADER "1\n1\n0 0 0\n1 0 0\n0 1 0\n0 0 1\n1 0 0 0\n0 1 0 0\n0 0 1 0\n0 0 0 1\n"

static void stations_keep_their_poses(void **state)
{
    struct loaded l;
    (void)state;
    load_text(STATION1 "1 0 0 0.5 255 0 1\n0 0 0 0.5 0 0 0\n0 2 0 0.5 1 2 3\r\n0 0 3 0.5 4 5 6\n0 0 0 0.5 0 0 0\n"
                       "-1 -1 -1 1 7 8 9\n" STATION2 "0.125 0.25 0.5 0 10 20 30\n1 1 1 0 0 0 0\n\n\n",
              NULL, &l);
    assert_string_equal(l.format, "PTX");
    assert_int_equal(l.attributes, SPL_CLOUD_COLOR | SPL_CLOUD_STATION);
    assert_int_equal(l.points, 6);
    assert_int_equal(l.skipped, 2);
    assert_int_equal(l.station_count, 2);
    assert_point(&l, 0, 10, 21, 30); /* x of the scanner is y of the world */
    assert_point(&l, 1, 8, 20, 30);
    assert_point(&l, 2, 10, 20, 33);
    assert_point(&l, 3, 11, 19, 29);
    assert_point(&l, 4, 406000.625, 7405000.5, -2.5);
    assert_color(&l, 0, 255, 0, 1);
    assert_color(&l, 4, 10, 20, 30);
    for (size_t i = 0; i < 6; i++)
        assert_int_equal(l.first.station[i], i < 4 ? 0 : 1);
    static const double pose[16] = {0, -1, 0, 10, 1, 0, 0, 20, 0, 0, 1, 30, 0, 0, 0, 1};
    assert_memory_equal(l.station[0], pose, sizeof pose);
    assert_true(l.station[1][3] == 406000.5 && l.station[1][7] == 7405000.25 && l.station[1][15] == 1);
    loaded_finish(&l);
}

static void intensity_serves_where_no_colour_is(void **state)
{
    struct loaded l;
    (void)state;
    load_text(HEADER "1 2 3 0.5\n" HEADER "1 2 3 1.5\n" HEADER "1 2 3 0 9 8 7\n", NULL, &l);
    assert_int_equal(l.attributes, SPL_CLOUD_COLOR | SPL_CLOUD_STATION);
    assert_color(&l, 0, 128, 128, 128);
    assert_color(&l, 1, 255, 255, 255);
    assert_color(&l, 2, 9, 8, 7);
    loaded_finish(&l);
    load_text(HEADER "1 2 3\n", NULL, &l);
    assert_int_equal(l.attributes, SPL_CLOUD_STATION);
    loaded_finish(&l);
}

/* Intensities are 0 to 1, and colours there where there are fields for them: where the first cells say otherwise all of
 * them do. */
static void cells_that_keep_to_no_rule(void **state)
{
    static const struct {
        const char *text;
        int first, second; /* grey, or red where a colour has a second one */
        bool blank;
    } all[] = {
        {HEADER "1 2 3 0\n" HEADER "4 5 6 51\n" HEADER "7 8 9 255\n", 0, 51, false},
        {HEADER "1 2 3 -2048\n" HEADER "4 5 6 2047\n", 0, 255, false},
        {HEADER "0 0 0 4000\n" HEADER "1 2 3 0.25\n" HEADER "4 5 6 1\n", 64, 255, false}, /* of no point */
        {HEADER "1 2 3 0.5\n" HEADER "4 5 6 1.5\n", 128, 255, false},                     /* a glint */
        {HEADER "1 2 3 nan\n" HEADER "4 5 6 1\n", 0, 255, false},
        {HEADER "1 2 3 0.25 0 0 0\n" HEADER "4 5 6 1 0 0 0\n", 0, 255, true},
        {HEADER "1 2 3 0.25 0 0 0\n" HEADER "4 5 6 1 9 0 0\n", 0, 9, false},
        {HEADER "1 2 3 500 0 0 0\n" HEADER "4 5 6 900 9 0 0\n", 0, 9, false}, /* intensities make no colour there */
        {HEADER "1 2 3 500 0 0 0\n" HEADER "4 5 6 900\n", 0, 255, true},
    };
    struct loaded l;
    (void)state;
    for (size_t i = 0; i < sizeof all / sizeof *all; i++) {
        load_text(all[i].text, NULL, &l);
        if (l.first.color[0][0] != all[i].first || l.first.color[1][0] != all[i].second ||
            l.colors.blank != all[i].blank || !(l.attributes & SPL_CLOUD_COLOR))
            fail_msg("%zu: %d, %d", i, l.first.color[0][0], l.first.color[1][0]);
        loaded_finish(&l);
    }
}

static void odd_but_sound_files_load(void **state)
{
    struct loaded l;
    (void)state;
    load_text(HEADER "0 0 0 0.5\n", NULL, &l); /* a scan of the sky */
    assert_int_equal(l.points, 0);
    assert_int_equal(l.skipped, 1);
    loaded_finish(&l);
    load_text(HEADER "nan 0 0 0.5\n" HEADER "1 2 3 0.5", NULL, &l);
    assert_int_equal(l.points, 1);
    assert_int_equal(l.skipped, 1);
    loaded_finish(&l);
    load_text("0\n5\n0 0 0\n1 0 0\n0 1 0\n0 0 1\n1 0 0 0\n0 1 0 0\n0 0 1 0\n0 0 0 1\n" HEADER "1 2 3 1\n", NULL, &l);
    assert_int_equal(l.points, 1); /* a station without cells */
    assert_int_equal(l.station_count, 2);
    assert_int_equal(l.first.station[0], 1);
    assert_int_equal(l.attributes, SPL_CLOUD_COLOR | SPL_CLOUD_STATION);
    loaded_finish(&l);
}

static void many_stations_and_cells(void **state)
{
    static struct bytes b;
    struct loaded l;
    enum { stations = 40, cells = 7 };
    (void)state;
    b.length = 0;
    for (int s = 0; s < stations; s++) {
        put_text(&b, "1\n%d\n0 0 0\n1 0 0\n0 1 0\n0 0 1\n1 0 0 0\n0 1 0 0\n0 0 1 0\n%d 0 0 1\n", cells, 100 * s);
        for (int i = 0; i < cells; i++)
            put_text(&b, "%d 1 1 0.5\n", i);
    }
    load_bytes(&b, NULL, 11, &l);
    assert_int_equal(l.code, 0);
    assert_int_equal(l.points, stations * cells);
    assert_int_equal(l.station_count, stations);
    for (size_t i = 0; i < KEPT; i++) {
        assert_int_equal(l.first.station[i], i / cells);
        assert_point(&l, i, 100.0 * (double)(i / cells) + (double)(i % cells), 1, 1);
    }
    loaded_finish(&l);
}

static void broken_files_are_refused(void **state)
{
    (void)state;
    refused_text("1\n1\n", SPL_E_INPUT, "scanner position", "line 2");
    refused_text("1\n1\n0 0\n", SPL_E_INPUT, "scanner position", "line 3");
    refused_text("1\n1\n0 0 0\n1 0 0\n0 1 x\n", SPL_E_INPUT, "scanner axes", "line 5");
    refused_text("1\n1\n0 0 0\n1 0 0\n0 1 0\n0 0 1\n1 0 0 0\n0 1 0 0\n0 0 1 0 0\n", SPL_E_INPUT, "matrix", "line 9");
    refused_text("1\n1\n0 0 0\n1 0 0\n0 1 0\n0 0 1\n1 0 0 0\n0 1 0 0\n0 0 inf 0\n", SPL_E_INPUT, "matrix", "line 9");
    refused_text("1\n1\n0 0 0\n1 0 0\n0 1 0\n0 0 1\n1 0 0 5\n", SPL_E_INPUT, "matrix", "last column");
    refused_text("1\n1\n0 0 0\n1 0 0\n0 1 0\n0 0 1\n1 0 0 0\n1 0 0 0\n0 0 1 0\n0 0 0 1\n1 2 3 0\n", SPL_E_INPUT,
                 "matrix", "singular");
    refused_text("4000000000\n4000000000\n0 0 0\n1 0 0\n0 1 0\n0 0 1\n1 0 0 0\n0 1 0 0\n0 0 1 0\n0 0 0 1\n1 2 3 0\n",
                 SPL_E_INPUT, "columns, rows", "4000000000 x 4000000000");
    refused_text("99999999999\n1\n", SPL_E_INPUT, "columns", "not a count");
    refused_text("1\n1\n0 0 0\n1 0 0\n0 1 0\n0 0 1\n1 0 0 0\n0 1 0 0\n0 0 1 0\n0 0 0 1\n1 2 3 0\n1 2 3 0\n",
                 SPL_E_INPUT, "columns",
                 "line 12: columns: the next station's number of columns is due here, and there are 4 numbers");
    refused_text(HEADER "1 2\n", SPL_E_INPUT, "columns, rows", "truncated");
    refused_text(HEADER "1.25 2.25\n", SPL_E_INPUT, "", "2 values");
    refused_text(HEADER "1 2 3 4 5\n", SPL_E_INPUT, "", "line 11");
    refused_text(HEADER "1 2 3,4\n", SPL_E_INPUT, "z", "\"3,4\"");
    refused_text(HEADER "1 2 3 4\n1 2 3 4\n", SPL_E_INPUT, "columns", "line 12"); /* a cell too many */
    refused_text(HEADER "1 2 3 0.5\n" HEADER "1 2 3\n", SPL_E_INPUT, "", "do not mix");
    refused_text(HEADER "1 2 3 0.5 256 0 0\n", SPL_E_INPUT, "red", "line 11");
    refused_text(STATION2 "1.5 2.5 3.5 0.5\n1.5 2.5 3.5\n", SPL_E_INPUT, "intensity", "line 12");
    refused_text(STATION2 "1.5 2.5 3.5 0.5\n", SPL_E_INPUT, "", "1 of the station's 2 cells");
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(stations_keep_their_poses), cmocka_unit_test(intensity_serves_where_no_colour_is),
        cmocka_unit_test(odd_but_sound_files_load),  cmocka_unit_test(cells_that_keep_to_no_rule),
        cmocka_unit_test(many_stations_and_cells),   cmocka_unit_test(broken_files_are_refused),
    };
    return cmocka_run_group_tests(tests, NULL, remove_scratch);
}
