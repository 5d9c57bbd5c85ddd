/* What colours show and how they are shaded: what each form means, that what is printed reads as the same, what is
 * refused with which field, and what a palette says of values. */
#include <float.h>
#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include <cmocka.h>

#include <splatd/color.h>
#include <splatd/render.h>

#include "dataset/streams.h"
#include "render/paint.h"

static void test_shading_reads_and_prints(void **state)
{
    (void)state;
    static const struct {
        const char *text;
        uint32_t kinds;
        double azimuth, elevation;
    } cases[] = {{"auto", 0, 0, 0},
                 {"none", SPL_SHADE_NONE, 0, 0},
                 {"edl", SPL_SHADE_EDL, 0, 0},
                 {"edl+headlight", SPL_SHADE_EDL | SPL_SHADE_HEADLIGHT, 0, 0},
                 {"edl headlight", SPL_SHADE_EDL | SPL_SHADE_HEADLIGHT, 0, 0},
                 {"sun:120,-3.5", SPL_SHADE_SUN, 120, -3.5},
                 {"sun:-0,90+edl", SPL_SHADE_SUN | SPL_SHADE_EDL, 0, 90}};
    for (size_t i = 0; i < sizeof cases / sizeof *cases; i++) {
        struct spl_shade_params read = {.strength = 0.5, .radius = 2}, again = read;
        char text[100];
        assert_int_equal(spl_shade_parse(cases[i].text, &read, NULL), 0);
        assert_int_equal(read.kinds, cases[i].kinds);
        assert_true(read.sun[0] == cases[i].azimuth && read.sun[1] == cases[i].elevation && !signbit(read.sun[0]));
        assert_int_equal(spl_shade_check(&read, NULL), 0);
        assert_true((size_t)spl_shade_print(&read, text, sizeof text) == strlen(text));
        assert_int_equal(spl_shade_parse(text, &again, NULL), 0);
        assert_memory_equal(&again, &read, sizeof read);
    }
}

static void test_shading_that_is_none_is_refused(void **state)
{
    (void)state;
    static const char *const texts[] = {"", "glow", "edl+", "+edl", "edl+edl", "none+edl", "auto+edl", "sun", "sun:1",
                                        "sun:1,2,3", "sun:361,0", "sun:0,91", "sun:0,nan", "edl:1", "edl,headlight"};
    for (size_t i = 0; i < sizeof texts / sizeof *texts; i++) {
        struct spl_shade_params shade = {.kinds = 77};
        struct spl_error err = {0};
        if (spl_shade_parse(texts[i], &shade, &err) != SPL_E_INPUT)
            fail_msg("'%s' was taken", texts[i]);
        assert_string_equal(err.field, "shade");
        assert_non_null(strstr(err.message, texts[i]));
        assert_int_equal(shade.kinds, 77);
    }
    struct spl_error err = {0};
    assert_int_equal(spl_shade_check(&(struct spl_shade_params){.kinds = 3, .radius = 2}, &err), SPL_E_USAGE);
    err = (struct spl_error){0};
    assert_int_equal(spl_shade_check(&(struct spl_shade_params){.radius = 6}, &err), SPL_E_USAGE);
    assert_string_equal(err.field, "edl_radius");
    err = (struct spl_error){0};
    assert_int_equal(spl_shade_check(&(struct spl_shade_params){.radius = 1, .strength = NAN}, &err), SPL_E_USAGE);
    assert_string_equal(err.field, "edl_strength");
}

static uint32_t shade_for(const struct spl_shade_params *shade, const struct spl_color_params *color,
                          const struct spl_dataset_info *info)
{
    return spl_shade_for(&(struct spl_view){.shade = *shade, .color = *color}, info);
}

