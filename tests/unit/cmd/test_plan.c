/* splatd plan: sums done by hand, what happens at the ends of every input, and that no line falls where more is asked.
 */
#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <stdlib.h>
#include <string.h>
#include <cmocka.h>

#include "cmd/plan_model.h"
#include "cmd/plan_text.h"

static const struct spl_plan_asked country = {
    .points = 1e12, .views = 1000, .headroom = 1.3, .copies = 2, .size = {1280, 720}, .device = SPL_PLAN_DEVICE_h100};

#define VALUE(plan, name) ((plan).lines[SPL_PLAN_LINE_##name].value)
#define KNOWN(plan, name) ((plan).lines[SPL_PLAN_LINE_##name].known)

static void near(double value, double wanted)
{
    if (!(fabs(value - wanted) <= 1e-9 * fabs(wanted)))
        fail_msg("%.17g is not %.17g", value, wanted);
}

static void a_country_by_hand(void **state)
{
    (void)state;
    const struct spl_plan plan = spl_plan_reckon(&country);
    near(VALUE(plan, laz), 4.09e12);
    near(VALUE(plan, datasets), 233); /* 232.83 */
    near(VALUE(plan, core_hours), 1e12 * 2 * 1.1 / (1019000 * 3600.0));
    near(VALUE(plan, packed), 9.75e12);
    near(VALUE(plan, stored), 23.59e12);
    near(VALUE(plan, devices), 4);        /* 1300 / 338 is 3.85 */
    near(VALUE(plan, paged_devices), 15); /* 14.57 */
    near(VALUE(plan, device_cores), 64);
    near(VALUE(plan, sent_peak), 1300 * 165e3 * 8);
    near(VALUE(plan, sent_month), 1000 * 165e3 * 730 * 3600);
    near(VALUE(plan, device_memory), 240e9);
    near(VALUE(plan, held), 240e9 / 9.75e12);
    near(VALUE(plan, month_devices), 2920);
    near(VALUE(plan, cached), 0);
    assert_false(plan.beyond);
}

static void what_is_full_is_not_one_more(void **state)
{
    (void)state;
    struct spl_plan_asked asked = country;
    asked.points = 4294967294.0;
    assert_true(VALUE(spl_plan_reckon(&asked), datasets) == 1);
    asked.points += 1;
    assert_true(VALUE(spl_plan_reckon(&asked), datasets) == 2);
    asked.headroom = 1.1; /* 3380 × 1.1 ÷ 338 is 11 and a last bit too many */
    asked.views = 3380;
    assert_true(VALUE(spl_plan_reckon(&asked), devices) == 11);
    asked.views = 3380.001;
    assert_true(VALUE(spl_plan_reckon(&asked), devices) == 12);
}

/* As measured at the next size up, and beyond the largest by the pixels. */
static void sizes_are_those_that_were_measured(void **state)
{
    static const struct {
        uint32_t size[2];
        double jpeg, seconds;
        bool beyond;
    } rows[] = {
        {{1, 1}, 51e3, 1 / 338.0, false},           {{640, 360}, 51e3, 1 / 338.0, false},
        {{641, 360}, 165e3, 1 / 338.0, false},      {{1280, 720}, 165e3, 1 / 338.0, false},
        {{1280, 721}, 323e3, 1 / 132.0, true},      {{1920, 1080}, 323e3, 1 / 132.0, true},
        {{3840, 2160}, 4 * 323e3, 4 / 132.0, true},
    };
    (void)state;
    for (size_t i = 0; i < sizeof rows / sizeof *rows; i++) {
        struct spl_plan_asked asked = country;
        memcpy(asked.size, rows[i].size, sizeof asked.size);
        asked.views = 1e6;
        const struct spl_plan plan = spl_plan_reckon(&asked);
        near(VALUE(plan, sent_peak), 1.3e6 * rows[i].jpeg * 8);
        near(VALUE(plan, devices), ceil(1.3e6 * rows[i].seconds));
        assert_int_equal(plan.beyond, rows[i].beyond); /* JPEGs were encoded at 1280x720 alone */
    }
}

static void what_a_device_lacks_is_left_out(void **state)
{
    (void)state;
    struct spl_plan_asked asked = country;
    asked.device = SPL_PLAN_DEVICE_cpu;
    const struct spl_plan plan = spl_plan_reckon(&asked);
    near(VALUE(plan, devices), ceil(1300 / 6.1));
    assert_false(KNOWN(plan, paged_devices));
    assert_false(KNOWN(plan, device_memory));
    assert_false(KNOWN(plan, held)); /* made of the one before */
    assert_true(KNOWN(plan, device_cores));
    assert_false(plan.used[SPL_PLAN_FIGURE_h100_memory]);
    assert_true(plan.used[SPL_PLAN_FIGURE_cpu_720]);
}

static void extremes_are_finite(void **state)
{
    static const double points[] = {1, 1e15}, views[] = {0, 1e9}, headroom[] = {1, 100}, cached[] = {0, 1},
                        copies[] = {1, 100};
    static const uint32_t side[] = {1, 32768};
    (void)state;
    for (int i = 0; i < 128; i++) {
        const struct spl_plan_asked asked = {.points = points[i & 1],
                                             .views = views[i >> 1 & 1],
                                             .headroom = headroom[i >> 2 & 1],
                                             .cached = cached[i >> 3 & 1],
                                             .copies = copies[i >> 4 & 1],
                                             .size = {side[i >> 5 & 1], side[i >> 5 & 1]},
                                             .device = (enum spl_plan_device)(i >> 6 & 1)};
        const struct spl_plan plan = spl_plan_reckon(&asked);
        for (int line = 0; line < SPL_PLAN_LINES; line++) {
            char text[SPL_PLAN_TEXT_MAX];
            assert_true(plan.lines[line].value >= 0 && plan.lines[line].value < 1e30);
            assert_true(strlen(spl_plan_put_arithmetic(&plan, line, text)) < SPL_PLAN_TEXT_MAX - 1);
            assert_true(strlen(spl_plan_put_value(&plan, line, text)) < 40);
        }
        assert_true(VALUE(plan, datasets) >= 1 && VALUE(plan, devices) >= 1);
    }
}

