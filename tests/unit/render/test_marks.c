/* Terms against datasets and chunks against terms, by brute force: every code of random chunks is decoded and asked.
 * Streams of all types, with bases that wrap, values that are none, ranges of any form; shapes against points of random
 * boxes; what a dataset cannot answer. */
#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <stdio.h>
#include <string.h>
#include <cmocka.h>

#include "base/error.h"
#include "dataset/bits.h"
#include "dataset/chunk.h"
#include "render/marks.h"
#include "support/make_dataset.h"
#include "support/reference_marks.h"

enum { rounds = 4000 };

static uint64_t random_state;

static double uniform(void)
{
    random_state = random_state * 6364136223846793005u + 1442695040888963407u;
    return (double)(random_state >> 11) / 9007199254740992.0;
}

static uint32_t any_word(void)
{
    return (uint32_t)(uniform() * 4294967296.0);
}

static int seed(void **state)
{
    (void)state;
    random_state = 1;
    return 0;
}

/* A dataset's description with a stream of each type, whose values are known. */
static struct spl_stream_values known_values[3];
static struct spl_stream streams[3];

static struct spl_dataset_info describe(void)
{
    static const char *const names[3] = {"class", "height", "uncertainty"};
    static const char *const types[3] = {"uint", "steps", "half-octaves"};
    struct spl_dataset_info info = {.id = "made", .stream_count = 3, .stream_values = known_values};
    for (int s = 0; s < 3; s++) {
        snprintf(info.streams[s].name, sizeof info.streams[s].name, "%s", names[s]);
        snprintf(info.streams[s].type, sizeof info.streams[s].type, "%s", types[s]);
        streams[s] = (struct spl_stream){.name = names[s], .type = types[s], .unit = ""};
        known_values[s] = (struct spl_stream_values){.count = 1000, .p99 = 63.5};
        for (int i = 0; i <= SPL_VALUES_QUANTILES; i++)
            known_values[s].quantiles[i] = i < SPL_VALUES_QUANTILES ? i : 100;
    }
    streams[1].first = -1000;
    streams[1].steps_a_unit = 10;
    return info;
}

static struct spl_term term_of(const char *name, double least, double most)
{
    struct spl_term term = {.least = least, .most = most, .with_least = uniform() < 0.5,
                                 .with_most = uniform() < 0.5};
    snprintf(term.name, sizeof term.name, "%s", name);
    return term;
}

/* Codes of a random chunk and stream: base, width, and for as many as there are a value or NaN. */
struct codes {
    struct spl_chunk chunk;
    uint32_t base, words[SPL_CHUNK_SPLATS + 3];
    uint8_t width;
    uint32_t *bases[1];
};

static void make_codes(struct codes *c, enum spl_stream_type type, bool complete)
{
    struct spl_bit_writer writer = {.words = c->words};
    *c = (struct codes){.chunk = {.count = 1 + (uint16_t)(uniform() * SPL_CHUNK_SPLATS)}};
    writer.words = c->words;
    c->width = (uint8_t)(uniform() * (type == SPL_STREAM_HALF_OCTAVES ? 6 : uniform() < 0.3 ? 33 : 7));
    c->base = uniform() < 0.2 ? any_word() : uniform() < 0.2 ? UINT32_MAX - (uint32_t)(uniform() * 20)
                                                             : (uint32_t)(uniform() * 40);
    if (type == SPL_STREAM_HALF_OCTAVES) {
        float largest = uniform() < 0.1 ? 0 : (float)(100 * uniform());
        memcpy(&c->base, &largest, sizeof c->base);
    }
    for (uint32_t i = 0; i < c->chunk.count; i++) {
        uint32_t mask = c->width ? UINT32_MAX >> (32 - c->width) : 0;
        uint32_t code = uniform() < 0.1 ? mask : any_word() & mask;
        if (type == SPL_STREAM_STEPS && complete && code == mask && c->width)
            code = 0;
        spl_bits_put(&writer, code, c->width);
    }
    spl_bits_pad(&writer);
}