static void test_what_is_shaded_by_itself(void **state)
{
    (void)state;
    struct spl_dataset_info plain = {.has_color = false}, colored = {.has_color = true};
    struct spl_dataset_info grey = {.has_surface = true}, scan = {.has_color = true, .has_surface = true},
                            mapped = {.has_surface = true, .maps = 2};
    const struct spl_shade_params by_itself = {0}, none = {.kinds = SPL_SHADE_NONE},
                                  lit = {.kinds = SPL_SHADE_HEADLIGHT};
    static const struct {
        const char *color;
        bool even; /* shows no shape, though the dataset has colours */
        bool one;  /* nor though it shows its own colours, of which there are none */
    } rows[] = {{"rgb", false, true},     {"class", true, false},     {"rgb+class", false, false},
                {"flat:red", true, true}, {"height", false, false},   {"classy", false, false},
                {"normal", false, false}, {"intensity", false, false}};
    const uint32_t both = SPL_SHADE_EDL | SPL_SHADE_HEADLIGHT;
    for (size_t i = 0; i < sizeof rows / sizeof *rows; i++) {
        struct spl_color_params color = {0};
        assert_int_equal(spl_color_parse(rows[i].color, &color, NULL), SPL_OK);
        assert_int_equal(shade_for(&by_itself, &color, &plain), SPL_SHADE_EDL);
        assert_int_equal(shade_for(&by_itself, &color, &colored), rows[i].even ? SPL_SHADE_EDL : 0);
        assert_int_equal(shade_for(&by_itself, &color, &grey), rows[i].one ? both : SPL_SHADE_EDL);
        assert_int_equal(shade_for(&by_itself, &color, &scan),
                         rows[i].even && rows[i].one ? both : rows[i].even ? SPL_SHADE_EDL : 0);
        assert_int_equal(shade_for(&none, &color, &plain), 0);
        assert_int_equal(shade_for(&lit, &color, &plain), SPL_SHADE_HEADLIGHT);
        struct spl_view view = {.color = color, .method = SPL_METHOD_SPLAT};
        assert_int_equal(view.maps, SPL_MAPS_ON); // photographs are colours, where they are drawn
        assert_int_equal(spl_shade_for(&view, &mapped), !rows[i].one ? SPL_SHADE_EDL : rows[i].even ? both : 0);
        view.maps = SPL_MAPS_OFF;
        assert_int_equal(spl_shade_for(&view, &mapped), rows[i].one ? both : SPL_SHADE_EDL);
        view = (struct spl_view){.color = color, .method = SPL_METHOD_POINTS};
        assert_int_equal(spl_shade_for(&view, &mapped), rows[i].one ? both : SPL_SHADE_EDL);
    }
}

static void test_colors_read_and_print(void **state)
{
    (void)state;
    static const struct {
        const char *text;
        enum spl_color_by by;
        bool rgb;
        const char *name;
    } cases[] = {{"rgb", SPL_COLOR_BY_RGB, false, ""},
                 {"class", SPL_COLOR_BY_ATTRIBUTE, false, "class"},
                 {"rgb+intensity", SPL_COLOR_BY_ATTRIBUTE, true, "intensity"},
                 {"rgb intensity", SPL_COLOR_BY_ATTRIBUTE, true, "intensity"},
                 {"height", SPL_COLOR_BY_HEIGHT, false, ""},
                 {"normal", SPL_COLOR_BY_NORMAL, false, ""},
                 {"plane:1,2,3,0,-0.5,1e-3", SPL_COLOR_BY_PLANE, false, ""},
                 {"flat:ff8000", SPL_COLOR_BY_FLAT, false, ""}};
    for (size_t i = 0; i < sizeof cases / sizeof *cases; i++) {
        struct spl_color_params read = {0}, again = {0};
        char text[SPL_COLOR_TEXT_MAX];
        assert_int_equal(spl_color_parse(cases[i].text, &read, NULL), 0);
        assert_int_equal(read.by, cases[i].by);
        assert_int_equal(read.rgb, cases[i].rgb);
        assert_string_equal(read.name, cases[i].name);
        assert_int_equal(spl_color_check(&read, NULL), 0);
        assert_true((size_t)spl_color_print(&read, text, sizeof text) == strlen(text));
        assert_int_equal(spl_color_parse(text, &again, NULL), 0);
        assert_memory_equal(&again, &read, sizeof read);
    }
    static const char *const texts[] = {"", "rgb+", "rgb+rgb+x", "9lives", "a-b", "plane:1,2,3", "plane:1,2,3,0,0,0",
                                        "plane:1,2,3,0,0,1,", "flat:", "flat:chartroose",
                                        "a_name_of_more_than_31_characters"};
    for (size_t i = 0; i < sizeof texts / sizeof *texts; i++) {
        struct spl_color_params color = {.by = SPL_COLOR_BY_NORMAL};
        struct spl_error err = {0};
        if (spl_color_parse(texts[i], &color, &err) != SPL_E_INPUT)
            fail_msg("'%s' was taken", texts[i]);
        assert_string_equal(err.field, "color_by");
        assert_int_equal(color.by, SPL_COLOR_BY_NORMAL);
    }
}

