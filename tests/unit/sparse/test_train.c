/* Training: what is refused, planted atoms that must be found again, the same bytes for a seed, memory, little data,
 * failures. */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <cmocka.h>

#include "base/memory.h"
#include "sparse/train.h"
#include "unit/sparse/plant.h"

static const struct spl_train_settings usual = {
    .dictionary = 24, .atoms = 3, .epochs = 15, .seed = 7, .memory_bytes = 64 << 20, .threads = 2};

struct seen {
    uint32_t epochs, end_at;
    struct spl_train_progress first, last;
};

static bool see(void *context, const struct spl_train_progress *progress)
{
    struct seen *seen = context;
    if (!seen->epochs++)
        seen->first = *progress;
    assert_int_equal(progress->epoch, seen->epochs);
    seen->last = *progress;
    return seen->epochs != seen->end_at;
}

static struct spl_dictionary train(struct plant *p, const struct spl_train_settings *s, struct seen *seen)
{
    struct spl_dictionary d = {0};
    struct spl_error err = {0};
    if (spl_dictionary_train(plant_source(p), s, seen ? see : NULL, seen, &d, &err))
        fail_msg("%s", err.message);
    return d;
}

/* How many planted atoms are in the dictionary, up to sign. */
static uint32_t found_again(const struct plant *p, const struct spl_dictionary *d)
{
    uint32_t found = 0;
    for (uint32_t a = 0; a < p->count; a++) {
        float best = 0;
        for (uint32_t k = 0; k < d->count; k++) {
            float dot = 0;
            for (uint32_t i = 0; i < p->n; i++)
                dot += p->atoms[(size_t)a * p->n + i] * d->scale[k] * (float)d->texels[(size_t)k * p->n + i];
            best = fmaxf(best, fabsf(dot));
        }
        found += best > 0.97f;
    }
    return found;
}

static void expect_refused(struct spl_train_settings s, uint32_t size, int code, const char *field)
{
    struct plant p = plant_make(4, 5, 2000, 2, 0.5f);
    struct spl_dictionary d = {0};
    struct spl_error err = {0};
    p.source.size = size;
    assert_int_equal(spl_dictionary_train(plant_source(&p), &s, NULL, NULL, &d, &err), code);
    assert_string_equal(err.field, field);
    assert_null(d.texels);
    plant_finish(&p);
}

static void test_refuses(void **state)
{
    struct spl_train_settings s = usual;
    (void)state;
    s.dictionary = 0;
    expect_refused(s, 4, SPL_E_USAGE, "dictionary");
    s.dictionary = SPL_DICTIONARY_MAX + 1;
    expect_refused(s, 4, SPL_E_USAGE, "dictionary");
    s = usual;
    s.atoms = 0;
    expect_refused(s, 4, SPL_E_USAGE, "atoms");
    s = usual;
    s.psnr = NAN;
    expect_refused(s, 4, SPL_E_USAGE, "psnr");
    s = usual;
    s.lambda = NAN;
    expect_refused(s, 4, SPL_E_USAGE, "lambda");
    s = usual;
    s.seconds = NAN;
    expect_refused(s, 4, SPL_E_USAGE, "seconds");
    expect_refused(usual, 0, SPL_E_USAGE, "size");
    expect_refused(usual, 33, SPL_E_USAGE, "size");
    s = usual;
    s.memory_bytes = 1000;
    expect_refused(s, 4, SPL_E_LIMIT, "memory");
    s.memory_bytes = 150000;
    expect_refused(s, 4, SPL_E_LIMIT, "memory");
}

static void check_recovers(enum spl_train_method method)
{
    struct plant p = plant_make(4, 16, 4000, 3, 0.7f);
    struct spl_train_settings s = usual;
    struct seen seen = {0};
    s.method = method;
    struct spl_dictionary d = train(&p, &s, &seen);
    assert_int_equal(d.size, 4);
    assert_true(found_again(&p, &d) >= 15);
    assert_true(seen.last.psnr > seen.first.psnr + 3 && seen.last.psnr > 38);
    assert_true(seen.last.sample == 4000 && seen.last.atoms_per_splat <= 3 && seen.last.seconds > 0);
    spl_dictionary_finish(&d);
    plant_finish(&p);
}

static void test_finds_planted_atoms(void **state)
{
    (void)state;
    check_recovers(SPL_TRAIN_BATCHES);
    check_recovers(SPL_TRAIN_KSVD);
}

static void assert_same(const struct spl_dictionary *a, const struct spl_dictionary *b, bool same)
{
    bool equal = a->count == b->count && !memcmp(a->scale, b->scale, a->count * sizeof *a->scale) &&
                 !memcmp(a->texels, b->texels, (size_t)a->count * spl_texture_values(a->size));
    assert_int_equal(equal, same);
}

static void test_same_for_a_seed(void **state)
{
    struct plant p = plant_make(4, 16, 3000, 3, 0.7f);
    (void)state;
    for (int method = SPL_TRAIN_BATCHES; method <= SPL_TRAIN_KSVD; method++) {
        struct spl_train_settings s = usual;
        s.method = method;
        s.epochs = 4;
        struct spl_dictionary a = train(&p, &s, NULL);
        s.threads = 1;
        struct spl_dictionary b = train(&p, &s, NULL);
        s.threads = 5;
        struct spl_dictionary c = train(&p, &s, NULL);
        s.seed++;
        struct spl_dictionary other = train(&p, &s, NULL);
        assert_same(&a, &b, true);
        assert_same(&a, &c, true);
        assert_same(&a, &other, false);
        spl_dictionary_finish(&a);
        spl_dictionary_finish(&b);
        spl_dictionary_finish(&c);
        spl_dictionary_finish(&other);
    }
    plant_finish(&p);
}