/* No line falls, but for what a dataset has of all points, the share that is resident, and what the cache spares. */
static void more_asked_is_never_less(void **state)
{
    struct spl_plan_asked asked = country;
    double *const inputs[] = {&asked.points, &asked.views, &asked.headroom, &asked.copies, NULL};
    (void)state;
    for (int input = 0; input < 5; input++) {
        asked = country;
        struct spl_plan before = spl_plan_reckon(&asked);
        for (int step = 0; step < 40; step++) {
            if (inputs[input])
                *inputs[input] *= 1.07;
            else
                asked.size[step & 1] = asked.size[step & 1] * 107 / 100 + 1;
            const struct spl_plan now = spl_plan_reckon(&asked);
            for (int line = 0; line < SPL_PLAN_LINES; line++)
                if (line != SPL_PLAN_LINE_dataset_memory && line != SPL_PLAN_LINE_dataset_scratch &&
                    line != SPL_PLAN_LINE_held)
                    assert_true(now.lines[line].value >= before.lines[line].value);
            before = now;
        }
    }
    asked = country;
    struct spl_plan before = spl_plan_reckon(&asked);
    for (asked.cached = 0.1; asked.cached <= 1; asked.cached += 0.1) {
        const struct spl_plan now = spl_plan_reckon(&asked);
        assert_true(VALUE(now, devices) <= VALUE(before, devices) && VALUE(now, cached) > VALUE(before, cached));
        near(VALUE(now, rendered) + VALUE(now, cached), 1300);
        before = now;
    }
}

/* Terms that are printed give the value; no row of figures stands there unused or without its place. */
static void lines_say_how_they_were_reckoned(void **state)
{
    bool used[SPL_PLAN_FIGURES] = {0};
    (void)state;
    for (int device = 0; device < SPL_PLAN_DEVICES; device++)
        for (uint32_t side = 300; side < 3000; side += 300) {
            struct spl_plan_asked asked = country;
            asked.device = (enum spl_plan_device)device;
            asked.size[0] = asked.size[1] = side;
            const struct spl_plan plan = spl_plan_reckon(&asked);
            for (int i = 0; i < SPL_PLAN_FIGURES; i++)
                used[i] |= plan.used[i];
        }
    for (int i = 0; i < SPL_PLAN_FIGURES; i++) {
        const struct spl_plan_figure_row *row = spl_plan_figure_row(i);
        assert_true(used[i]);
        assert_true(row->value > 0);
        assert_true(!row->where[0] || strstr(row->where, ".md, "));
    }
    char text[SPL_PLAN_TEXT_MAX];
    const struct spl_plan plan = spl_plan_reckon(&country);
    assert_string_equal(spl_plan_put_arithmetic(&plan, SPL_PLAN_LINE_packed, text),
                        "1e12 points × 1.3 splats a point [9] × 7.5 bytes a splat [10]");
    assert_string_equal(spl_plan_put_arithmetic(&plan, SPL_PLAN_LINE_stored, text), "19.5 TB + 4.09 TB");
    assert_string_equal(spl_plan_put_value(&plan, SPL_PLAN_LINE_core_hours, text), "600 core hours");
    assert_string_equal(spl_plan_put_value(&plan, SPL_PLAN_LINE_sent_peak, text), "1.72 Gbit/s");
    assert_string_equal(spl_plan_put_value(&plan, SPL_PLAN_LINE_devices, text), "4 GPUs");
}

static void numbers_are_read_as_they_are(void **state)
{
    static const struct {
        double value;
        const char *text;
    } rows[] = {{0, "0"},
                {1e12, "1e12"},
                {4294967294, "4,294,967,294"},
                {1.5e13, "1.5e13"},
                {9.99e14, "9.99e14"},
                {7.5, "7.5"},
                {0.01, "0.01"},
                {1e-6, "1e-6"},
                {579000, "579,000"},
                {1e15, "1e15"},
                {123456789012, "1.234568e11"}};
    char text[SPL_PLAN_TEXT_MAX];
    (void)state;
    for (size_t i = 0; i < sizeof rows / sizeof *rows; i++)
        assert_string_equal(spl_plan_put_number(rows[i].value, text), rows[i].text);
    struct spl_plan_asked asked = country;
    asked.points = 1;
    asked.views = 0;
    const struct spl_plan plan = spl_plan_reckon(&asked);
    assert_string_equal(spl_plan_put_value(&plan, SPL_PLAN_LINE_devices, text), "1 GPU");
    assert_string_equal(spl_plan_put_value(&plan, SPL_PLAN_LINE_datasets, text), "1 dataset");
    assert_string_equal(spl_plan_put_value(&plan, SPL_PLAN_LINE_las, text), "34 bytes");
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(a_country_by_hand),
        cmocka_unit_test(what_is_full_is_not_one_more),
        cmocka_unit_test(sizes_are_those_that_were_measured),
        cmocka_unit_test(what_a_device_lacks_is_left_out),
        cmocka_unit_test(extremes_are_finite),
        cmocka_unit_test(more_asked_is_never_less),
        cmocka_unit_test(lines_say_how_they_were_reckoned),
        cmocka_unit_test(numbers_are_read_as_they_are),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
