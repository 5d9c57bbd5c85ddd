/* Coding of chunks: settings that are refused, the pursuit against a plain search, weights on their grids, bits as
 * stated, lambda, textures without content, memory. */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <cmocka.h>
#include <math.h>

#include "base/memory.h"
#include "sparse/beam.h"
#include "sparse/blas.h"
#include "sparse/code.h"
#include "sparse/pursuit.h"
#include "unit/sparse/plant.h"

static const struct spl_code_settings paper = {.atoms = 8, .psnr = 40, .weight_bits = 4};

struct coded {
    struct spl_chunk_code code;
    struct spl_code_sums sums;
    uint8_t mean[SPL_CHUNK_SPLATS][3];
};

static void code_textures(const struct spl_coder *coder, const struct plant *p, uint32_t splats, struct coded *out)
{
    const uint8_t *texture[SPL_CHUNK_SPLATS];
    struct spl_error err = {0};
    memset(out, 0, sizeof *out);
    for (uint32_t i = 0; i < splats; i++)
        texture[i] = p->textures + (size_t)i * p->n;
    assert_int_equal(spl_coder_code(coder, texture, splats, out->mean, &out->code, &out->sums, &err), 0);
}

static struct spl_coder *make_coder(const struct spl_dictionary *d, const struct spl_code_settings *s)
{
    struct spl_error err = {0};
    struct spl_coder *coder = spl_coder_create(d, s, 1 << 24, 2, &err);
    if (!coder)
        fail_msg("%s", err.message);
    return coder;
}

/* Squared error of splat i's texture decoded with `atoms` atoms. */
static double decoded_error(const struct plant *p, const struct spl_dictionary *d, const struct coded *c, uint32_t i,
                            uint32_t atoms)
{
    float colour[3], out[SPL_TEXTURE_VALUES_MAX];
    double sum = 0;
    for (int k = 0; k < 3; k++)
        colour[k] = c->mean[i][k] / 255.0f;
    spl_code_decode(d, c->code.plane, &c->code.splat[i], atoms, colour, out);
    for (uint32_t k = 0; k < p->n; k++) {
        double off = (double)out[k] - p->textures[(size_t)i * p->n + k] / 255.0;
        sum += off * off;
    }
    return sum;
}

static void expect_refused(const struct spl_dictionary *d, struct spl_code_settings s, uint64_t memory, int code,
                           const char *said)
{
    struct spl_error err = {0};
    assert_null(spl_coder_create(d, &s, memory, 1, &err));
    assert_int_equal(err.code, code);
    if (!strstr(err.message, said))
        fail_msg("%s does not say %s", err.message, said);
}

static void test_refuses(void **state)
{
    struct plant p = plant_make(2, 3, 1, 1, 0.5f);
    struct spl_dictionary d = plant_dictionary(&p);
    struct spl_code_settings s = paper;
    (void)state;
    s.atoms = 9;
    expect_refused(&d, s, 1 << 20, SPL_E_USAGE, "atoms");
    s = paper;
    s.weight_bits = 0;
    expect_refused(&d, s, 1 << 20, SPL_E_USAGE, "weight_bits");
    s.weight_bits = 9;
    expect_refused(&d, s, 1 << 20, SPL_E_USAGE, "weight_bits");
    s = paper;
    s.psnr = NAN;
    expect_refused(&d, s, 1 << 20, SPL_E_USAGE, "psnr");
    s = paper;
    s.lambda = NAN;
    expect_refused(&d, s, 1 << 20, SPL_E_USAGE, "lambda");
    s.lambda = -1;
    expect_refused(&d, s, 1 << 20, SPL_E_USAGE, "lambda");
    expect_refused(&d, paper, 100, SPL_E_LIMIT, "100");
    d.scale[1] = NAN;
    expect_refused(&d, paper, 1 << 20, SPL_E_USAGE, "atom 1");
    d.scale[1] = 0.5f;
    expect_refused(&d, paper, 1 << 20, SPL_E_USAGE, "atom 1");
    d.size = 33;
    expect_refused(&d, paper, 1 << 20, SPL_E_USAGE, "33");
    spl_dictionary_finish(&d);
    plant_finish(&p);
}