static void test_ranges_read(void **state)
{
    (void)state;
    static const struct {
        const char *text;
        double low, high;
        bool shares[2];
    } cases[] = {{"0..200", 0, 200, {0}},          {"-1.5..2.5", -1.5, 2.5, {0}}, {"1...5", 0, 0, {0}},
                 {"q0.02..q0.98", 0.02, 0.98, {true, true}}, {"0..q1", 0, 1, {false, true}}, {"5..5", 5, 5, {0}}};
    for (size_t i = 0; i < sizeof cases / sizeof *cases; i++) {
        struct spl_color_params color = {.by = SPL_COLOR_BY_HEIGHT};
        int rc = spl_color_parse_range(cases[i].text, &color, NULL);
        if (i == 2) { /* 1., then .5: its ends fall */
            assert_int_equal(rc, SPL_E_INPUT);
            continue;
        }
        assert_int_equal(rc, 0);
        assert_true(color.has_range && color.range[0] == cases[i].low && color.range[1] == cases[i].high);
        assert_memory_equal(color.shares, cases[i].shares, sizeof color.shares);
    }
    static const char *const texts[] = {"", "5", "5..", "..5", "a..b", "2..1", "q0..q2", "q-1..5", "0..inf", "1..2..3"};
    for (size_t i = 0; i < sizeof texts / sizeof *texts; i++) {
        struct spl_color_params color = {0};
        struct spl_error err = {0};
        if (spl_color_parse_range(texts[i], &color, &err) != SPL_E_INPUT)
            fail_msg("'%s' was taken", texts[i]);
        assert_string_equal(err.field, "range");
        assert_false(color.has_range);
    }
    struct spl_error err = {0};
    const struct spl_color_params forged = {.by = SPL_COLOR_BY_HEIGHT, .has_range = true, .range = {0, NAN}};
    assert_int_equal(spl_color_check(&forged, &err), SPL_E_USAGE);
    assert_string_equal(err.field, "range");
}

static float float_at(const uint32_t *words, int at)
{
    float value;
    memcpy(&value, &words[at], sizeof value);
    return value;
}

static struct spl_dataset_info attributes(void)
{
    static struct spl_stream_values values[2] = {{.count = 100}, {0}};
    for (int i = 0; i <= SPL_VALUES_QUANTILES; i++)
        values[0].quantiles[i] = 1000.0 * i / SPL_VALUES_QUANTILES;
    values[0].p99 = 990;
    struct spl_dataset_info info = {.id = "made", .stream_count = 2, .has_surface = true, .stream_values = values,
                                    .bounds_min = {-1, -1, 10}, .bounds_max = {1, 1, 20}};
    snprintf(info.streams[0].name, sizeof info.streams[0].name, "intensity");
    snprintf(info.streams[0].type, sizeof info.streams[0].type, "steps");
    snprintf(info.streams[1].name, sizeof info.streams[1].name, "class");
    snprintf(info.streams[1].type, sizeof info.streams[1].type, "uint");
    return info;
}

