/* Terms of soft transparency: what each form means, that what is printed reads as the same, what is refused and how. */
#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <stdio.h>
#include <string.h>

#include <cmocka.h>

#include <splatd/soft.h>

static struct spl_soft_params read_terms(const char *text)
{
    struct spl_soft_params soft;
    struct spl_error err = {0};
    memset(&soft, 0, sizeof soft);
    if (spl_soft_parse(text, &soft, &err))
        fail_msg("'%s': %s", text, err.message);
    return soft;
}

static void test_each_form_means_what_it_says(void **state)
{
    (void)state;
    static const struct {
        const char *text;
        enum spl_term_measure measure;
        const char *name;
        double least, most;
        bool with_least, with_most;
    } cases[] = {
        {"uncertainty>0.4", SPL_TERM_ATTRIBUTE, "uncertainty", 0.4, INFINITY, false, false},
        {" uncertainty >= 0.4 ", SPL_TERM_ATTRIBUTE, "uncertainty", 0.4, INFINITY, true, false},
        {"uncertainty>q0.9", SPL_TERM_QUANTILE, "uncertainty", 0.9, INFINITY, false, false},
        {"intensity<=300", SPL_TERM_ATTRIBUTE, "intensity", -INFINITY, 300, false, true},
        {"class:3", SPL_TERM_ATTRIBUTE, "class", 3, 3, true, true},
        {"class:3-5", SPL_TERM_ATTRIBUTE, "class", 3, 5, true, true},
        {"class:3..5", SPL_TERM_ATTRIBUTE, "class", 3, 5, true, true},
        {"angle:-5--2", SPL_TERM_ATTRIBUTE, "angle", -5, -2, true, true},
        {"angle:-5..-2.5", SPL_TERM_ATTRIBUTE, "angle", -5, -2.5, true, true},
        {"gps_time:1.5..1e9", SPL_TERM_ATTRIBUTE, "gps_time", 1.5, 1e9, true, true},
        {"x1:-1...5", SPL_TERM_ATTRIBUTE, "x1", -1, 0.5, true, true}, /* -1, two dots, .5 */
        {"red:q0.5..q0.75", SPL_TERM_QUANTILE, "red", 0.5, 0.75, true, true},
        {"0.2<uncertainty<=0.4", SPL_TERM_ATTRIBUTE, "uncertainty", 0.2, 0.4, false, true},
        {"0.4>=uncertainty>0.2", SPL_TERM_ATTRIBUTE, "uncertainty", 0.2, 0.4, false, true},
        {"q0.5<uncertainty", SPL_TERM_QUANTILE, "uncertainty", 0.5, INFINITY, false, false},
        {"intensity:*", SPL_TERM_ATTRIBUTE, "intensity", -INFINITY, INFINITY, false, false},
        {"axis:1,2,3,0,0,1<4", SPL_TERM_AXIS, "", -INFINITY, 4, false, false},
        {"1<axis:1,2,3,0,0,1<4", SPL_TERM_AXIS, "", 1, 4, false, false},
        {"plane:1,2,3,0,-1e-3,.5>0", SPL_TERM_PLANE, "", 0, INFINITY, false, false},
        {"box:1,2,3,4,5,6", SPL_TERM_BOX, "", -INFINITY, 0, false, true},
        {"box: 1, 2, 3, 4, 5, 6 < 2", SPL_TERM_BOX, "", -INFINITY, 2, false, false},
    };
    for (size_t i = 0; i < sizeof cases / sizeof *cases; i++) {
        struct spl_soft_params soft = read_terms(cases[i].text);
        const struct spl_term *term = soft.what.terms;
        assert_int_equal(soft.what.count, 1);
        assert_int_equal(term->measure, cases[i].measure);
        assert_string_equal(term->name, cases[i].name);
        assert_true(term->least == cases[i].least && term->most == cases[i].most);
        assert_true(term->with_least == cases[i].with_least && term->with_most == cases[i].with_most);
    }
}

static void test_shapes_have_their_numbers(void **state)
{
    (void)state;
    static const double wanted[6] = {1.5, -2e6, 3, 0, 0.1, 1};
    struct spl_soft_params soft = read_terms("plane:1.5,-2e6,3,0,0.1,1>0");
    assert_memory_equal(soft.what.terms[0].shape, wanted, sizeof wanted);
}

static void test_lists_and_or_add_terms(void **state)
{
    (void)state;
    struct spl_soft_params soft = read_terms("class:3-5,9 or uncertainty>q0.9  or  box:0,0,0,1,1,1");
    assert_int_equal(soft.what.count, 4);
    assert_true(soft.what.terms[1].least == 9 && soft.what.terms[1].most == 9);
    assert_int_equal(soft.what.terms[2].measure, SPL_TERM_QUANTILE);
    assert_int_equal(spl_soft_parse("class:7+or+class:8", &soft, NULL), SPL_OK); /* as forms write blanks */
    assert_int_equal(soft.what.count, 6);
    assert_true(soft.what.terms[5].least == 8);
    assert_string_equal(soft.what.terms[3].name, "");
}