/* Marks of every splat of a chunk as its verdict, or its tests, have them. */
static uint32_t mark_of(const struct spl_marks_chunk *judged, const struct codes *c, uint32_t i, const float p[3])
{
    uint32_t mark = judged->test_words ? reference_mark(judged->tests, 0, c->words, i, p)
                                       : judged->soft ? SPL_MARK_WHOLE : 0;
    return mark;
}

/* Any type, any range, alone: what is said of a chunk holds for each of its splats, and its tests give each its
 * mark. */
static void numbers_are_as_they_decode(void **state)
{
    struct spl_dataset_info info = describe();
    uint32_t seen[4] = {0}, whole[2] = {0};
    (void)state;
    for (int round = 0; round < rounds; round++) {
        const bool complete = round / 3 % 2; /* whether every splat is known to have a value */
        info.leaf_splats = complete ? 1000 : 1001;
        const int s = round % 3;
        const enum spl_stream_type type = spl_stream_type_from_name(streams[s].type);
        struct codes c;
        make_codes(&c, type, complete);
        /* ends that values fall on, some of them; or none */
        double at = spl_stream_decode(&streams[s], (struct spl_stream_code){c.base, c.width}, c.words, 0);
        double ends[2] = {uniform() < 0.5 && at == at ? at : 120 * uniform() - 60, 120 * uniform() - 20};
        if (uniform() < 0.2)
            ends[1] = uniform() < 0.5 ? INFINITY : ends[0];
        if (uniform() < 0.2)
            ends[0] = -INFINITY;
        double blend = uniform() < 0.5 ? 0 : 30 * uniform();
        struct spl_soft_params soft = {.what.count = 1, .blend = blend};
        soft.what.terms[0] = term_of(info.streams[s].name, fmin(ends[0], ends[1]), fmax(ends[0], ends[1]));
        struct spl_marks marks = {.count = 1, .streams = streams};
        assert_int_equal(spl_marks_resolve(&soft, &info, marks.terms, NULL), SPL_OK);
        if (s == 2) /* shares of the 99th percentile */
            for (int e = 0; e < 2; e++)
                *(e ? &soft.what.terms[0].most : &soft.what.terms[0].least) *= 63.5;
        spl_marks_find_numbers(&marks);
        double used = s == 0 ? 0 : s == 2 ? blend * 63.5 : blend;

        struct spl_tables tables = {.chunks = &c.chunk, .chunk_count = 1, .stream_count = 3};
        uint32_t bases[3] = {0};
        uint8_t widths[3] = {0};
        bases[s] = c.base;
        widths[s] = c.width;
        for (int i = 0; i < 3; i++) {
            tables.base[i] = &bases[i];
            tables.width[i] = &widths[i];
        }
        c.chunk.geometry_word = (uint32_t)-(int32_t)spl_chunk_words(&c.chunk); /* its codes are at word 0 */
        struct spl_marks_chunk judged;
        spl_marks_judge(&marks, NULL, &tables, 0, NULL, &judged);
        for (uint32_t i = 0; i < c.chunk.count; i++) {
            double value = spl_stream_decode(&streams[s], (struct spl_stream_code){c.base, c.width}, c.words, i);
            double share = reference_share(&soft.what.terms[0], used, value);
            uint32_t mark = mark_of(&judged, &c, i, (float[3]){0});
            if ((share >= 0) != (mark > 0) || (mark && fabs(share * SPL_MARK_MOST - (mark - 1.0)) > 0.6))
                fail_msg("round %d, %s, base %u, width %u: value %.17g, of %.17g%s to %.17g%s, is %g and has mark %u",
                         round, streams[s].type, c.base, c.width, value, soft.what.terms[0].least,
                         soft.what.terms[0].with_least ? " (with it)" : "", soft.what.terms[0].most,
                         soft.what.terms[0].with_most ? " (with it)" : "", share, mark);
            assert_true(judged.soft || share < 0);
            assert_true(judged.solid || share >= 0);
        }
        whole[complete] += type == SPL_STREAM_STEPS && c.width && judged.soft && !judged.solid && !judged.test_words;
        seen[!judged.soft ? 0 : judged.solid ? 1 : judged.test_words ? 2 : 3]++;
        assert_false(judged.by_cells);
    }
    for (int i = 0; i < 4; i++)
        assert_true(seen[i] > rounds / 100);
    assert_true(whole[1] > rounds / 100); /* drawn without marks */
    assert_int_equal(whole[0], 0);
}