static void test_steps(void **state)
{
    (void)state;
    assert_float_equal(spl_code_step(56), 1, 0);
    assert_float_equal(spl_code_step(52), 0.5, 0);
    for (int i = 1; i < SPL_CODE_STEPS; i++)
        assert_true(spl_code_step((uint8_t)i) > spl_code_step((uint8_t)(i - 1)));
}

/* The smallest squared error of y less one atom with any weight of its plane. */
static double search_one(const struct spl_dictionary *d, const struct spl_code_plane *plane, const double *y,
                         uint32_t n)
{
    double best = INFINITY;
    for (uint32_t a = 0; a < d->count; a++)
        for (int w = -(1 << (plane->weight_bits - 1)); w < 1 << (plane->weight_bits - 1); w++) {
            double weight = (double)spl_code_weight(plane, (int16_t)w) * (double)d->scale[a], sum = 0;
            for (uint32_t k = 0; k < n; k++) {
                double off = y[k] - weight * d->texels[(size_t)a * n + k];
                sum += off * off;
            }
            best = sum < best ? sum : best;
        }
    return best;
}

/* Each atom is the best there is for the residual that the quantised ones before it left; later atoms may settle
 * earlier weights, which can only be better. */
static void check_against_search(uint64_t memory_bytes)
{
    struct plant p = plant_make(4, 20, 40, 4, 0.7f);
    struct spl_dictionary d = plant_dictionary(&p);
    for (uint32_t atoms = 1; atoms <= 3; atoms++) {
        struct spl_code_settings s = {.atoms = atoms, .weight_bits = 3};
        struct spl_error err = {0};
        struct spl_coder *coder = spl_coder_create(&d, &s, memory_bytes, 1, &err);
        struct coded c;
        int worse = 0;
        assert_non_null(coder);
        code_textures(coder, &p, 40, &c);
        for (uint32_t i = 0; i < 40; i++) {
            struct spl_splat_code *splat = &c.code.splat[i], before = *splat;
            assert_int_equal(splat->count, atoms);
            before.count--;
            float mean[3] = {0}, left[48];
            double y[48];
            for (uint32_t k = 0; k < p.n; k++)
                mean[k / 16] += p.textures[(size_t)i * p.n + k] / 255.0f / 16;
            spl_code_decode(&d, c.code.plane, &before, 8, mean, left);
            for (uint32_t k = 0; k < p.n; k++)
                y[k] = p.textures[(size_t)i * p.n + k] / 255.0 - (double)left[k];
            double best = search_one(&d, &c.code.plane[atoms - 1], y, p.n), got = decoded_error(&p, &d, &c, i, 8);
            if (atoms == 1)
                assert_true(fabs(got - best) < 1e-3); /* means are rounded to bytes in `got` */
            worse += got > 1.01 * best + 1e-3;
        }
        assert_true(worse <= 2); /* settling moved the weights that `best` was sought beside */
        spl_coder_destroy(coder);
    }
    spl_dictionary_finish(&d);
    plant_finish(&p);
}

static void test_pursuit_is_search(void **state)
{
    (void)state;
    check_against_search(1 << 24);
    check_against_search(20 * 48 * 4 + 100); /* no room for a Gram matrix */
}

/* With one atom and two bits a weight, every further atom codes what the coarse weights before it left. */
static void test_next_sees_the_quantised(void **state)
{
    struct plant p = plant_make(4, 1, 100, 1, 0.9f);
    struct spl_dictionary d = plant_dictionary(&p);
    struct spl_coder *coder = make_coder(&d, &(struct spl_code_settings){.atoms = 4, .weight_bits = 2});
    struct coded c;
    double first = 0, all = 0;
    (void)state;
    code_textures(coder, &p, 100, &c);
    for (uint32_t i = 0; i < 100; i++) {
        first += decoded_error(&p, &d, &c, i, 1);
        all += decoded_error(&p, &d, &c, i, 8);
    }
    assert_true(all < first / 4);
    assert_int_equal(c.code.plane[0].index_bits, 0);
    spl_coder_destroy(coder);
    spl_dictionary_finish(&d);
    plant_finish(&p);
}

