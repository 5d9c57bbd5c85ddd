/* The chunk codec under its bounds, and at the edges of what a chunk can hold. */
#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdlib.h>
#include <string.h>

#include <cmocka.h>

#include "dataset/bits.h"
#include "dataset/chunk_clip.h"
#include "geom/octahedral.h"
#include "geom/tangent.h"

static const struct spl_chunk_options defaults = {.position_error = 0.016,
                                                  .normal_error = M_PI / 180,
                                                  .radius_error = 0.05};

static uint32_t random_state;

static double uniform(void) /* [0, 1) */
{
    random_state = random_state * 1664525u + 1013904223u;
    return (random_state >> 8) * 0x1p-24;
}

struct sample {
    struct spl_splat splats[SPL_CHUNK_SPLATS];
    double position[SPL_CHUNK_SPLATS][3];
    uint32_t count;
};

static const double (*constant(const struct sample *s))[3]
{
    return (const double(*)[3])s->position;
}

static void set_normal(struct spl_splat *splat, double x, double y, double z)
{
    double length = sqrt(x * x + y * y + z * z);
    splat->normal[0] = (float)(x / length);
    splat->normal[1] = (float)(y / length);
    splat->normal[2] = (float)(z / length);
}

/* Splats on a square sheet of edge `extent` and given thickness; normals within `spread` of `toward`. */
static void make_sheet(struct sample *s, uint32_t count, double extent, double thickness, double radius, double spread,
                       const double toward[3])
{
    *s = (struct sample){.count = count};
    for (uint32_t i = 0; i < count; i++) {
        struct spl_splat *splat = &s->splats[i];
        s->position[i][0] = extent * (3.7 + uniform());
        s->position[i][1] = extent * (11.1 + uniform());
        s->position[i][2] = extent * 0.9 + thickness * uniform();
        set_normal(splat, toward[0] + spread * (2 * uniform() - 1), toward[1] + spread * (2 * uniform() - 1),
                   toward[2] + spread * (2 * uniform() - 1) + 1e-9);
        splat->radius = (float)(radius * (1 + uniform()));
        for (int c = 0; c < 3; c++)
            splat->color[c] = (uint8_t)(uniform() * 256);
    }
}

static double angle_between(const float a[3], const float b[3])
{
    double chord = 0;
    for (int i = 0; i < 3; i++)
        chord += ((double)a[i] - b[i]) * ((double)a[i] - b[i]);
    return 2 * asin(fmin(1, 0.5 * sqrt(chord)));
}

/* Lies in the disc's plane, a few degrees off at most, never more than a step inside. True where there is a line. */
static bool check_clip(const struct spl_clip *in, const struct spl_splat *out)
{
    const float *a = in->direction, *b = out->clip.direction, *n = out->normal;
    bool wanted = (a[0] != 0 || a[1] != 0 || a[2] != 0) && in->offset < 0.9f;
    if (b[0] == 0 && b[1] == 0 && b[2] == 0) {
        assert_true(!wanted && out->clip.offset == 1);
        return false;
    }
    assert_true(a[0] != 0 || a[1] != 0 || a[2] != 0);
    assert_true(fabsf(b[0] * n[0] + b[1] * n[1] + b[2] * n[2]) < 1e-5f);
    assert_true(angle_between(a, b) < 0.13 + 0.06); // a code's half step, and the normal's own error
    assert_true(out->clip.offset >= in->offset - 0.04f && out->clip.offset < in->offset + 0.11f);
    return true;
}