/* Shapes: a camera anywhere, points within a box. */
static void shapes_are_as_far_as_they_are(void **state)
{
    struct spl_dataset_info info = describe();
    uint32_t seen[4] = {0};
    (void)state;
    for (int round = 0; round < rounds; round++) {
        const double far_away = round % 5 ? 0 : 5e6;
        struct spl_camera camera = {0};
        double eye[3], target[3];
        for (int i = 0; i < 3; i++) {
            eye[i] = far_away + 20 * uniform();
            target[i] = far_away + 20 * uniform();
        }
        assert_int_equal(spl_camera_look_at(&camera, eye, target, (const double[3]){0.1, 0.2, 1}, NULL), SPL_OK);
        struct spl_soft_params soft = {.what.count = 1, .blend = uniform() < 0.5 ? 0 : 4 * uniform()};
        struct spl_term *term = &soft.what.terms[0];
        *term = term_of("", uniform() < 0.5 ? -INFINITY : 12 * uniform() - 4, INFINITY);
        term->measure = SPL_TERM_AXIS + round % 3;
        if (uniform() < 0.7)
            term->most = fmax(term->least, -3) + 8 * uniform();
        for (int i = 0; i < 3; i++) {
            term->shape[i] = far_away + 20 * uniform();
            term->shape[i + 3] = term->measure == SPL_TERM_BOX ? term->shape[i] + 8 * uniform() : uniform() - 0.5;
        }
        struct spl_marks marks = {.count = 1, .streams = streams};
        struct spl_marks_view view;
        uint32_t words[7 + SPL_MARKS_SHAPES_MAX];
        assert_int_equal(spl_marks_resolve(&soft, &info, marks.terms, NULL), SPL_OK);
        assert_int_equal(spl_marks_see(&marks, &camera, 7, &view, words + 7), SPL_MARKS_SHAPE_WORDS);
        double least[3], size[3], corner[3];
        for (int i = 0; i < 3; i++) {
            corner[i] = far_away + 20 * uniform();
            least[i] = corner[i] - eye[i];
            size[i] = (round % 2 ? 8 : 1) * uniform();
        }
        struct spl_view_box box = spl_view_box(&camera, least, size);
        struct spl_chunk chunk = {.count = 128};
        struct spl_tables tables = {.chunks = &chunk, .chunk_count = 1};
        struct spl_marks_chunk judged;
        spl_marks_judge(&marks, &view, &tables, 0, &box, &judged);
        assert_int_equal(judged.by_cells, judged.test_words > 0);
        seen[!judged.soft ? 0 : judged.solid ? 1 : judged.test_words ? 2 : 3]++;
        for (int i = 0; i < 20; i++) {
            double world[3];
            float p[3];
            uint32_t tests[7 + SPL_MARKS_SHAPES_MAX + SPL_MARKS_TESTS_MAX];
            for (int a = 0; a < 3; a++)
                world[a] = corner[a] + size[a] * uniform();
            for (int c = 0; c < 3; c++) {
                const double *r = camera.rotation + 3 * c;
                p[c] = (float)(r[0] * (world[0] - eye[0]) + r[1] * (world[1] - eye[1]) + r[2] * (world[2] - eye[2]));
            }
            double distance = reference_distance(term, world), share = reference_share(term, soft.blend, distance);
            if (fabs(distance - term->least) < 1e-4 || fabs(distance - term->most) < 1e-4)
                continue; /* floats may round it across */
            memcpy(tests, words, sizeof words);
            memcpy(tests + 7 + SPL_MARKS_SHAPES_MAX, judged.tests, judged.test_words * sizeof *tests);
            uint32_t mark = judged.test_words ? reference_mark(tests, 7 + SPL_MARKS_SHAPES_MAX, NULL, 0, p)
                            : judged.soft     ? SPL_MARK_WHOLE
                                              : 0;
            if ((share >= 0) != (mark > 0) || (mark && fabs(share * SPL_MARK_MOST - (mark - 1.0)) > 1.1))
                fail_msg("round %d, shape %d: distance %g of %g to %g is %g and has mark %u", round,
                         (int)term->measure, distance, term->least, term->most, share, mark);
            assert_true(judged.soft || share < 0);
            assert_true(judged.solid || share >= 0);
        }
    }
    for (int i = 0; i < 4; i++)
        assert_true(seen[i] > rounds / 100);
}

