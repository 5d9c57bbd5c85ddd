/* What is soft, of a request: from queries, bodies, batches and picks, and shapes in other coordinate systems. */
#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <stdlib.h>
#include <string.h>

#include <cmocka.h>

#include "service/headers.h"
#include "service/request/request.h"

/* Moves points by 100 in EPSG:4326, which none may be beyond 1000 in. */
static int move(const struct spl_camera_places *places, uint32_t crs, const char *name, const double in[3],
                double out[3], struct spl_error *err)
{
    (void)places;
    if (crs != 4326)
        return spl_fail_field(err, SPL_E_BUSY, "crs", "not yet");
    for (int i = 0; in && i < 3; i++)
        out[i] = in[i] + 100;
    return in && in[0] > 1000 ? spl_fail_field(err, SPL_E_INPUT, name, "%s is too far", name) : 0;
}

static const struct spl_camera_places places = {move};
static const struct spl_camera_defaults defaults = {.eye = {10, 0, 0}, .up = {0, 0, 1}, .fov = 60, .near = 0.01,
                                                    .far = INFINITY, .places = &places};
static const struct spl_camera_limits limits = {.side_px = 8192, .pixels = 64 << 20};

static int ask(const char *text, struct spl_view_request *out, struct spl_error *err)
{
    size_t length = strlen(text);
    bool pick = text[0] == '@', body = text[pick] == '{';
    *err = (struct spl_error){0};
    return (body   ? pick ? spl_pick_request_from_json : spl_view_request_from_json
            : pick ? spl_pick_request_from_query
                   : spl_view_request_from_query)(text + pick, length - pick, &defaults, &limits, out, err);
}

static struct spl_soft_params soft_asked(const char *text)
{
    struct spl_view_request r;
    struct spl_error err;
    if (ask(text, &r, &err))
        fail_msg("%s: %s", text, err.message);
    return r.view.soft;
}

static void every_way_of_asking_means_the_same(void **state)
{
    (void)state;
    static const char *const ways[] = {
        "soft=class:3-5+or+uncertainty>q0.9&soft_model=base&soft_opacity=0.7&soft_cover=0.25&soft_blend=2",
        "soft=class:3..5&soft_opacity=0.7&soft_cover=0.25&soft=uncertainty%3Eq0.9&soft_model=base&soft_blend=2",
        "{\"soft\":[\"class:3-5\",\"uncertainty>q0.9\"],\"soft_model\":\"base\",\"soft_opacity\":0.7,\"soft_cover\":0."
        "25,\"soft_blend\":2}",
        "{\"soft\":\"class:3-5 or "
        "uncertainty>q0.9\",\"soft_model\":\"base\",\"soft_opacity\":0.7,\"soft_cover\":0.25,\"soft_blend\":2}",
        "@x=1&y=1&soft=class:3-5+or+uncertainty>q0.9&soft_model=base&soft_opacity=0.7&soft_cover=0.25&soft_blend=2",
        ("@{\"x\":1,\"y\":1,\"soft\":[\"class:3-5 or "
         "uncertainty>q0.9\"],\"soft_model\":\"base\",\"soft_opacity\":0.7,\"soft_cover\":0.25,"
         "\"soft_blend\":2}"),
    };
    for (size_t i = 0; i < sizeof ways / sizeof *ways; i++) {
        struct spl_soft_params soft = soft_asked(ways[i]);
        assert_int_equal(soft.what.count, 2);
        assert_true(soft.what.terms[0].least == 3 && soft.what.terms[0].most == 5);
        assert_string_equal(soft.what.terms[1].name, "uncertainty");
        assert_int_equal(soft.what.terms[1].measure, SPL_TERM_QUANTILE);
        assert_true(soft.model == SPL_SOFT_MODEL_BASE && soft.opacity == 0.7 && soft.cover == 0.25 && soft.blend == 2);
    }
}

static void nothing_is_soft_by_itself(void **state)
{
    (void)state;
    static const char *const ways[] = {"", "{}", "{\"soft\":[]}", "@x=1&y=1"};
    for (size_t i = 0; i < sizeof ways / sizeof *ways; i++) {
        struct spl_soft_params soft = soft_asked(ways[i]);
        assert_true(!soft.what.count && soft.model == SPL_SOFT_MODEL_EXPRESS && soft.opacity == 0.3 &&
                    soft.cover == 1 && !soft.blend);
    }
}