/* Encodes, decodes each splat from a larger page, and checks every promise of the contract. Returns bits a splat. */
static double check_sample(const struct sample *s, const struct spl_chunk_options *options)
{
    uint32_t page[SPL_CHUNK_WORDS_MAX + 7 + SPL_PAGE_TAIL_WORDS];
    memset(page, 0xa5, sizeof page);
    struct spl_chunk chunk;
    struct spl_chunk_error stated;
    uint32_t words = spl_chunk_encode(s->splats, constant(s), s->count, options, &chunk, page + 7, &stated);
    assert_true(words <= SPL_CHUNK_WORDS_MAX);
    for (size_t i = 7 + words; i < sizeof page / sizeof *page; i++)
        assert_int_equal(page[i], 0xa5a5a5a5u);
    chunk.geometry_word = 7;
    assert_int_equal(spl_chunk_words(&chunk), words);
    assert_int_equal(chunk.count, s->count);
    assert_true(chunk.step > 0 && chunk.radius_step > 0 && chunk.normal_step > 0);

    double position_sum = 0, normal_sum = 0, radius_sum = 0;
    uint32_t linear = 0, clips = 0;
    for (uint32_t i = 0; i < s->count; i++) {
        const struct spl_splat *in = &s->splats[i];
        struct spl_splat out;
        spl_chunk_decode(&chunk, page, i, &out);
        double square = 0;
        for (int a = 0; a < 3; a++)
            square += (out.position[a] - s->position[i][a]) * (out.position[a] - s->position[i][a]);
        position_sum += sqrt(square) / in->radius;
        double angle = angle_between(out.normal, in->normal);
        normal_sum += angle;
        assert_true(angle < 5 * options->normal_error);
        assert_true(fabs(out.radius - in->radius) <= options->radius_error * in->radius * 1.00001);
        radius_sum += in->radius;
        assert_memory_equal(out.color, in->color, 3);
        assert_int_equal(out.linear, in->linear);
        linear += in->linear;
        clips += check_clip(&in->clip, &out);
    }
    assert_true(position_sum <= options->position_error * s->count * 1.00001);
    assert_true(normal_sum <= options->normal_error * s->count * 1.00001);
    assert_true(fabs(position_sum - stated.position_over_radius) <= 1e-5 * position_sum + 1e-12);
    assert_true(fabs(normal_sum - stated.normal_radians) <= 1e-3 * normal_sum + 1e-6);
    assert_true(fabs(chunk.radius_mean - radius_sum / s->count) <= 1e-6 * chunk.radius_mean);

    assert_int_equal(spl_chunk_count_linear(&chunk, page + spl_chunk_color_word(&chunk) - SPL_LINEAR_WORDS), linear);
    assert_int_equal(spl_clip_count(&chunk), clips);

    uint64_t bits[SPL_ATTRIBUTE_COUNT] = {0}, all = 0;
    spl_chunk_add_bits(&chunk, bits);
    for (int a = 0; a < SPL_ATTRIBUTE_COUNT; a++)
        all += bits[a];
    assert_int_equal(all, 32 * words + 8 * SPL_CHUNK_BYTES);
    return (double)(bits[SPL_ATTRIBUTE_POSITION] + bits[SPL_ATTRIBUTE_NORMAL] + bits[SPL_ATTRIBUTE_RADIUS] +
                    bits[SPL_ATTRIBUTE_COLOR]) /
           s->count;
}

static void test_random(void **state)
{
    (void)state;
    static const double up[3] = {0, 0, 1};
    struct sample s;
    for (uint32_t round = 0; round < 300; round++) {
        random_state = round + 1;
        uint32_t count = 1 + (uint32_t)(uniform() * SPL_CHUNK_SPLATS);
        double extent = exp2(20 * uniform() - 12), radius = extent * exp2(-8 * uniform());
        make_sheet(&s, count, extent, extent * exp2(-16 * uniform()), radius, 2 * uniform(), up);
        check_sample(&s, &defaults);
        check_sample(&s, &(struct spl_chunk_options){.position_error = 0.1, .normal_error = 0.1, .radius_error = 0.2});
        check_sample(
            &s, &(struct spl_chunk_options){.position_error = 0.001, .normal_error = 0.001, .radius_error = 0.001});
    }
}

/* A wall of a scan: the splats of a square grid, jittered, with eq. 20's radius. */
static void test_wall_is_cheap(void **state)
{
    (void)state;
    static const double toward[3] = {0.6, -0.3, 0.2};
    struct sample s;
    random_state = 5;
    make_sheet(&s, SPL_CHUNK_SPLATS, 11.3 * 0.01, 0.001, 0.0113, 0.05, toward);
    for (uint32_t i = 0; i < s.count; i++)
        for (int c = 0; c < 3; c++)
            s.splats[i].color[c] = (uint8_t)(120 + 10 * c + uniform() * 12);
    double bits = check_sample(&s, &defaults);
    assert_true(bits < 50);
}

