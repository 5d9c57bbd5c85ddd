/* Clips against boxes, by brute force: what is said of a box holds of each of its points, and what is left open is
 * decided for each point by the words that kernels get, as a plain evaluator in doubles decides it. Random conditions
 * of shapes of every kind; polygons; what is refused. */
#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <stdio.h>
#include <string.h>
#include <cmocka.h>

#include "base/error.h"
#include "render/marks.h"
#include "render/terms.h"
#include "support/reference_marks.h"

static uint64_t random_state = 1;

static double uniform(void)
{
    random_state = random_state * 6364136223846793005u + 1442695040888963407u;
    return (double)(random_state >> 11) / 9007199254740992.0;
}

static double around(double reach)
{
    return reach * (2 * uniform() - 1);
}

static void add_polygon(struct spl_terms *terms, struct spl_term *term)
{
    const uint32_t corners = 3 + (uint32_t)(4 * uniform());
    const double x = around(1), y = around(1);
    term->first_corner = terms->corner_count;
    term->corners = corners;
    for (uint32_t i = 0; i < corners; i++) { /* star-shaped: it crosses nothing */
        const double r = 0.3 + 1.5 * uniform(), angle = (i + 0.8 * uniform()) * 2 * acos(-1) / corners;
        terms->corners[terms->corner_count][0] = 1000 + x + r * cos(angle);
        terms->corners[terms->corner_count++][1] = y + r * sin(angle);
    }
    const bool high = uniform() < 0.5;
    term->shape[0] = high ? around(1) : -INFINITY;
    term->shape[1] = high ? term->shape[0] + 0.1 + uniform() : INFINITY;
}

static struct spl_terms random_terms(void)
{
    struct spl_terms terms = {.count = 1 + (uint32_t)(6 * uniform())};
    for (uint32_t t = 0; t < terms.count; t++) {
        struct spl_term *term = &terms.terms[t];
        term->measure = SPL_TERM_AXIS + (enum spl_term_measure)(5 * uniform());
        term->least = uniform() < 0.5 ? -INFINITY : around(1);
        term->most = term->least > -INFINITY ? term->least + uniform() : uniform() < 0.8 ? around(1) : INFINITY;
        term->with_least = uniform() < 0.5;
        term->with_most = uniform() < 0.5;
        term->joint = (enum spl_term_joint)(3 * uniform());
        term->outside = t && term->joint == SPL_TERM_ITEM ? terms.terms[t - 1].outside : uniform() < 0.3;
        for (int i = 0; i < 3; i++) {
            term->shape[i] = (i ? 0 : 1000) + around(1);
            term->shape[3 + i] = term->measure == SPL_TERM_BOX ? term->shape[i] + 0.1 + uniform() : around(1);
            term->shape[6 + i] = term->measure == SPL_TERM_BOX && uniform() < 0.5 ? around(180) : 0;
        }
        if (term->measure == SPL_TERM_COORDINATE) {
            const int axis = (int)(3 * uniform());
            memset(term->shape, 0, sizeof term->shape);
            term->shape[3 + axis] = 1;
            term->least += axis ? 0 : 1000;
            term->most += axis ? 0 : 1000;
        }
        if (term->measure == SPL_TERM_POLYGON)
            add_polygon(&terms, term);
    }
    return terms;
}

