/* What changes along a tour beside its camera: read from keyframes, straight between those that say it, put into
 * views. */
#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include <cmocka.h>

#include "service/tour/fade.h"
#include "service/tour/spec.h"

#define KEY(x, rest) "{\"camera\":{\"eye\":[" #x ",0,0],\"target\":[" #x ",1,0]}" rest "}"

static const char *soft = ",\"soft\":\"u>1\""; /* of the settings */

static int read_spec(const char *path, const char *rest, struct spl_tour_spec *spec, struct spl_error *err)
{
    static const struct spl_camera_defaults defaults = {
        .eye = {10, 0, 0}, .up = {0, 0, 1}, .fov = 60, .near = 0.01, .far = INFINITY};
    static const struct spl_tour_limits limits = {
        {.side_px = 4096, .pixels = 4 << 20}, .frames = 500, .pixels = 100 << 20};
    char body[4096];
    snprintf(body, sizeof body, "{\"path\":%s,\"settings\":{\"width\":16,\"height\":16%s}%s}", path, soft, rest);
    *err = (struct spl_error){0};
    return spl_tour_spec_from_text(body, strlen(body), &defaults, &limits, spec, err);
}

/* `wanted` are soft_opacity of each frame; NAN ends it, and is what nobody says. */
static void expect(const char *path, const char *rest, const double *wanted)
{
    struct spl_tour_spec spec;
    struct spl_error err;
    if (read_spec(path, rest, &spec, &err))
        fail_msg("%s: %s", path, err.message);
    for (size_t i = 0; i < spec.frames; i++) {
        struct spl_view view = spec.view.view;
        if (spec.fades)
            spl_fade_apply(spec.fades[i], &view);
        assert_int_equal(spl_view_check(&view, NULL), 0);
        if (!(fabs(view.soft.opacity - wanted[i]) < 1e-12))
            fail_msg("%s: frame %zu has %.17g, not %g", path, i, view.soft.opacity, wanted[i]);
    }
    spl_tour_spec_finish(&spec);
}

static void opacity_goes_straight_between_keys(void **state)
{
    (void)state;
    expect("{\"keyframes\":[" KEY(0, ",\"soft_opacity\":1") "," KEY(4, ",\"soft_opacity\":0") "]}", ",\"frames\":5",
           (double[]){1, 0.75, 0.5, 0.25, 0});
    expect("{\"keyframes\":[" KEY(0, ",\"soft_opacity\":1,\"time\":0") "," KEY(4, ",\"time\":1") ","
           KEY(5, ",\"time\":4,\"soft_opacity\":0") "]}", ",\"frames\":5", (double[]){1, 0.75, 0.5, 0.25, 0});
}

static void it_stays_before_the_first_and_behind_the_last(void **state)
{
    (void)state;
    expect("{\"keyframes\":[" KEY(0, "") "," KEY(1, ",\"soft_opacity\":0.8") "," KEY(2, ",\"soft_opacity\":0.4") ","
           KEY(3, "") "]}", ",\"frames\":7,\"interpolation\":{\"positions\":\"uniform\"}",
           (double[]){0.8, 0.8, 0.8, 0.6, 0.4, 0.4, 0.4});
    expect("{\"keyframes\":[" KEY(0, "") "," KEY(1, ",\"soft_opacity\":0.8") "]}", ",\"frames\":3",
           (double[]){0.8, 0.8, 0.8});
}

static void a_closed_path_goes_back_to_the_first(void **state)
{
    (void)state;
    expect("{\"keyframes\":[" KEY(0, ",\"soft_opacity\":1") "," KEY(1, ",\"soft_opacity\":0") "],\"closed\":true}",
           ",\"frames\":4,\"interpolation\":{\"positions\":\"uniform\"}", (double[]){1, 0.5, 0, 0.5});
    expect("{\"keyframes\":[" KEY(0, "") "," KEY(1, ",\"soft_opacity\":0") "," KEY(2, ",\"soft_opacity\":0.6") "," KEY(
               3, "") "],\"closed\":true}",
           ",\"frames\":4,\"interpolation\":{\"positions\":\"uniform\"}", (double[]){0.2, 0, 0.6, 0.4});
}