static void test_one_and_equal(void **state)
{
    (void)state;
    static const double down[3] = {0, 0, -1};
    struct sample s;
    random_state = 3;
    make_sheet(&s, 1, 1, 1, 0.01, 0.5, down);
    assert_true(check_sample(&s, &defaults) == 0);
    s.count = SPL_CHUNK_SPLATS;
    for (uint32_t i = 1; i < s.count; i++) {
        s.splats[i] = s.splats[0];
        memcpy(s.position[i], s.position[0], sizeof s.position[i]);
    }
    assert_true(check_sample(&s, &defaults) == 0);
    for (int a = 0; a < 3; a++) /* two points a metre apart: the codes lie at the cells' far corners */
        s.position[1][a] += 1;
    s.count = 2;
    check_sample(&s, &defaults);
}

/* 24 bits an axis are the end: the step grows, everything stays finite and within the step. */
static void test_absurd_extent(void **state)
{
    (void)state;
    static const double up[3] = {0, 0, 1};
    struct sample s;
    random_state = 9;
    make_sheet(&s, SPL_CHUNK_SPLATS, 1e9, 1e9, 1e-30, 0.1, up);
    uint32_t words[SPL_CHUNK_WORDS_MAX];
    struct spl_chunk chunk;
    struct spl_chunk_error error;
    spl_chunk_encode(s.splats, constant(&s), s.count, &defaults, &chunk, words, &error);
    assert_true(isfinite(error.position_over_radius));
    for (uint32_t i = 0; i < s.count; i++) {
        struct spl_splat out;
        spl_chunk_decode(&chunk, words, i, &out);
        for (int a = 0; a < 3; a++)
            assert_true(fabs(out.position[a] - s.position[i][a]) <= 12e9 * 0x1p-23);
        assert_true(out.radius > 0);
    }
}

/* Where the radii span more than 12 bits can tell apart the step grows, and no radius vanishes. */
static void test_radius_spread(void **state)
{
    (void)state;
    static const double up[3] = {0, 0, 1};
    struct sample s;
    random_state = 21;
    make_sheet(&s, SPL_CHUNK_SPLATS, 1, 0, 1e-6, 0.1, up);
    s.splats[77].radius = 100;
    uint32_t words[SPL_CHUNK_WORDS_MAX];
    struct spl_chunk chunk;
    spl_chunk_encode(s.splats, constant(&s), s.count, &defaults, &chunk, words, NULL);
    for (uint32_t i = 0; i < s.count; i++) {
        struct spl_splat out;
        spl_chunk_decode(&chunk, words, i, &out);
        assert_true(out.radius > 0 && fabsf(out.radius - s.splats[i].radius) <= 100 * 0x1p-12f);
    }
}

/* Chunks around each axis, octant, edge and fold of the octahedron, and one with every direction at once. */
static void test_normal_directions(void **state)
{
    (void)state;
    struct sample s;
    for (int x = -1; x <= 1; x++)
        for (int y = -1; y <= 1; y++)
            for (int z = -1; z <= 1; z++) {
                if (!x && !y && !z)
                    continue;
                random_state = (uint32_t)(9 * x + 3 * y + z + 100);
                make_sheet(&s, SPL_CHUNK_SPLATS, 1, 0.1, 0.1, 0.02, (double[3]){x, y, z});
                check_sample(&s, &defaults);
                make_sheet(&s, SPL_CHUNK_SPLATS, 1, 0.1, 0.1, 1.5, (double[3]){x, y, z});
                check_sample(&s, &defaults);
                make_sheet(&s, 1, 1, 0.1, 0.1, 0, (double[3]){x, y, z});
                check_sample(&s, &defaults);
            }
    make_sheet(&s, SPL_CHUNK_SPLATS, 1, 0.1, 0.1, 1, (double[3]){0, 0, 0});
    for (int i = 0; i < 6; i++) {
        double axis[3] = {0};
        axis[i / 2] = i % 2 ? -1 : 1;
        set_normal(&s.splats[i], axis[0], axis[1], axis[2]);
    }
    check_sample(&s, &defaults);
}

