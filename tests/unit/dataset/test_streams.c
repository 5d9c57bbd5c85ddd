/* Optional attributes as codes: exact where they are whole numbers, within their promise where they are not. */
#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <string.h>

#include <cmocka.h>

#include "dataset/streams.h"

/* Encodes into a block whose end is watched, decodes each value. */
static struct spl_stream_code through(enum spl_stream_type type, const double *values, uint32_t count, double *out)
{
    static const char *const names[] = {"uint", "half-octaves", "steps"};
    uint32_t words[SPL_STREAM_WORDS_MAX + 2];
    struct spl_stream_code code;
    memset(words, 0xa5, sizeof words);
    uint32_t used = spl_stream_encode(type, values, count, &code, words);
    assert_int_equal(used, spl_stream_words(code.width, count));
    for (size_t i = used; i < sizeof words / sizeof *words; i++)
        assert_int_equal(words[i], 0xa5a5a5a5u);
    uint64_t at;
    assert_null(spl_stream_judge(type, &code.base, &code.width, 1, &at));
    for (uint32_t i = 0; i < count; i++)
        out[i] = spl_stream_decode(&(struct spl_stream){.type = names[type], .steps_a_unit = 1}, code, words, i);
    return code;
}

static void test_whole_numbers_are_exact(void **state)
{
    (void)state;
    static const struct {
        double low, step;
        unsigned bits; /* of a full chunk */
    } rows[] = {{0, 0, 0}, {255, 0, 0}, {4294967295.0, 0, 0}, {0, 1, 7}, {65000, 3, 9}, {1, 33818640, 32}};
    for (size_t row = 0; row < sizeof rows / sizeof *rows; row++)
        for (uint32_t count = 1; count <= SPL_CHUNK_SPLATS; count += count < 3 ? 1 : 25) {
            double in[SPL_CHUNK_SPLATS], out[SPL_CHUNK_SPLATS];
            for (uint32_t i = 0; i < count; i++)
                in[i] = rows[row].low + rows[row].step * ((i * 55) % SPL_CHUNK_SPLATS);
            struct spl_stream_code code = through(SPL_STREAM_UINT, in, count, out);
            assert_memory_equal(in, out, count * sizeof *in);
            assert_true(count > 1 || (code.width == 0 && code.base == in[0]));
        }
    double in[SPL_CHUNK_SPLATS], out[SPL_CHUNK_SPLATS];
    for (size_t row = 0; row < sizeof rows / sizeof *rows; row++) {
        for (uint32_t i = 0; i < SPL_CHUNK_SPLATS; i++)
            in[i] = rows[row].low + rows[row].step * i;
        assert_int_equal(through(SPL_STREAM_UINT, in, SPL_CHUNK_SPLATS, out).width, rows[row].bits);
    }
}

static void test_half_octaves(void **state)
{
    (void)state;
    static const struct {
        double in[3], out[3];
        unsigned bits;
    } rows[] = {
        {{0, 0, 0}, {0, 0, 0}, 0},     {{0.25, 0.25, 0.25}, {0.25, 0.25, 0.25}, 0}, {{0, 1, 1}, {0, 1, 1}, 1},
        {{0.5, 1, 0}, {0.5, 1, 0}, 2}, {{0x1p-15, 1, 0}, {0x1p-15, 1, 0}, 5},       {{1e-30, 1, 1}, {0, 1, 1}, 1},
    };
    double out[SPL_CHUNK_SPLATS], in[SPL_CHUNK_SPLATS];
    for (size_t row = 0; row < sizeof rows / sizeof *rows; row++) {
        assert_int_equal(through(SPL_STREAM_HALF_OCTAVES, rows[row].in, 3, out).width, rows[row].bits);
        assert_memory_equal(out, rows[row].out, sizeof rows[row].out);
    }
    for (uint32_t i = 0; i < SPL_CHUNK_SPLATS; i++)
        in[i] = i % 10 ? exp2(-0.09 * i) : 0;
    through(SPL_STREAM_HALF_OCTAVES, in, SPL_CHUNK_SPLATS, out);
    for (uint32_t i = 0; i < SPL_CHUNK_SPLATS; i++)
        assert_true(in[i] == 0 ? out[i] == 0 : fabs(log2(out[i] / in[i])) < 0.26);
}