static void frames_of_a_whole_path_have_their_own(void **state)
{
    (void)state;
    expect("{\"frames\":[" KEY(0, ",\"soft_opacity\":1") "," KEY(9, ",\"soft_opacity\":0.5") "," KEY(
               10, ",\"soft_opacity\":0") "]}",
           "", (double[]){1, 0.5, 0});
    expect("{\"keyframes\":[" KEY(0, ",\"soft_opacity\":0.5") "]}", ",\"frames\":2", (double[]){0.5, 0.5});
}

static void what_no_key_says_is_of_the_settings(void **state)
{
    (void)state;
    struct spl_tour_spec spec;
    struct spl_error err;
    expect("{\"keyframes\":[" KEY(0, "") "," KEY(1, "") "]}", ",\"frames\":2", (double[]){0.3, 0.3});
    expect("{\"keyframes\":[" KEY(0, ",\"soft_blend\":2") "," KEY(1, "") "]}", ",\"frames\":2", (double[]){0.3, 0.3});
    assert_int_equal(read_spec("{\"keyframes\":[" KEY(0, ",\"soft_blend\":2,\"soft_cover\":1") "," KEY(
                                   1, ",\"soft_blend\":4,\"soft_cover\":0.5") "]}",
                               ",\"frames\":3", &spec, &err),
                     0);
    struct spl_view view = spec.view.view;
    spl_fade_apply(spec.fades[1], &view);
    assert_true(view.soft.blend == 3 && view.soft.cover == 0.75 && view.soft.opacity == 0.3 &&
                view.soft.what.count == 1);
    spl_tour_spec_finish(&spec);
}

static void what_is_out_of_range_is_named(void **state)
{
    (void)state;
    static const struct {
        const char *path, *field, *says;
    } wrong[] = {
        {"{\"keyframes\":[" KEY(0, "") "," KEY(1, ",\"soft_opacity\":1.5") "]}", "keyframes[1].soft_opacity", "1.5"},
        {"{\"keyframes\":[" KEY(0, ",\"soft_opacity\":-1") "]}", "keyframes[0].soft_opacity", "-1"},
        {"{\"keyframes\":[" KEY(0, ",\"soft_opacity\":\"1\"") "]}", "keyframes[0].soft_opacity", "not text"},
        {"{\"keyframes\":[" KEY(0, ",\"soft_cover\":1.5") "]}", "keyframes[0].soft_cover", "1.5"},
        {"{\"keyframes\":[" KEY(0, ",\"soft_blend\":null") "]}", "keyframes[0].soft_blend", "not null"},
        {"{\"keyframes\":[" KEY(0, ",\"soft_blend\":1e10") "]}", "keyframes[0].soft_blend", "1e+10"},
        {"{\"keyframes\":[" KEY(0, ",\"soft\":\"u>1\"") "]}", "keyframes[0].soft", "unknown"},
    };
    for (size_t i = 0; i < sizeof wrong / sizeof *wrong; i++) {
        struct spl_tour_spec spec;
        struct spl_error err;
        if (read_spec(wrong[i].path, ",\"frames\":2", &spec, &err) != SPL_E_INPUT ||
            strcmp(err.field, wrong[i].field) || !strstr(err.message, wrong[i].says))
            fail_msg("%s: %s: %s", wrong[i].path, err.field, err.message);
    }
}

static void what_fades_has_to_be_somewhere(void **state)
{
    (void)state;
    struct spl_tour_spec spec;
    struct spl_error err;
    const char *some = soft;
    static const char fading[] = "{\"keyframes\":[" KEY(0, "") "," KEY(1, ",\"soft_cover\":1") "]}";
    soft = "";
    assert_int_equal(read_spec(fading, ",\"frames\":2", &spec, &err), SPL_E_INPUT);
    assert_string_equal(err.field, "settings.soft");
    soft = ",\"soft_opacity\":0.5"; /* as in a view: nothing of it counts */
    assert_int_equal(read_spec("{\"keyframes\":[" KEY(0, "") "]}", ",\"frames\":2", &spec, &err), 0);
    spl_tour_spec_finish(&spec);
    soft = some;
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(opacity_goes_straight_between_keys),
        cmocka_unit_test(it_stays_before_the_first_and_behind_the_last),
        cmocka_unit_test(a_closed_path_goes_back_to_the_first),
        cmocka_unit_test(frames_of_a_whole_path_have_their_own),
        cmocka_unit_test(what_no_key_says_is_of_the_settings),
        cmocka_unit_test(what_is_out_of_range_is_named),
        cmocka_unit_test(what_fades_has_to_be_somewhere),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