/* A scene of twelve patterns stores about twelve, whatever was allowed. */
static void test_count_adapts(void **state)
{
    struct plant p = plant_make(4, 12, 6000, 1, 0.7f);
    struct spl_train_settings s = usual;
    struct seen seen = {0};
    (void)state;
    s.dictionary = 200;
    s.lambda = 1e-3f;
    s.epochs = 30;
    struct spl_dictionary d = train(&p, &s, &seen);
    assert_true(d.count >= 12 && d.count <= 20);
    assert_true(found_again(&p, &d) >= 11);
    spl_dictionary_finish(&d);
    plant_finish(&p);
}

/* Of 768 values a texture these need 40: the training works on main axes, and its atoms code as well as the planted
 * ones. */
static void test_large_textures(void **state)
{
    struct plant p = plant_make(16, 40, 1500, 2, 3);
    struct spl_train_settings s = usual;
    struct seen seen = {0};
    (void)state;
    s.dictionary = 64;
    struct spl_dictionary d = train(&p, &s, &seen);
    assert_true(found_again(&p, &d) >= 28);
    assert_true(seen.last.psnr > 35);
    spl_dictionary_finish(&d);
    plant_finish(&p);
}

static void test_little_data(void **state)
{
    struct plant none = plant_make(4, 1, 0, 0, 0), flat = plant_make(4, 1, 700, 0, 0),
                 few = plant_make(4, 3, 5, 1, 0.5f), point = plant_make(1, 1, 50, 1, 0.5f);
    (void)state;
    struct spl_dictionary a = train(&none, &usual, NULL), b = train(&flat, &usual, NULL), c = train(&few, &usual, NULL),
                          d = train(&point, &usual, NULL);
    assert_int_equal(a.count, 0);
    assert_int_equal(a.size, 4);
    assert_int_equal(b.count, 0);
    assert_true(c.count >= 1 && c.count <= 5);
    assert_int_equal(d.count, 0);
    spl_dictionary_finish(&a);
    spl_dictionary_finish(&b);
    spl_dictionary_finish(&c);
    spl_dictionary_finish(&d);
    plant_finish(&none);
    plant_finish(&flat);
    plant_finish(&few);
    plant_finish(&point);
}

static void test_memory_cuts_the_sample(void **state)
{
    struct plant p = plant_make(4, 16, 20000, 3, 0.7f);
    struct spl_train_settings s = usual;
    struct seen whole = {0}, cut = {0};
    (void)state;
    s.epochs = 3;
    struct spl_dictionary a = train(&p, &s, &whole);
    s.memory_bytes = 4 << 20;
    struct spl_dictionary b = train(&p, &s, &cut);
    assert_int_equal(whole.last.sample, 20000);
    assert_true(cut.last.sample >= 256 && cut.last.sample < 20000);
    assert_true(cut.last.sample * 48 * 4 < s.memory_bytes);
    spl_dictionary_finish(&a);
    spl_dictionary_finish(&b);
    plant_finish(&p);
}

static int broken_read(void *context, uint64_t first, uint32_t count, uint8_t *out, struct spl_error *err)
{
    struct plant *p = context;
    plant_read(p, first, count, out, NULL);
    return first ? spl_fail(err, SPL_E_IO, "photograph lost") : 0;
}

static void test_ends_early(void **state)
{
    struct plant p = plant_make(4, 16, 3000, 3, 0.7f);
    struct spl_dictionary d = {0};
    struct spl_error err = {0};
    struct seen seen = {.end_at = 2};
    (void)state;
    assert_int_equal(spl_dictionary_train(plant_source(&p), &usual, see, &seen, &d, &err), SPL_E_CANCELLED);
    assert_int_equal(seen.epochs, 2);
    assert_null(d.texels);
    p.source.read = broken_read;
    err = (struct spl_error){0};
    assert_int_equal(spl_dictionary_train(plant_source(&p), &usual, NULL, NULL, &d, &err), SPL_E_IO);
    assert_string_equal(err.message, "photograph lost");
    assert_int_equal(spl_dictionary_train(plant_source(&p), &usual, NULL, NULL, &d, NULL), SPL_E_IO);
    assert_null(d.texels);
    plant_finish(&p);
}

static void test_no_memory(void **state)
{
    struct plant p = plant_make(16, 10, 60, 2, 2);
    struct spl_train_settings s = usual;
    int failures = 0;
    (void)state;
    s.epochs = 2;
    s.threads = 1;
    for (long n = 1;; n++) {
        struct spl_dictionary d = {0};
        struct spl_error err = {0};
        spl_memory_fail_after(n);
        int rc = spl_dictionary_train(plant_source(&p), &s, NULL, NULL, &d, &err);
        spl_memory_fail_after(0);
        if (!rc) {
            spl_dictionary_finish(&d);
            break;
        }
        assert_int_equal(rc, SPL_E_NOMEM);
        assert_true(!d.texels && !d.scale && !d.coefficients && !d.count && !d.size);
        failures++;
    }
    assert_true(failures > 20);
    plant_finish(&p);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_refuses),
        cmocka_unit_test(test_finds_planted_atoms),
        cmocka_unit_test(test_same_for_a_seed),
        cmocka_unit_test(test_count_adapts),
        cmocka_unit_test(test_large_textures),
        cmocka_unit_test(test_little_data),
        cmocka_unit_test(test_memory_cuts_the_sample),
        cmocka_unit_test(test_ends_early),
        cmocka_unit_test(test_no_memory),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