static void check_form(const struct coded *c, const struct spl_dictionary *d)
{
    uint32_t planes = 0, before = SPL_CHUNK_SPLATS;
    uint64_t bits = 0;
    for (uint32_t i = 0; i < c->code.splats; i++) {
        const struct spl_splat_code *splat = &c->code.splat[i];
        planes = splat->count > planes ? splat->count : planes;
        for (uint32_t t = 0; t < splat->count; t++) {
            const struct spl_code_plane *plane = &c->code.plane[t];
            assert_true(splat->atom[t] < d->count && splat->atom[t] >> plane->index_bits == 0);
            assert_true(splat->weight[t] >= -(1 << (plane->weight_bits - 1)));
            assert_true(splat->weight[t] < 1 << (plane->weight_bits - 1));
            assert_float_equal(plane->step, spl_code_step(plane->step_code), 0);
            assert_float_equal(plane->gap, spl_code_gap(plane->gap_code), 0);
        }
    }
    assert_int_equal(c->code.planes, planes);
    for (uint32_t t = 0; t < planes; t++) {
        uint32_t codes = 0;
        for (uint32_t i = 0; i < c->code.splats; i++)
            codes += c->code.splat[i].count > t;
        bits += SPL_TEXTURE_HEADER_BITS + before + codes * (c->code.plane[t].index_bits + c->code.plane[t].weight_bits);
        before = codes;
    }
    assert_int_equal(spl_chunk_code_bits(&c->code), planes ? (bits + 31) / 32 * 32 + SPL_CODE_CHUNK_BITS : 0);
    assert_int_equal(c->sums.bits, spl_chunk_code_bits(&c->code));
}

static void test_sums_are_what_decoding_gives(void **state)
{
    struct plant p = plant_make(4, 60, 128, 3, 0.7f);
    struct spl_dictionary d = plant_dictionary(&p);
    struct spl_coder *coder = make_coder(&d, &paper);
    struct coded c, again;
    double error = 0, plain = 0;
    (void)state;
    code_textures(coder, &p, 128, &c);
    check_form(&c, &d);
    for (uint32_t i = 0; i < 128; i++) {
        double mine = decoded_error(&p, &d, &c, i, 8);
        error += mine;
        plain += decoded_error(&p, &d, &c, i, 0);
        assert_true(c.code.splat[i].count == 8 || mine < p.n * 1.1e-4); /* 40 dB, or no more atoms */
    }
    assert_true(fabs(error / c.sums.squared_error - 1) < 0.01);
    assert_true(fabs(plain / c.sums.plain_error - 1) < 0.001);
    assert_true(c.sums.squared_error < c.sums.plain_error / 50);
    assert_int_equal(c.sums.values, 128 * p.n);
    code_textures(coder, &p, 128, &again);
    assert_memory_equal(c.code.splat, again.code.splat, sizeof c.code.splat);
    spl_coder_destroy(coder);
    spl_dictionary_finish(&d);
    plant_finish(&p);
}

/* The larger lambda, the fewer bits and the larger the error; each setting beats the others at its own price. */
static void test_lambda(void **state)
{
    static const float lambdas[] = {1e-5f, 1e-4f, 1e-3f, 1e-2f, 10};
    struct plant p = plant_make(4, 60, 128, 3, 0.5f);
    struct spl_dictionary d = plant_dictionary(&p);
    double bits[5], error[5];
    (void)state;
    for (int i = 0; i < 5; i++) {
        struct spl_code_settings s = {.atoms = 8, .lambda = lambdas[i], .weight_bits = 6};
        struct spl_coder *coder = make_coder(&d, &s);
        struct coded c;
        code_textures(coder, &p, 128, &c);
        check_form(&c, &d);
        double decoded = 0;
        for (uint32_t k = 0; k < 128; k++)
            decoded += decoded_error(&p, &d, &c, k, 8);
        assert_true(fabs(decoded / c.sums.squared_error - 1) < 0.01);
        bits[i] = (double)c.sums.bits;
        error[i] = c.sums.squared_error;
        spl_coder_destroy(coder);
    }
    for (int i = 1; i < 5; i++) {
        assert_true(bits[i] <= bits[i - 1] && error[i] >= error[i - 1]);
        for (int k = 0; k < 5; k++)
            assert_true(error[i] + (double)lambdas[i] * bits[i] < 1.03 * (error[k] + (double)lambdas[i] * bits[k]));
    }
    assert_int_equal(bits[4], 0);
    assert_true(bits[0] > 0);
    spl_dictionary_finish(&d);
    plant_finish(&p);
}