/* Any of several terms makes a splat soft, by its largest mark; lines have no attributes. */
static void any_term_will_do(void **state)
{
    struct spl_dataset_info info = describe();
    (void)state;
    for (int round = 0; round < rounds; round++) {
        struct codes c[2];
        make_codes(&c[0], SPL_STREAM_UINT, false);
        make_codes(&c[1], SPL_STREAM_STEPS, false);
        c[1].chunk.count = c[0].chunk.count = 60;
        uint32_t page[300] = {0}, count = spl_stream_words(c[0].width, 60);
        c[0].chunk.geometry_word = (uint32_t)-(int32_t)spl_chunk_words(&c[0].chunk);
        memcpy(page, c[0].words, count * sizeof *page);
        memcpy(page + count, c[1].words, spl_stream_words(c[1].width, 60) * sizeof *page);
        struct spl_soft_params soft = {.what.count = 1 + (uint32_t)(uniform() * SPL_TERMS_MAX)};
        for (uint32_t t = 0; t < soft.what.count; t++) {
            double at = (t % 2 ? 100 : 40) * (uniform() - 0.5);
            soft.what.terms[t] = term_of(info.streams[t % 2].name, at, at + 12 * uniform());
        }
        struct spl_marks marks = {.count = soft.what.count, .streams = streams};
        assert_int_equal(spl_marks_resolve(&soft, &info, marks.terms, NULL), SPL_OK);
        spl_marks_find_numbers(&marks);
        uint32_t bases[2] = {c[0].base, c[1].base};
        uint8_t widths[2] = {c[0].width, c[1].width};
        struct spl_tables tables = {.chunks = &c[0].chunk, .chunk_count = 1, .stream_count = 2};
        for (int s = 0; s < 2; s++) {
            tables.base[s] = &bases[s];
            tables.width[s] = &widths[s];
        }
        struct spl_marks_chunk judged;
        spl_marks_judge(&marks, NULL, &tables, 0, NULL, &judged);
        for (uint32_t i = 0; i < 60; i++) {
            bool soft_one = false;
            for (uint32_t t = 0; t < soft.what.count; t++) {
                uint32_t s = t % 2;
                double value =
                    spl_stream_decode(&streams[s], (struct spl_stream_code){bases[s], widths[s]}, c[s].words, i);
                soft_one |= reference_share(&soft.what.terms[t], 0, value) >= 0;
            }
            uint32_t mark = judged.test_words ? reference_mark(judged.tests, 0, page, i, (float[3]){0})
                            : judged.soft     ? SPL_MARK_WHOLE
                                              : 0;
            assert_int_equal(mark, soft_one ? SPL_MARK_WHOLE : 0);
        }
        c[0].chunk.extra_bits = SPL_CHUNK_LINES << SPL_EXTRA_KIND | 1u << SPL_EXTRA_LINES;
        spl_marks_judge(&marks, NULL, &tables, 0, NULL, &judged);
        assert_true(judged.solid && !judged.soft && !judged.test_words);
    }
}