static void test_what_is_said_of_a_box_holds_of_its_points(void **state)
{
    enum { rounds = 3000, points = 12 };
    (void)state;
    const struct spl_dataset_info info = {.id = "made"};
    struct spl_camera camera = {.eye = {997, -2, 1}, .width = 64, .height = 64, .fx = 50, .fy = 50, .cx = 32, .cy = 32};
    assert_int_equal(spl_camera_look_at(&camera, camera.eye, (double[3]){1000, 0.3, 0}, (double[3]){0, 0, 1}, NULL), 0);
    struct spl_chunk discs = {.count = 1};
    const struct spl_tables tables = {.chunks = &discs, .chunk_count = 1};
    size_t dropped = 0, kept = 0, open = 0, differ = 0;
    for (int round = 0; round < rounds; round++) {
        const struct spl_terms terms = random_terms();
        struct spl_marks clip = {.count = terms.count};
        struct spl_marks_view view;
        struct spl_clip_chunk judged;
        struct spl_error err = {0};
        uint32_t words[SPL_MARKS_SHAPES_MAX + SPL_CLIP_CUT_WORDS];
        if (spl_terms_check(&terms, "soft", &err))
            fail_msg("%s", err.message);
        /* as spl_marks_init_clip(), which needs a dataset */
        const struct spl_soft_params soft = {.what = terms};
        assert_int_equal(spl_marks_resolve(&soft, &info, clip.terms, &err), SPL_OK);
        memcpy(clip.corners, terms.corners, sizeof clip.corners);
        const uint32_t used = spl_marks_see(&clip, &camera, 0, &view, words);
        const double size = round % 3 ? 0.4 * uniform() : 2;
        struct spl_view_box box = {{around(1.5), around(1.5), 3 + around(1.5)}, {size, size * uniform(), size}};
        spl_clip_judge(&clip, &view, &tables, 0, &box, &judged);
        assert_int_equal(judged.by_value, 0);
        if (spl_clip_drops_box(&clip, &view, &box) != judged.dropped)
            fail_msg("round %d: a node is judged otherwise", round);
        spl_clip_write_cut(&clip, &view, judged.cut, words + used);
        dropped += judged.dropped;
        kept += !judged.dropped && !judged.cut;
        open += !judged.dropped && judged.cut;
        for (int p = 0; p < points; p++) {
            double world[3];
            float at[3];
            for (int i = 0; i < 3; i++)
                at[i] = (float)(box.center[i] + around(box.half[i]));
            for (int a = 0; a < 3; a++) {
                world[a] = camera.eye[a];
                for (int i = 0; i < 3; i++)
                    world[a] += camera.rotation[3 * i + a] * (double)at[i];
            }
            const bool want = reference_is_drawn(NULL, &terms, 0, world);
            const bool got = !judged.dropped && (!judged.cut || reference_is_kept(words, used, 0, at));
            if (want != got && (judged.dropped || !judged.cut))
                fail_msg("round %d: a point of a box that is %s is not", round, judged.dropped ? "dropped" : "kept");
            differ += want != got; /* floats, at a border */
        }
    }
    assert_true(dropped > rounds / 10 && kept > rounds / 20 && open > rounds / 10);
    if (differ > 3)
        fail_msg("%zu points are judged otherwise by floats", differ);
}

static void refused(const char *text, const char *field, const char *why)
{
    struct spl_terms terms;
    struct spl_error err = {0};
    memset(&terms, 0, sizeof terms);
    int rc = strcmp(field, "class") ? spl_terms_parse(text, field, &terms, &err)
                                    : spl_terms_parse_classes(text, &terms, &err);
    rc = rc ? rc : spl_terms_check(&terms, field, &err);
    if (!rc)
        fail_msg("'%s' is taken", text);
    assert_string_equal(err.field, field);
    if (!strstr(err.message, why))
        fail_msg("'%s' is refused as '%s', not for '%s'", text, err.message, why);
}

static void test_what_is_degenerate_is_refused(void **state)
{
    (void)state;
    static const char *const cases[][2] = {
        {"polygon:0,0,1,0", "2 corners"},
        {"polygon:0,0,4,4,4,0,0,4", "meet"},
        {"polygon:0,0,4,0,4,4,4,4", "goes nowhere"},
        {"polygon:0,0,4,0,2,0", "back"},
        {"polygon:0,0,4,0,2,2,1,0,3,3", "meet"},
        {"polygon:0,0,4,0,2,2@3..1", "height 1"},
        {"polygon:0,0,4,0,2,2@3", "heights"},
        {"polygon:0,0,4,0,2", "number 2 of 2"},
        {"polygon:0,0,4,0,2,2:-1..0,1..2", "one range"},
        {"box:0,0,0,1,0,1", "empty box"},
        {"box:0,0,0,1,-1,1", "before it begins"},
        {"box:0,0,0,1,1,1,400", "400 degrees"},
        {"box:-1e308,0,0,1e308,1,1", "from -1e+308 to 1e+308, wider than numbers go"},
        {"polygon:-1e160,-1e160,1e160,-1e160,0,1e160", "a corner at -1e+160, beyond 1e+150"},
        {"box:0,0,0,1,1,1,10,20", "by three"},
        {"plane:0,0,0,0,0,0>0", "without length"},
        {"z", "no <, >"},
        {"class:2 and", "neither the end"},
        {"!", "missing"},
    };
    for (size_t i = 0; i < sizeof cases / sizeof *cases; i++)
        refused(cases[i][0], "clip", cases[i][1]);
    refused("2,x", "class", "classes are numbers");
    refused("", "class", "empty");
    refused("2.5", "class", "whole numbers");
    refused("2,3.25-5", "class", "whole numbers");
    refused("!2-4.5", "class", "whole numbers");
    refused("-1", "class", "whole numbers");
    refused("q0.5", "class", "whole numbers");
    refused("4294967296", "class", "whole numbers");
    refused("class:2 and z<1", "soft", "neither the end");
    char text[4096] = "polygon:0,0";
    for (int i = 0; i < SPL_TERMS_CORNERS_MAX; i++)
        snprintf(text + strlen(text), sizeof text - strlen(text), ",%d,%d", i + 1, (i + 1) * (i + 1));
    refused(text, "clip", "64 corners");
    *text = '\0';
    for (int i = 0; i <= SPL_TERMS_MIXED_MAX; i++)
        snprintf(text + strlen(text), sizeof text - strlen(text), "%sclass:%d or z<%d", i ? " and " : "", i, i);
    refused(text, "clip", "there may be 7");
}