/* Of a texture that is the sum of two atoms that a third lies between, the greedy pursuit takes the third first; the
 * beam does not. */
static void test_beam(void **state)
{
    struct plant p = plant_make(4, 40, 1, 2, 0.5f);
    uint32_t n = p.n, count = 40;
    float *gram = calloc(count * count, sizeof *gram), *match = calloc(count, sizeof *match), y[48], norm = 0,
          third = 0;
    struct spl_atoms atoms = {.count = count, .n = n, .d = p.atoms, .gram = gram};
    struct spl_splat_code found;
    (void)state;
    for (uint32_t k = 0; k < n; k++) {
        p.atoms[2 * n + k] = p.atoms[k] + p.atoms[n + k] + 0.3f * p.atoms[3 * n + k];
        third += p.atoms[2 * n + k] * p.atoms[2 * n + k];
    }
    for (uint32_t k = 0; k < n; k++) {
        p.atoms[2 * n + k] /= sqrtf(third);
        y[k] = p.atoms[k] + p.atoms[n + k];
        norm += y[k] * y[k];
    }
    for (uint32_t a = 0; a < count; a++) {
        for (uint32_t k = 0; k < n; k++)
            match[a] += p.atoms[a * n + k] * y[k];
        for (uint32_t b = 0; b < count; b++)
            for (uint32_t k = 0; k < n; k++)
                gram[a * count + b] += p.atoms[a * n + k] * p.atoms[b * n + k];
    }
    assert_int_equal(spl_blas_open(NULL), 0);
    assert_true(fabsf(match[2]) > fabsf(match[0]) && fabsf(match[2]) > fabsf(match[1]));
    struct spl_beam *beam = spl_beam_create(&atoms, NULL);
    struct spl_beam_aim aim = {.atoms = 8, .price = 1e-3, .enough = 0};
    assert_true(spl_beam_search(beam, match, (double)norm, &aim, &found) < 1e-4);
    assert_int_equal(found.count, 2);
    assert_int_equal(found.atom[0] + found.atom[1], 1);
    aim.price = 10;
    assert_true(spl_beam_search(beam, match, (double)norm, &aim, &found) == (double)norm);
    assert_int_equal(found.count, 0);
    aim = (struct spl_beam_aim){.atoms = 1};
    spl_beam_search(beam, match, (double)norm, &aim, &found);
    assert_int_equal(found.count, 1);
    assert_int_equal(found.atom[0], 2);
    spl_beam_destroy(beam);
    free(gram);
    free(match);
    plant_finish(&p);
}

static void test_nothing_to_code(void **state)
{
    struct plant p = plant_make(4, 5, 3, 0, 0); /* flat textures */
    struct spl_dictionary d = plant_dictionary(&p), none = {.size = 4}, point = {.size = 1};
    struct spl_coder *coder = make_coder(&d, &paper), *empty = make_coder(&none, &paper),
                     *single = make_coder(&point, &paper);
    const uint8_t *texture[3] = {NULL, p.textures, NULL};
    uint8_t mean[3][3] = {{7, 7, 7}, {0}, {7, 7, 7}};
    struct spl_chunk_code code;
    struct spl_code_sums sums = {0};
    struct spl_error err = {0};
    (void)state;
    assert_int_equal(spl_coder_code(coder, texture, 3, mean, &code, &sums, &err), 0);
    assert_int_equal(code.planes, 0);
    assert_int_equal(sums.bits, 0);
    assert_int_equal(sums.splats, 1);
    assert_int_equal(sums.histogram[0], 1);
    assert_int_equal(mean[0][0], 7);
    assert_int_equal(mean[1][2], 128);
    assert_int_equal(spl_coder_code(empty, texture, 3, mean, &code, &sums, &err), 0);
    assert_int_equal(spl_coder_code(single, texture, 3, mean, &code, &sums, &err),
                     0); /* 3 values: all of it is the mean */
    assert_int_equal(code.planes, 0);
    assert_int_equal(spl_coder_code(coder, texture, 0, mean, &code, &sums, &err), SPL_E_USAGE);
    err = (struct spl_error){0};
    assert_int_equal(spl_coder_code(coder, texture, 129, mean, &code, &sums, &err), SPL_E_USAGE);
    spl_coder_destroy(coder);
    spl_coder_destroy(empty);
    spl_coder_destroy(single);
    spl_coder_destroy(NULL);
    spl_dictionary_finish(&d);
    plant_finish(&p);
}