static void expect_same(const struct spl_soft_params *soft)
{
    char text[SPL_TERMS_TEXT_MAX + 1];
    int length = spl_soft_print(soft, text, sizeof text);
    assert_true(length > 0 && length < (int)sizeof text && strlen(text) == (size_t)length);
    struct spl_soft_params back = read_terms(text);
    assert_int_equal(back.what.count, soft->what.count);
    if (memcmp(back.what.terms, soft->what.terms, sizeof soft->what.terms) != 0)
        fail_msg("'%s' reads as something else", text);
}

static void test_what_is_printed_reads_as_the_same(void **state)
{
    (void)state;
    static const struct {
        const char *text, *printed;
    } cases[] = {
        {"uncertainty>-0", "uncertainty>0"},
        {"uncertainty>0.4", "uncertainty>0.4"},
        {"uncertainty>=q.9", "uncertainty>=q0.9"},
        {"class:3-5,9", "class:3..5 or class:9"},
        {"angle:-5--2", "angle:-5..-2"},
        {"0.4>u", "u<0.4"},
        {"q0.25<=u<q0.5", "q0.25<=u<q0.5"},
        {"q0.25<=u<=q0.5", "u:q0.25..q0.5"},
        {"box:0,0,0,1,1,1<=0", "box:0,0,0,1,1,1"},
        {"box:0,0,0,1,1,1<0", "box:0,0,0,1,1,1<0"},
        {"axis:0.1,500000.123456789,3,0,0,1>=1e-300", "axis:0.1,500000.123456789,3,0,0,1>=1e-300"},
        {"plane:0,0,0,0,0,1:*", "plane:0,0,0,0,0,1:*"},
        {"plane:0,0,0,0,0,1:1..2", "plane:0,0,0,0,0,1:1..2"},
    };
    for (size_t i = 0; i < sizeof cases / sizeof *cases; i++) {
        char text[SPL_TERMS_TEXT_MAX + 1];
        struct spl_soft_params soft = read_terms(cases[i].text);
        spl_soft_print(&soft, text, sizeof text);
        assert_string_equal(text, cases[i].printed);
        expect_same(&soft);
    }
}

/* The longest there are, and a buffer that is too small. */
static void test_sixteen_of_the_longest_fit(void **state)
{
    (void)state;
    struct spl_soft_params soft;
    char small[8];
    memset(&soft, 0, sizeof soft);
    for (soft.what.count = 0; soft.what.count < SPL_TERMS_MAX; soft.what.count++) {
        struct spl_term *term = &soft.what.terms[soft.what.count];
        term->measure = SPL_TERM_PLANE;
        term->joint = SPL_TERM_OR;
        term->least = -1.2345678901234567e-300;
        term->most = 1.2345678901234567e-300;
        for (int i = 0; i < 6; i++)
            term->shape[i] = -1.2345678901234567e-100;
    }
    assert_int_equal(spl_soft_check(&soft, NULL), SPL_OK);
    expect_same(&soft);
    int length = spl_soft_print(&soft, small, sizeof small);
    assert_true(length > 3000 && strlen(small) == sizeof small - 1);
    assert_int_equal(spl_soft_print(&soft, NULL, 0), length);
    assert_int_equal(spl_soft_parse("class:1", &soft, NULL), SPL_E_LIMIT);
}

static void test_ranges_are_checked(void **state)
{
    (void)state;
    static const struct {
        double opacity, cover, blend;
        const char *field; /* NULL = all is well */
    } cases[] = {
        {0, 0, 0, NULL}, {1, 1, 1e9, NULL}, {0.3, 0.5, 0, NULL}, {1.1, 1, 0, "soft_opacity"},
        {NAN, 1, 0, "soft_opacity"},
        {0.3, 1.001, 0, "soft_cover"}, {0.3, -0.001, 0, "soft_cover"}, {0.3, NAN, 0, "soft_cover"},
        {0.3, INFINITY, 0, "soft_cover"}, {0.3, 1, -1, "soft_blend"}, {0.3, 1, INFINITY, "soft_blend"},
    };
    for (size_t i = 0; i < sizeof cases / sizeof *cases; i++) {
        struct spl_soft_params soft = {.opacity = cases[i].opacity, .cover = cases[i].cover, .blend = cases[i].blend};
        struct spl_error err = {0};
        assert_int_equal(spl_soft_check(&soft, &err), cases[i].field ? SPL_E_USAGE : SPL_OK);
        if (cases[i].field)
            assert_string_equal(err.field, cases[i].field);
    }
}