static void test_values_find_their_place(void **state)
{
    (void)state;
    const struct spl_dataset_info info = attributes();
    const struct spl_stream streams[2] = {{.first = -500, .steps_a_unit = 10}, {.steps_a_unit = 1}};
    struct spl_camera camera = {.eye = {0, 0, 12}, .rotation = {1, 0, 0, 0, 0, -1, 0, 1, 0}};
    struct spl_color_params color = {.by = SPL_COLOR_BY_ATTRIBUTE, .name = "intensity"};
    struct spl_paint paint;
    uint32_t words[SPL_PALETTE_WORDS];
    assert_int_equal(spl_paint_init(&paint, &color, &info, NULL), 0);
    assert_int_equal(paint.kind, SPL_PAINT_NUMBERS);
    assert_true(fabs(paint.low - 20) < 1e-9 && fabs(paint.high - 980) < 10);
    color.has_range = true;
    color.range[0] = 12.34;
    color.range[1] = 112.34;
    assert_int_equal(spl_paint_init(&paint, &color, &info, NULL), 0);
    spl_paint_set_stream(&paint, streams);
    spl_paint_see(&paint, &camera, words);
    for (uint32_t number = 500; number < 2000; number++) { /* as the kernel does, against the values themselves */
        const double value = (number + streams[0].first) / 10, place = (value - 12.34) / 100 * 256;
        const uint32_t low = words[SPL_PALETTE_LOW];
        const float past = number > low ? (float)((number - low) >> words[SPL_PALETTE_SHIFT]) : 0;
        const double got = number < low ? 0 : (double)past * (double)float_at(words, SPL_PALETTE_SCALE) +
                                                  (double)float_at(words, SPL_PALETTE_OFFSET);
        assert_true(number < low ? place < 0.3 : fabs(got - place) < 1e-3);
    }
    color = (struct spl_color_params){.by = SPL_COLOR_BY_HEIGHT};
    assert_int_equal(spl_paint_init(&paint, &color, &info, NULL), 0);
    assert_true(paint.low == 10 && paint.high == 20);
    spl_paint_see(&paint, &camera, words);
    /* 3 up from an eye at 12 is y = -3 of a camera that looks along y: 15, in the middle */
    const double place =
        -3.0 * (double)float_at(words, SPL_PALETTE_AXIS + 1) * (double)float_at(words, SPL_PALETTE_SCALE) +
        (double)float_at(words, SPL_PALETTE_OFFSET);
    assert_true(fabs(place - 128) < 1e-3);
    static const double wide[2][2] = {{-1e308, 1e308}, {DBL_MAX, DBL_MAX}}; /* of a width beyond numbers */
    for (int i = 0; i < 2; i++) {
        struct spl_error err = {0};
        color =
            (struct spl_color_params){.by = SPL_COLOR_BY_HEIGHT, .has_range = true, .range = {wide[i][0], wide[i][1]}};
        assert_int_equal(spl_paint_init(&paint, &color, &info, &err), SPL_E_INPUT);
        assert_string_equal(err.field, "range");
    }
    color = (struct spl_color_params){.by = SPL_COLOR_BY_ATTRIBUTE, .name = "class"};
    assert_int_equal(spl_paint_init(&paint, &color, &info, NULL), 0);
    assert_true(paint.classes && paint.colors[2] == 0x0055aa && paint.colors[5] == 0x00aa00);
}

/* Of heights the ends are the dataset's, but for strays; shares of them are known where the dataset says them. */
static void test_strays_do_not_take_the_colours_of_heights(void **state)
{
    (void)state;
    struct spl_dataset_info info = attributes();
    struct spl_stream_values heights = {.count = 100, .p99 = 19.9};
    struct spl_color_params color = {.by = SPL_COLOR_BY_HEIGHT};
    struct spl_paint paint;
    for (int i = 0; i <= SPL_VALUES_QUANTILES; i++)
        heights.quantiles[i] = 10 + 10.0 * i / SPL_VALUES_QUANTILES;
    info.heights = &heights;
    assert_int_equal(spl_paint_init(&paint, &color, &info, NULL), 0);
    assert_true(paint.low == 10 && paint.high == 20); /* all of them */
    heights.quantiles[0] = info.bounds_min[2] = -1000; /* an echo from below, and a bird */
    heights.quantiles[SPL_VALUES_QUANTILES] = info.bounds_max[2] = 20.5;
    assert_int_equal(spl_paint_init(&paint, &color, &info, NULL), 0);
    assert_true(paint.low > -1000 && paint.low < 10 && paint.high == 20.5);
    color = (struct spl_color_params){
        .by = SPL_COLOR_BY_HEIGHT, .has_range = true, .range = {0.25, 0.75}, .shares = {true, true}};
    assert_int_equal(spl_paint_init(&paint, &color, &info, NULL), 0);
    assert_true(fabs(paint.low - 12.5) < 1e-9 && fabs(paint.high - 17.5) < 1e-9);
}