/* Quantiles and shares become values; what a dataset cannot answer is refused by its attribute's name. */
static void terms_meet_their_dataset(void **state)
{
    struct spl_dataset_info info = describe(), bare = {.id = "bare"};
    struct spl_marks_term ends[SPL_TERMS_MAX];
    struct spl_soft_params soft = {.what.count = 1, .blend = 0.125};
    struct spl_error err = {0};
    (void)state;
    soft.what.terms[0] = term_of("height", 0.5, 0.995);
    soft.what.terms[0].measure = SPL_TERM_QUANTILE;
    assert_int_equal(spl_marks_resolve(&soft, &info, ends, &err), SPL_OK);
    assert_true(ends[0].least == 32 && fabs(ends[0].most - (63.5 + 36.5 / 2)) < 1e-9);
    assert_true(ends[0].blend_least == 8 && fabs(ends[0].blend_most - (ends[0].most - 0.87 * 64)) < 1e-9);
    soft.what.terms[0] = term_of("uncertainty", 0.4, INFINITY);
    assert_int_equal(spl_marks_resolve(&soft, &info, ends, &err), SPL_OK);
    assert_true(ends[0].least == 0.4 * 63.5 && isinf(ends[0].most) && ends[0].blend_least == 0.125 * 63.5);
    info.stream_values = NULL; /* as of a file of before: plain values are left */
    assert_int_equal(spl_marks_resolve(&soft, &info, NULL, &err), SPL_E_INPUT);
    assert_string_equal(err.field, "soft");
    assert_non_null(strstr(err.message, "uncertainty"));
    soft.what.terms[0].measure = SPL_TERM_QUANTILE;
    snprintf(soft.what.terms[0].name, sizeof soft.what.terms[0].name, "height");
    err = (struct spl_error){0};
    assert_int_equal(spl_marks_resolve(&soft, &info, NULL, &err), SPL_E_INPUT);
    assert_non_null(strstr(err.message, "'height'"));
    soft.what.terms[0].measure = SPL_TERM_ATTRIBUTE;
    assert_int_equal(spl_marks_resolve(&soft, &info, NULL, NULL), SPL_OK);
    snprintf(soft.what.terms[0].name, sizeof soft.what.terms[0].name, "depth");
    err = (struct spl_error){0};
    assert_int_equal(spl_marks_resolve(&soft, &info, NULL, &err), SPL_E_INPUT);
    assert_string_equal(err.field, "soft");
    assert_non_null(strstr(err.message, "no attribute 'depth': it has class, height, uncertainty, and any has x, y, z, "
                                        "box:, polygon:, plane: and axis:"));
    err = (struct spl_error){0};
    assert_int_equal(spl_marks_resolve(&soft, &bare, NULL, &err), SPL_E_INPUT);
    assert_non_null(strstr(err.message, "it has none"));
    assert_null(strstr(err.message, "--keep"));
    snprintf(soft.what.terms[0].name, sizeof soft.what.terms[0].name, "return_number");
    err = (struct spl_error){0};
    assert_int_equal(spl_marks_resolve(&soft, &bare, NULL, &err), SPL_E_INPUT);
    assert_non_null(strstr(err.message, "same value everywhere is packed only where --keep names it"));
    snprintf(soft.what.terms[0].name, sizeof soft.what.terms[0].name, "depth");
    snprintf(info.streams[1].type, sizeof info.streams[1].type, "later"); /* a type that nobody knows yet */
    soft.what.terms[0] = term_of("height", 0, 1);
    assert_int_equal(spl_marks_resolve(&soft, &info, NULL, NULL), SPL_E_INPUT);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test_setup(numbers_are_as_they_decode, seed),
        cmocka_unit_test_setup(shapes_are_as_far_as_they_are, seed),
        cmocka_unit_test_setup(any_term_will_do, seed),
        cmocka_unit_test_setup(terms_meet_their_dataset, seed),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
