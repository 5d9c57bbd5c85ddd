/* Numbers out of text: equal to strtod to the bit whatever path they take, in every locale, and nothing else is one. */
#include "cloud_test.h"

#include <inttypes.h>
#include <locale.h>
#include <math.h>

#include "cloud/fields.h"

static uint64_t bits(double v)
{
    uint64_t b;
    memcpy(&b, &v, sizeof b);
    return b;
}

static void same_as_strtod(const char *text)
{
    double v = -1, truth = strtod(text, NULL);
    const char *end = text + strlen(text);
    if (spl_number_parse(text, end, &v) != end || bits(v) != bits(truth))
        fail_msg("\"%s\" gave %.17g (%016" PRIx64 ") instead of %.17g (%016" PRIx64 ")", text, v, bits(v), truth,
                 bits(truth));
}

static void numbers_equal_strtod(void **state)
{
    static const char *const texts[] = {
        "0",
        "-0",
        "+1",
        "1.",
        ".5",
        "-.5e1",
        "1e22",
        "1e23",
        "1e-22",
        "1e-23",
        "9007199254740992",
        "9007199254740993",
        "9007199254740993e-3",
        "123456789012345678",
        "1234567890123456789",
        "12345678901234567890",
        "0.30000000000000004",
        "1e308",
        "1.7976931348623157e308",
        "1e309",
        "-1e999",
        "4.9e-324",
        "1e-400",
        "0.000000000000000000000000000000000123",
        "0e999999999999",
        "1E+05",
        "7405438.123456789",
        "2.2250738585072011e-308",
        ("1797693134862315807937289714053034150799341327100378269361737789804449682927647509466490179775872070963302864"
         "1"
         "6692"),
    };
    (void)state;
    for (size_t i = 0; i < sizeof texts / sizeof *texts; i++)
        same_as_strtod(texts[i]);
    uint64_t seed = 88172645463325252u;
    char text[64];
    for (int i = 0; i < 200000; i++) {
        seed ^= seed << 13, seed ^= seed >> 7, seed ^= seed << 17;
        double v;
        memcpy(&v, &seed, sizeof v);
        if (!isfinite(v))
            continue;
        switch (i % 4) {
        case 0:
            snprintf(text, sizeof text, "%.17g", v);
            break;
        case 1:
            snprintf(text, sizeof text, "%.4f", (double)(int64_t)seed * 1e-11);
            break;
        case 2:
            snprintf(text, sizeof text, "%.9e", v);
            break;
        default:
            snprintf(text, sizeof text, "%" PRIu64 "e%d", seed >> (i % 60), (int)(seed % 60) - 30);
        }
        same_as_strtod(text);
    }
}

static void locale_does_not_matter(void **state)
{
    (void)state;
    /* where the machine has a locale with a decimal comma */
    const char *set = setlocale(LC_ALL, "de_DE.UTF-8");
    double v;
    const char *point = "1.25", *longer = "0.12345678901234567890";
    assert_non_null(spl_number_parse(point, point + 4, &v));
    assert_true(v == 1.25);
    assert_ptr_equal(spl_number_parse(longer, longer + strlen(longer), &v), longer + strlen(longer));
    assert_true(v == 0.12345678901234567890);
    if (set)
        setlocale(LC_ALL, "C");
}

static void special_spellings_are_numbers(void **state)
{
    static const char *const nans[] = {"nan", "NaN", "-nan", "nan(ind)", "-nan(ind)", "1.#QNAN", "-1.#IND", "1.#INF"};
    static const char *const infinities[] = {"inf", "-Inf", "Infinity", "+INFINITY"};
    double v;
    (void)state;
    for (size_t i = 0; i < sizeof nans / sizeof *nans; i++) {
        const char *end = nans[i] + strlen(nans[i]);
        assert_ptr_equal(spl_number_parse(nans[i], end, &v), end);
        assert_true(isnan(v));
    }
    for (size_t i = 0; i < sizeof infinities / sizeof *infinities; i++) {
        const char *end = infinities[i] + strlen(infinities[i]);
        assert_ptr_equal(spl_number_parse(infinities[i], end, &v), end);
        assert_true(isinf(v) && (v < 0) == (infinities[i][0] == '-'));
    }
}

static void other_texts_are_no_numbers(void **state)
{
    static const char *const texts[] = {"", "-", "+", ".", "e5", "x", "na", "in", "--1", ","};
    double v;
    (void)state;
    for (size_t i = 0; i < sizeof texts / sizeof *texts; i++)
        assert_null(spl_number_parse(texts[i], texts[i] + strlen(texts[i]), &v));
    const char *hexadecimal = "0x10"; /* stops behind the 0, so the field is no number */
    assert_ptr_equal(spl_number_parse(hexadecimal, hexadecimal + 4, &v), hexadecimal + 1);
    const char *exponent = "1e+";
    assert_ptr_equal(spl_number_parse(exponent, exponent + 3, &v), exponent + 1);
}

static void integers_refuse_overflow(void **state)
{
    uint64_t v;
    const char *most = "18446744073709551615", *more = "18446744073709551616", *negative = "-1";
    (void)state;
    assert_ptr_equal(spl_integer_parse(most, most + 20, &v), most + 20);
    assert_true(v == UINT64_MAX);
    assert_null(spl_integer_parse(more, more + 20, &v));
    assert_null(spl_integer_parse(negative, negative + 2, &v));
    assert_null(spl_integer_parse(most, most, &v));
}

static void fields_split_by_separator(void **state)
{
    (void)state;
    const char *line = " 1 ,\t2,, 4,";
    struct spl_fields f = spl_fields_begin(line, strlen(line), ',');
    double v;
    size_t length;
    assert_int_equal(spl_fields_number(&f, &v), SPL_FIELD_OK);
    assert_true(v == 1);
    assert_int_equal(spl_fields_number(&f, &v), SPL_FIELD_OK);
    assert_true(v == 2);
    struct spl_fields empty = f;
    assert_int_equal(spl_fields_number(&empty, &v), SPL_FIELD_BAD);
    assert_int_equal(spl_fields_text(&f, &length), SPL_FIELD_OK);
    assert_int_equal(length, 0);
    assert_int_equal(spl_fields_number(&f, &v), SPL_FIELD_OK);
    assert_true(v == 4);
    assert_int_equal(spl_fields_number(&f, &v), SPL_FIELD_END);

    const char *quoted = "\"a, b\" ; x;";
    f = spl_fields_begin(quoted, strlen(quoted), ';');
    assert_int_equal(spl_fields_text(&f, &length), SPL_FIELD_OK);
    assert_memory_equal(f.start, "a, b", 4);
    assert_int_equal(length, 4);
    assert_int_equal(spl_fields_count("1 2\t 3  ", 8, ' '), 3);
    assert_int_equal(spl_fields_count("1 2,3", 5, ','), 2);
    f = spl_fields_begin("1 2,3", 5, ',');
    assert_int_equal(spl_fields_number(&f, &v), SPL_FIELD_BAD);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(numbers_equal_strtod),          cmocka_unit_test(locale_does_not_matter),
        cmocka_unit_test(special_spellings_are_numbers), cmocka_unit_test(other_texts_are_no_numbers),
        cmocka_unit_test(integers_refuse_overflow),      cmocka_unit_test(fields_split_by_separator),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