static void test_what_a_dataset_lacks_is_refused(void **state)
{
    (void)state;
    struct spl_dataset_info info = attributes();
    static const struct {
        struct spl_color_params color;
        const char *field, *says;
    } cases[] = {
        {{.by = SPL_COLOR_BY_ATTRIBUTE, .name = "smell"}, "color_by", "it has intensity, class"},
        {{.by = SPL_COLOR_BY_ATTRIBUTE, .name = "class", .ramp = SPL_RAMP_GREY}, "range", "give a range"},
        {{.by = SPL_COLOR_BY_HEIGHT, .has_range = true, .range = {0, 1}, .shares = {true, true}}, "range",
         "values of 'height'"},
        {{.by = SPL_COLOR_BY_PLANE, .plane = {0, 0, 0, 0, 0, 1}, .has_range = true, .range = {0, 1},
          .shares = {true, true}},
         "range", "give values"},
        {{.by = SPL_COLOR_BY_ATTRIBUTE, .name = "intensity", .has_range = true, .range = {950, 0.5},
          .shares = {false, true}},
         "range", "950"},
        {{.by = SPL_COLOR_BY_NORMAL}, "color_by", "--points-only"},
    };
    info.has_surface = false;
    for (size_t i = 0; i < sizeof cases / sizeof *cases; i++) {
        struct spl_paint paint;
        struct spl_error err = {0};
        assert_int_equal(spl_paint_init(&paint, &cases[i].color, &info, &err), SPL_E_INPUT);
        assert_string_equal(err.field, cases[i].field);
        assert_non_null(strstr(err.message, cases[i].says));
    }
}

static void test_ramps_begin_and_end_as_known(void **state)
{
    (void)state;
    static const uint8_t ends[SPL_RAMP_COUNT][2][3] = {
        [SPL_RAMP_VIRIDIS] = {{68, 1, 84}, {253, 231, 37}}, [SPL_RAMP_TURBO] = {{48, 18, 59}, {122, 4, 3}},
        [SPL_RAMP_GREY] = {{0, 0, 0}, {255, 255, 255}}, [SPL_RAMP_TERRAIN] = {{51, 51, 153}, {255, 255, 255}}};
    for (int ramp = SPL_RAMP_VIRIDIS; ramp < SPL_RAMP_COUNT; ramp++) {
        assert_int_equal(spl_ramp_from_name(spl_ramp_name((enum spl_ramp)ramp)), ramp);
        for (int end = 0; end < 2; end++) {
            uint8_t rgb[3];
            spl_ramp_get((enum spl_ramp)ramp, end, rgb);
            for (int c = 0; c < 3; c++)
                if (abs(rgb[c] - ends[ramp][end][c]) > (ramp == SPL_RAMP_TURBO ? 32 : 4))
                    fail_msg("%s ends in %u at %d, not %u", spl_ramp_name((enum spl_ramp)ramp), rgb[c], end,
                             ends[ramp][end][c]);
        }
    }
    assert_int_equal(spl_ramp_from_name("jet"), -1);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_shading_reads_and_prints),
        cmocka_unit_test(test_shading_that_is_none_is_refused),
        cmocka_unit_test(test_what_is_shaded_by_itself),
        cmocka_unit_test(test_colors_read_and_print),
        cmocka_unit_test(test_ranges_read),
        cmocka_unit_test(test_values_find_their_place),
        cmocka_unit_test(test_strays_do_not_take_the_colours_of_heights),
        cmocka_unit_test(test_what_a_dataset_lacks_is_refused),
        cmocka_unit_test(test_ramps_begin_and_end_as_known),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