static void shapes_are_moved_into_the_world(void **state)
{
    (void)state;
    static const double axis[6] = {101, 102, 103, 0, 0, 1}, plane[6] = {104, 105, 106, 1, 0, 0};
    struct spl_view_request r;
    struct spl_error err;
    struct spl_soft_params soft =
        soft_asked("crs=EPSG:4326&eye=1,0,0&soft=axis:1,2,3,0,0,1<4&soft=class:2&soft=plane:4,5,6,1,0,0>0");
    assert_memory_equal(soft.what.terms[0].shape, axis, sizeof axis);
    assert_memory_equal(soft.what.terms[2].shape, plane, sizeof plane);
    assert_true(soft.what.terms[0].most == 4);
    soft = soft_asked("@{\"x\":1,\"y\":1,\"camera\":{\"crs\":\"EPSG:4326\"},\"soft\":\"axis:1,2,3,0,0,1<4\"}");
    assert_memory_equal(soft.what.terms[0].shape, axis, sizeof axis);
    soft = soft_asked("soft=box:1,2,3,4,5,6");
    assert_true(soft.what.terms[0].shape[0] == 1 && soft.what.terms[0].shape[5] == 6);
    assert_int_equal(ask("crs=EPSG:4326&soft=box:1,2,3,4,5,6", &r, &err), SPL_E_INPUT);
    assert_string_equal(err.field, "soft");
    assert_non_null(strstr(err.message, "EPSG:4326"));
    assert_int_equal(ask("crs=EPSG:4326&soft=axis:2000,2,3,0,0,1<4", &r, &err), SPL_E_INPUT);
    assert_string_equal(err.field, "soft");
    assert_int_equal(ask("crs=EPSG:1&soft=axis:1,2,3,0,0,1<4", &r, &err), SPL_E_BUSY);
    assert_string_equal(err.field, "crs");
}

static void a_batch_shares_its_terms_unless_a_view_has_its_own(void **state)
{
    (void)state;
    static const char body[] = "{\"soft\":[\"class:3\",\"class:5\"],\"soft_opacity\":0.5,\"views\":["
                               "{},{\"soft\":\"u>1\"},{\"soft\":[],\"soft_opacity\":0.1}]}",
                      wrong[] = "{\"views\":[{},{\"soft\":\"u\"}]}";
    struct spl_views_request batch;
    struct spl_error err = {0};
    assert_int_equal(spl_views_request_from_json(body, strlen(body), &defaults, &limits, &batch, &err), 0);
    assert_int_equal(batch.views[0].view.soft.what.count, 2);
    assert_true(batch.views[0].view.soft.what.terms[1].least == 5 && batch.views[0].view.soft.opacity == 0.5);
    assert_int_equal(batch.views[1].view.soft.what.count, 1);
    assert_string_equal(batch.views[1].view.soft.what.terms[0].name, "u");
    assert_int_equal(batch.views[2].view.soft.what.count, 0);
    assert_true(batch.views[2].view.soft.opacity == 0.1);
    spl_views_request_finish(&batch);
    assert_int_equal(spl_views_request_from_json(wrong, strlen(wrong), &defaults, &limits, &batch, &err), SPL_E_INPUT);
    assert_string_equal(err.field, "views[1].soft");
}

/* What comes back is a body that asks for the same. */
static void headers_say_what_a_body_would(void **state)
{
    (void)state;
    struct spl_view_request r;
    struct spl_error err;
    struct spl_headers headers;
    assert_int_equal(ask("soft=0.5<u+or+class:3-5&soft_opacity=0.1", &r, &err), 0);
    strcpy(r.encode.unit, "m");
    spl_headers_open(&headers);
    spl_headers_add_view(&headers, &r, NULL);
    assert_true(spl_headers_close(&headers));
    const char *at = headers.text;
    while (*at && strcmp(at, "Splatd-Soft") != 0)
        at += strlen(at) + 1;
    assert_true(*at);
    at += strlen(at) + 1;
    assert_string_equal(at, "{\"soft\":[\"u>0.5\",\"class:3..5\"],\"soft_model\":\"express\",\"soft_opacity\":0.1,"
                            "\"soft_cover\":1,\"soft_blend\":0,\"of\":\"solid\"}");
    struct spl_soft_params again = soft_asked(at);
    assert_memory_equal(again.what.terms, r.view.soft.what.terms, sizeof again.what.terms);
    free(headers.text);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(every_way_of_asking_means_the_same),
        cmocka_unit_test(nothing_is_soft_by_itself),
        cmocka_unit_test(shapes_are_moved_into_the_world),
        cmocka_unit_test(a_batch_shares_its_terms_unless_a_view_has_its_own),
        cmocka_unit_test(headers_say_what_a_body_would),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