/* None and all take no word, anything between the mask; the first and the last splat, and those beside a word's end. */
static void test_linear(void **state)
{
    (void)state;
    static const double up[3] = {0, 0, 1};
    static const uint32_t counts[] = {1, 2, 31, 32, 33, 97, SPL_CHUNK_SPLATS};
    struct sample s;
    for (size_t row = 0; row < sizeof counts / sizeof *counts; row++) {
        uint32_t words[SPL_CHUNK_WORDS_MAX], plain;
        struct spl_chunk chunk;
        random_state = 17;
        make_sheet(&s, counts[row], 1, 0.1, 0.01, 0.5, up);
        plain = spl_chunk_encode(s.splats, constant(&s), s.count, &defaults, &chunk, words, NULL);
        assert_int_equal(chunk.geometry_bits >> SPL_GEOMETRY_LINEAR, 0);
        for (uint32_t marked = 0; marked < s.count; marked++) {
            s.splats[marked].linear = true;
            check_sample(&s, &defaults);
            uint32_t used = spl_chunk_encode(s.splats, constant(&s), s.count, &defaults, &chunk, words, NULL);
            assert_int_equal(used, plain + (s.count > 1 ? SPL_LINEAR_WORDS : 0));
            s.splats[marked].linear = false;
        }
        for (uint32_t i = 0; i < s.count; i++)
            s.splats[i].linear = true;
        check_sample(&s, &defaults);
        assert_int_equal(spl_chunk_encode(s.splats, constant(&s), s.count, &defaults, &chunk, words, NULL), plain);
        assert_int_equal(chunk.geometry_bits >> SPL_GEOMETRY_LINEAR, SPL_LINEAR_ALL);
    }
}

/* Directions all around normals all around, every offset; and what a forged mask names has no line. */
static void test_clip_lines(void **state)
{
    (void)state;
    static const uint32_t counts[] = {1, 33, SPL_CHUNK_SPLATS};
    struct sample s;
    for (int row = 0; row < 60; row++) {
        double up[3] = {uniform() - 0.5, uniform() - 0.5, row % 3 ? uniform() - 0.5 : 4};
        double length = sqrt(up[0] * up[0] + up[1] * up[1] + up[2] * up[2]);
        for (int c = 0; c < 3; c++)
            up[c] /= length;
        make_sheet(&s, counts[row % 3], 1, 0.1, 0.01, 0.5, up);
        for (uint32_t i = 0; i < s.count; i++) {
            struct spl_splat *splat = &s.splats[i];
            float u[3], v[3];
            double angle = 2 * M_PI * uniform();
            spl_tangent_frame(splat->normal, u, v);
            for (int c = 0; c < 3 && (row < 3 || i % 3 == 0); c++)
                splat->clip.direction[c] = (float)(cos(angle) * u[c] + sin(angle) * v[c]);
            splat->clip.offset = (float)(1.2 * uniform() - 0.01);
        }
        check_sample(&s, &defaults);
    }
    uint32_t words[SPL_CHUNK_WORDS_MAX];
    struct spl_chunk chunk;
    struct spl_splat out;
    spl_chunk_encode(s.splats, constant(&s), s.count, &defaults, &chunk, words, NULL);
    uint32_t count = spl_clip_count(&chunk), with = 0;
    assert_true(count > 0 && count < s.count);
    memset(words + spl_chunk_clip_word(&chunk), 0xff, SPL_LINEAR_WORDS * sizeof *words);
    for (uint32_t i = 0; i < s.count; i++) {
        spl_chunk_decode(&chunk, words, i, &out);
        with += out.clip.offset < 1;
    }
    assert_int_equal(with, count);
}