static void test_what_is_wrong_is_named(void **state)
{
    (void)state;
    static const struct {
        const char *text, *says;
    } cases[] = {
        {"", "empty"},
        {"   ", "empty"},
        {"uncertainty", "term 1, 'uncertainty', at character 12: no <, >"},
        {"uncertainty>", "at character 13: no number; write a number, as 0.4"},
        {"uncertainty>0.4 or", "neither the end nor ' or '"},
        {"uncertainty>0.4 or ", "term 2, '', at character 1: what is measured is missing"},
        {"uncertainty>0.4 and class:3", "at character 17: neither the end"},
        {"class:3 or intensity=5", "term 2, 'intensity=5', at character 10"},
        {"class:vegetation", "at character 7: classes are numbers: 2 is ground, 3-5 low to high vegetation"},
        {"class:3,ground", "at character 9: classes are numbers"},
        {"class=5", "there is no =; write 'class:5'"},
        {"class == 5", "there is no =; write 'class:5'"},
        {"class!=2", "there is no !=; write what is meant: 'class<2 or class>2'"},
        {"class!2", "no <, >"},
        {"intensity=high", "there is no =; write 'intensity:' and a value"},
        {"intensity:high", "no number"},
        {"class:q", "no number"},
        {"uncertainty>>4", "at character 13"},
        {"uncertainty>nan", "no number"},
        {"uncertainty>0x10", "no number"},
        {"uncertainty>inf", "no number"},
        {"uncertainty>1e999", "no number"},
        {"5>q2", "'q2' is a share of splats, not a name"},
        {"uncertainty>q1.5", "quantile 1.5, which is not within 0 and 1"},
        {"uncertainty>q-0.1", "quantile -0.1"},
        {"uncertainty:q0.5..0.9", "one end is a share"},
        {"0.5<uncertainty<q0.9", "one end is a share"},
        {"0.5<uncertainty>0.9", "contradict"},
        {"0.5 uncertainty", "no < or > behind a number"},
        {"class:5-3", "ends at 3 before it begins at 5"},
        {"class:3,,4", "at character 9: no number"},
        {"class:", "no number"},
        {"class:3-", "no number"},
        {"axis<4", "a shape needs its numbers; write axis:x,y,z,dx,dy,dz<4"},
        {"axis:1,2,3<4", "number 4 of 6 is missing"},
        {"axis:1,2,3,0,0,0<4", "direction without length"},
        {"axis:1,2,3,0,0,1<q0.5", "no shares of splats"},
        {"axis:1,2,3,0,0,1", "no <, >"},
        {"box:1,2,3,0,5,6", "ends at 0 before it begins at 1"},
        {"box:1,2,3,4,5,6,7,8", "by three"},
        {"a_name_that_is_far_too_long_for_it>4", "more than 31 characters"},
        {"\xc3\xbc>1", "term 1, '', at character 1"},
    };
    for (size_t i = 0; i < sizeof cases / sizeof *cases; i++) {
        struct spl_soft_params soft, before;
        struct spl_error err = {0};
        memset(&soft, 0, sizeof soft);
        soft.model = SPL_SOFT_MODEL_BASE;
        before = soft;
        int rc = spl_soft_parse(cases[i].text, &soft, &err);
        if (rc != SPL_E_INPUT || strcmp(err.field, "soft") != 0 || !strstr(err.message, cases[i].says))
            fail_msg("'%s': %d, %s: %s", cases[i].text, rc, err.field, err.message);
        assert_memory_equal(&soft, &before, sizeof soft);
    }
}

static void test_there_are_bounds(void **state)
{
    (void)state;
    static char text[SPL_TERMS_TEXT_MAX + 2];
    struct spl_soft_params soft;
    struct spl_error err = {0};
    memset(&soft, 0, sizeof soft);
    assert_int_equal(spl_soft_parse("class:1,2,3,4,5,6,7,8,9,10,11,12,13,14,15,16", &soft, NULL), SPL_OK);
    memset(&soft, 0, sizeof soft);
    assert_int_equal(spl_soft_parse("class:1,2,3,4,5,6,7,8,9,10,11,12,13,14,15,16,17", &soft, &err), SPL_E_LIMIT);
    assert_int_equal(soft.what.count, 0);
    memset(text, ' ', sizeof text - 1);
    memcpy(text, "class:1", 7);
    err = (struct spl_error){0};
    assert_int_equal(spl_soft_parse(text, &soft, &err), SPL_E_INPUT);
    assert_non_null(strstr(err.message, "longer than 8192"));
    text[SPL_TERMS_TEXT_MAX] = '\0';
    assert_int_equal(spl_soft_parse(text, &soft, NULL), SPL_OK);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_each_form_means_what_it_says),
        cmocka_unit_test(test_shapes_have_their_numbers),
        cmocka_unit_test(test_lists_and_or_add_terms),
        cmocka_unit_test(test_what_is_printed_reads_as_the_same),
        cmocka_unit_test(test_sixteen_of_the_longest_fit),
        cmocka_unit_test(test_ranges_are_checked),
        cmocka_unit_test(test_what_is_wrong_is_named),
        cmocka_unit_test(test_there_are_bounds),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