/* Of a list of ranges each term has the polygon's corners to itself in kernels, though the text has them once. */
static void test_corners_that_are_shared_count_for_each(void **state)
{
    (void)state;
    char text[4096] = "polygon:";
    struct spl_terms terms;
    struct spl_error err = {0};
    enum { corners = SPL_TERMS_CORNERS_MAX / 2 };
    for (int i = 0; i < corners; i++)
        snprintf(text + strlen(text), sizeof text - strlen(text), "%s%.6f,%.6f", i ? "," : "",
                 cos(i * 2 * M_PI / corners), sin(i * 2 * M_PI / corners));
    memset(&terms, 0, sizeof terms);
    assert_int_equal(spl_terms_parse(text, "clip", &terms, &err), SPL_OK);
    for (uint32_t i = 1; i < 3; i++) {
        terms.terms[i] = terms.terms[0];
        terms.terms[i].joint = SPL_TERM_AND;
    }
    assert_int_equal(terms.corner_count, corners);
    for (terms.count = 1; terms.count <= 3; terms.count++) {
        err = (struct spl_error){0};
        assert_int_equal(spl_terms_check(&terms, "clip", &err), terms.count <= 2 ? SPL_OK : SPL_E_USAGE);
        assert_true(terms.count <= 2 || (!strcmp(err.field, "clip") && strstr(err.message, "64 corners")));
    }
}

static void test_terms_read_as_they_are_printed(void **state)
{
    (void)state;
    static const char *const texts[] = {
        "z<2.5",
        "!z:1.1..1.2",
        "1e-05<x<=0.5",
        "!class:3..5,9 and box:0,0,0,1,2,3,30 or class:2",
        "box:0,0,0,1,2,3,30,-20,5>1 and !intensity:*",
        "polygon:0,0,4,0,2,2 and polygon:9,9,8,9,8.5,8@-1..2.5<0.5",
        "class:2 or class:6 and !uncertainty:q0.1..q0.2,q0.5",
    };
    for (size_t i = 0; i < sizeof texts / sizeof *texts; i++) {
        struct spl_terms terms, again;
        char printed[SPL_TERMS_TEXT_MAX];
        struct spl_error err = {0};
        memset(&terms, 0, sizeof terms);
        memset(&again, 0, sizeof again);
        if (spl_terms_parse(texts[i], "clip", &terms, &err))
            fail_msg("'%s': %s", texts[i], err.message);
        spl_terms_print(&terms, printed, sizeof printed);
        assert_string_equal(printed, texts[i]);
        assert_int_equal(spl_terms_parse(printed, "clip", &again, NULL), 0);
        assert_memory_equal(&terms, &again, sizeof terms);
    }
    struct spl_terms classes, same;
    memset(&classes, 0, sizeof classes);
    memset(&same, 0, sizeof same);
    assert_int_equal(spl_terms_parse_classes("!2,6-8", &classes, NULL), 0);
    assert_int_equal(spl_terms_parse("!class:2,6-8", "clip", &same, NULL), 0);
    assert_memory_equal(&classes, &same, sizeof same);
    memset(&same, 0, sizeof same); /* a ring that is closed, as GeoJSON writes it */
    assert_int_equal(spl_terms_parse("polygon:0,0,4,0,2,2,0,0", "clip", &same, NULL), 0);
    assert_int_equal(same.corner_count, 3);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_what_is_said_of_a_box_holds_of_its_points),
        cmocka_unit_test(test_what_is_degenerate_is_refused),
        cmocka_unit_test(test_corners_that_are_shared_count_for_each),
        cmocka_unit_test(test_terms_read_as_they_are_printed),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