static void test_zero_normal(void **state)
{
    (void)state;
    struct sample s;
    make_sheet(&s, 4, 1, 1, 0.1, 0.1, (double[3]){0, 0, 1});
    memset(s.splats[2].normal, 0, sizeof s.splats[2].normal);
    uint32_t words[SPL_CHUNK_WORDS_MAX];
    struct spl_chunk chunk;
    spl_chunk_encode(s.splats, constant(&s), s.count, &defaults, &chunk, words, NULL);
    struct spl_splat out;
    spl_chunk_decode(&chunk, words, 2, &out);
    assert_true(fabs(hypot(hypot(out.normal[0], out.normal[1]), out.normal[2]) - 1) < 1e-6);
}

static void test_octahedral(void **state)
{
    (void)state;
    random_state = 77;
    for (int round = 0; round < 20000; round++) {
        struct spl_splat splat;
        set_normal(&splat, uniform() - 0.5, uniform() - 0.5, round % 8 ? uniform() - 0.5 : 0);
        for (unsigned turn = 0; turn < 6; turn++) {
            float local[3], back[3], u, v;
            spl_octahedral_turn(splat.normal, turn % 3, turn >= 3, local);
            spl_octahedral_encode(local, &u, &v);
            assert_true(fabsf(u) <= 1 && fabsf(v) <= 1);
            spl_octahedral_decode(u, v, back);
            assert_true(angle_between(local, back) < 1e-5);
            spl_octahedral_turn_back(local, turn % 3, turn >= 3, back);
            assert_memory_equal(back, splat.normal, sizeof back);
        }
    }
    float pole[3];
    for (int corner = 0; corner < 4; corner++) { /* the folded pole, and codes that rounded past the border */
        spl_octahedral_decode(corner & 1 ? 1.001f : -1.001f, corner & 2 ? 1.001f : -1.001f, pole);
        assert_true(pole[2] < -0.99f);
    }
}

static void test_color_is_lossless(void **state)
{
    (void)state;
    static const double up[3] = {0, 0, 1};
    struct sample s;
    random_state = 1;
    make_sheet(&s, SPL_CHUNK_SPLATS, 1, 0, 0.1, 0, up);
    for (uint32_t round = 0; round < 400; round++) { /* every part of the cube, every other time with its corners */
        uint32_t start = round / 2 * 79784;
        for (uint32_t i = 0; i < s.count; i++) {
            uint32_t rgb = round % 2 && i < 8 ? (i & 1 ? 0xff : 0) | (i & 2 ? 0xff00 : 0) | (i & 4 ? 0xff0000 : 0)
                                              : (start + i * 623) & 0xffffff;
            for (int c = 0; c < 3; c++)
                s.splats[i].color[c] = (uint8_t)(rgb >> 8 * c);
        }
        check_sample(&s, &defaults);
    }
}

/* Fields of every width at every place of a word come back, and a pad begins the next word. */
static void test_bits(void **state)
{
    (void)state;
    enum { count = 3000 };
    static uint32_t words[count + 1];
    uint32_t value[count], width[count], at = 0;
    struct spl_bit_writer writer = {.words = words};
    random_state = 5;
    for (int i = 0; i < count; i++) {
        width[i] = (uint32_t)(uniform() * 33);
        value[i] = spl_bits_part((uint32_t)(uniform() * 0x1p32), 0, width[i]);
        spl_bits_put(&writer, value[i], width[i]);
        if (i % 100 == 99)
            spl_bits_pad(&writer);
    }
    for (int i = 0; i < count; i++) {
        assert_int_equal(spl_bits_get(words, at, width[i]), value[i]);
        at += width[i];
        if (i % 100 == 99)
            at = (at + 31) / 32 * 32;
    }
    assert_int_equal(writer.used, at / 32);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_random),
        cmocka_unit_test(test_wall_is_cheap),
        cmocka_unit_test(test_one_and_equal),
        cmocka_unit_test(test_absurd_extent),
        cmocka_unit_test(test_radius_spread),
        cmocka_unit_test(test_normal_directions),
        cmocka_unit_test(test_linear),
        cmocka_unit_test(test_clip_lines),
        cmocka_unit_test(test_zero_normal),
        cmocka_unit_test(test_octahedral),
        cmocka_unit_test(test_color_is_lossless),
        cmocka_unit_test(test_bits),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