/* Any numbers up to the largest, with splats that have none among them, or nothing else. */
static void steps_and_none(void **state)
{
    (void)state;
    static const struct {
        double low, step;
        unsigned every, bits; /* none: each such splat; 0: no splat */
    } rows[] = {{7, 0, 0, 0}, {7, 0, 1, 0}, {7, 0, 2, 1}, {SPL_STREAM_NONE - 1.0, 0, 3, 1},
                {0, 1, 0, 8}, {0, 1, 5, 7}, {5, 3, 0, 9}, {0, 33818640, 4, 32}};
    double in[SPL_CHUNK_SPLATS], out[SPL_CHUNK_SPLATS];
    for (size_t row = 0; row < sizeof rows / sizeof *rows; row++) {
        for (uint32_t i = 0; i < SPL_CHUNK_SPLATS; i++)
            in[i] = rows[row].every && i % rows[row].every == 0 ? SPL_STREAM_NONE : rows[row].low + rows[row].step * i;
        struct spl_stream_code code = through(SPL_STREAM_STEPS, in, SPL_CHUNK_SPLATS, out);
        assert_int_equal(code.width, rows[row].bits);
        for (uint32_t i = 0; i < SPL_CHUNK_SPLATS; i++)
            if (in[i] == SPL_STREAM_NONE ? !isnan(out[i]) : in[i] != out[i])
                fail_msg("row %zu: %.17g instead of %.17g", row, out[i], in[i]);
    }
    const struct spl_stream tenths = {.type = "steps", .first = -3, .steps_a_unit = 10};
    assert_true(spl_stream_decode(&tenths, (struct spl_stream_code){0, 0}, (uint32_t[2]){0}, 0) == -0.3);
    assert_true(spl_stream_decode(&tenths, (struct spl_stream_code){6, 0}, (uint32_t[2]){0}, 0) == 0.3);
    assert_null(spl_stream_judge_steps(-0x1p53, 0x1p-100));
    assert_non_null(spl_stream_judge_steps(0.5, 1));
    assert_non_null(spl_stream_judge_steps(0x1p54, 1));
    assert_non_null(spl_stream_judge_steps((double)NAN, 1));
    assert_non_null(spl_stream_judge_steps(0, 0));
    assert_non_null(spl_stream_judge_steps(0, -1));
    assert_non_null(spl_stream_judge_steps(0, (double)NAN));
    assert_non_null(spl_stream_judge_steps(0, 0x1p-1000));
}

static void test_bad_codes(void **state)
{
    (void)state;
    static const struct {
        enum spl_stream_type type;
        struct spl_stream_code code;
        bool good;
    } rows[] = {
        {SPL_STREAM_UINT, {0, 32}, true},
        {SPL_STREAM_UINT, {1, 32}, true},
        {SPL_STREAM_UINT, {0, 33}, false},
        {SPL_STREAM_UINT, {UINT32_MAX, 0}, true},
        {SPL_STREAM_UINT, {UINT32_MAX, 1}, true},
        {SPL_STREAM_HALF_OCTAVES, {0x3f800000, 5}, true},
        {SPL_STREAM_HALF_OCTAVES, {0x3f800000, 6}, false},
        {SPL_STREAM_HALF_OCTAVES, {0x7f800000, 0}, false},
        {SPL_STREAM_HALF_OCTAVES, {0x7fc00000, 0}, false},
        {SPL_STREAM_HALF_OCTAVES, {0xbf800000, 0}, false},
        {SPL_STREAM_STEPS, {UINT32_MAX, 32}, true},
        {SPL_STREAM_STEPS, {0, 33}, false},
        {SPL_STREAM_UNKNOWN, {0x7fc00000, 32}, true},
        {SPL_STREAM_UNKNOWN, {0, 33}, false},
    };
    for (size_t i = 0; i < sizeof rows / sizeof *rows; i++) {
        uint32_t bases[3] = {0x3f800000, 0x3f800000, rows[i].code.base};
        uint8_t widths[3] = {0, 1, rows[i].code.width};
        uint64_t at;
        const char *what = spl_stream_judge(rows[i].type, bases, widths, 3, &at);
        if (!what != rows[i].good || (what && at != 2))
            fail_msg("row %zu", i);
    }
    const struct spl_stream unknown = {.type = "furlongs"};
    assert_true(isnan(spl_stream_decode(&unknown, (struct spl_stream_code){0, 0}, NULL, 0)));
    assert_int_equal(spl_stream_type_from_name("uint"), SPL_STREAM_UINT);
    assert_int_equal(spl_stream_type_from_name("half-octaves"), SPL_STREAM_HALF_OCTAVES);
    assert_int_equal(spl_stream_type_from_name("UINT"), SPL_STREAM_UNKNOWN);
}

/* Figures of both stand in one object by name. */
static void names_that_every_dataset_has_are_taken(void **state)
{
    (void)state;
    for (int a = 0; a < SPL_ATTRIBUTE_COUNT; a++)
        assert_true(spl_stream_name_is_taken(spl_attribute_name((enum spl_attribute)a)));
    assert_true(spl_stream_name_is_taken("total") && spl_stream_name_is_taken("position_axis"));
    for (int k = 0; k < SPL_STREAM_KNOWN_COUNT; k++)
        assert_false(spl_stream_name_is_taken(spl_streams_known[k].name));
    assert_false(spl_stream_name_is_taken("intensity"));
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(names_that_every_dataset_has_are_taken),
        cmocka_unit_test(test_whole_numbers_are_exact),
        cmocka_unit_test(test_half_octaves),
        cmocka_unit_test(steps_and_none),
        cmocka_unit_test(test_bad_codes),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