/* Every allocation that fails is SPL_E_NOMEM, and leaves nothing behind. */
static void test_no_memory(void **state)
{
    struct plant p = plant_make(4, 20, 8, 2, 0.5f);
    struct spl_dictionary d = plant_dictionary(&p);
    struct spl_coder *whole = make_coder(&d, &paper);
    const uint8_t *texture[1] = {p.textures};
    uint8_t mean[1][3];
    struct spl_chunk_code code;
    struct spl_code_sums sums = {0};
    int failures = 0;
    (void)state;
    for (long n = 1;; n++) {
        struct spl_error err = {0};
        spl_memory_fail_after(n);
        struct spl_coder *coder = spl_coder_create(&d, &paper, 1 << 24, 1, &err);
        bool reached = coder && spl_coder_code(whole, texture, 1, mean, &code, &sums, &err) == 0;
        spl_memory_fail_after(0);
        spl_coder_destroy(coder);
        if (reached)
            break;
        assert_int_equal(err.code, SPL_E_NOMEM);
        failures++;
    }
    assert_true(failures >= 5);
    spl_coder_destroy(whole);
    spl_dictionary_finish(&d);
    plant_finish(&p);
}

/* Of every length up to several runs, with equals and zeroes among them. */
static void test_two_best_are_those_of_a_plain_search(void **state)
{
    (void)state;
    float match[3 * SPL_PURSUIT_RUN + 5], largest[4];
    uint32_t seed = 7;
    for (uint32_t count = 1; count <= sizeof match / sizeof *match; count++) {
        const struct spl_atoms atoms = {.count = count};
        const struct spl_block block = {.atoms = &atoms, .match = match};
        uint32_t best = 0;
        float second = 0, found, run_best = 0;
        for (uint32_t i = 0; i < count; i++) {
            seed = seed * 1664525 + 1013904223;
            match[i] = (float)(seed >> 24) - (count % 3 ? 128 : 0); /* equals are frequent */
            match[i] = count % 7 ? match[i] : 0;
        }
        for (uint32_t i = 1; i < count; i++)
            best = fabsf(match[i]) > fabsf(match[best]) ? i : best;
        for (uint32_t i = 0; i < count; i++)
            second = i != best ? fmaxf(second, fabsf(match[i])) : second;
        assert_int_equal(spl_block_best_two(&block, 0, &found), best);
        assert_true(found == second);
        assert_int_equal(spl_block_best(&block, 0, 0, count), best);
        uint32_t runs = spl_largest_magnitudes(match, count, largest);
        assert_int_equal(runs, (count + SPL_PURSUIT_RUN - 1) / SPL_PURSUIT_RUN);
        for (uint32_t i = 0; i < runs; i++)
            run_best = fmaxf(run_best, largest[i]);
        assert_true(run_best == fabsf(match[best]));
    }
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_two_best_are_those_of_a_plain_search),
        cmocka_unit_test(test_refuses),
        cmocka_unit_test(test_steps),
        cmocka_unit_test(test_pursuit_is_search),
        cmocka_unit_test(test_next_sees_the_quantised),
        cmocka_unit_test(test_sums_are_what_decoding_gives),
        cmocka_unit_test(test_lambda),
        cmocka_unit_test(test_beam),
        cmocka_unit_test(test_nothing_to_code),
        cmocka_unit_test(test_no_memory),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
