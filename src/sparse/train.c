/* The loop of a training: epochs of coding and updates, atoms replaced in the first and dropped in the later ones,
 * until the cost (squared error + lambda · bits of codes and atoms) falls by less than half a percent, 0.02 dB. Then
 * atoms go back from the main axes to texels, sorted by use, rounded to bytes. */
#include "sparse/train.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "base/clock.h"
#include "base/memory.h"
#include "sparse/atom.h"
#include "sparse/blas.h"
#include "sparse/training.h"

enum { replace_epochs = 3, epochs_max = 200 };
static const double settled = 0.995; /* of the cost an epoch ago */

static int check(const struct spl_texture_source *source, const struct spl_train_settings *s, struct spl_error *err)
{
    if (source->size < 1 || source->size > SPL_TEXTURE_SIZE_MAX)
        return spl_fail_field(err, SPL_E_USAGE, "size", "a texture's size is 1..%d, not %u", SPL_TEXTURE_SIZE_MAX,
                              source->size);
    if (s->dictionary < 1 || s->dictionary > SPL_DICTIONARY_MAX)
        return spl_fail_field(err, SPL_E_USAGE, "dictionary", "dictionary is 1..%d atoms, not %u", SPL_DICTIONARY_MAX,
                              s->dictionary);
    if (s->atoms < 1 || s->atoms > SPL_ATOMS_MAX)
        return spl_fail_field(err, SPL_E_USAGE, "atoms", "atoms is 1..%d, not %u", SPL_ATOMS_MAX, s->atoms);
    if (!(s->psnr >= 0 && s->psnr < 200))
        return spl_fail_field(err, SPL_E_USAGE, "psnr", "psnr is 0..200 dB, not %g", (double)s->psnr);
    if (!(s->lambda >= 0 && isfinite(s->lambda)))
        return spl_fail_field(err, SPL_E_USAGE, "lambda", "lambda is a finite number from 0 on, not %g",
                              (double)s->lambda);
    if (!(s->seconds >= 0 && isfinite(s->seconds)))
        return spl_fail_field(err, SPL_E_USAGE, "seconds", "seconds is a finite number from 0 on, not %g", s->seconds);
    return 0;
}

static int epoch(struct spl_training *t, void *context, struct spl_error *err)
{
    t->epoch_error = 0;
    t->epoch_weights = 0;
    memset(t->uses, 0, t->count * sizeof *t->uses);
    memset(t->benefit, 0, t->count * sizeof *t->benefit);
    memset(t->power, 0, t->count * sizeof *t->power);
    for (size_t first = 0; first < t->sample; first += t->batch) {
        size_t count = t->sample - first < t->batch ? t->sample - first : t->batch;
        int rc = spl_training_code(t, first, count, err);
        if (rc)
            return rc;
        spl_training_update(t, count);
        if (t->settings->advance)
            t->settings->advance(context, count);
    }
    return 0;
}

/* Squared error + lambda · bits, a texture of the sample. */
static double cost(const struct spl_training *t)
{
    double sample = (double)t->sample, price = (double)spl_training_price(t);
    double dictionary = 0;
    for (uint32_t a = 0; a < t->count && t->settings->lambda > 0; a++)
        dictionary += (double)t->settings->lambda * spl_training_atom_bits(t, a) / (double)t->population;
    return t->epoch_error / sample + price * (double)t->epoch_weights / sample + dictionary;
}

static struct spl_train_progress progress_of(const struct spl_training *t, uint32_t number, uint64_t begin_ns)
{
    double values = (double)t->sample * t->n;
    return (struct spl_train_progress){
        .epoch = number,
        .seconds = (double)(spl_now_ns() - begin_ns) / SPL_NS_PER_S,
        .psnr = t->epoch_error > 0 ? -10 * log10(t->epoch_error / values) : INFINITY,
        .atoms_per_splat = (double)t->epoch_weights / (double)t->sample,
        .dictionary = t->count,
        .sample = t->sample,
    };
}

static int run(struct spl_training *t, uint64_t begin_ns, spl_train_report *report, void *context,
               struct spl_error *err)
{
    const struct spl_train_settings *s = t->settings;
    uint32_t last = s->epochs ? s->epochs : epochs_max;
    double before = INFINITY, longest = 0;
    spl_training_start(t);
    for (uint32_t number = 1; number <= last && t->count; number++) {
        uint64_t epoch_begin = spl_now_ns();
        uint32_t dropped = 0;
        if (s->seconds > 0 && number > 1 && (double)(epoch_begin - begin_ns) / SPL_NS_PER_S + longest > s->seconds)
            break;
        int rc = epoch(t, context, err);
        if (rc)
            return rc;
        longest = fmax(longest, (double)(spl_now_ns() - epoch_begin) / SPL_NS_PER_S);
        struct spl_train_progress progress = progress_of(t, number, begin_ns);
        if (report && !report(context, &progress))
            return spl_fail(err, SPL_E_CANCELLED, "training was ended after epoch %u", number);
        double now = cost(t);
        bool enough = number > replace_epochs && now > settled * before;
        before = now;
        if (enough || number == last)
            break;
        rc = spl_training_replace(t, s->lambda > 0 && number > replace_epochs, &dropped, err);
        if (rc)
            return rc;
    }
    return 0;
}

/* The unit in which atom a's coefficients are stored. Rounding by steps of Δ adds Δ²/12 a coefficient to the error of
 * each use, times its squared weight; with a further bit a coefficient 3/4 of that go. With lambda the step is where
 * that is worth its bits, d(error)/d(bits) = 2 ln 2 · power · Δ²/12 = lambda. */
static float get_step(const struct spl_training *t, uint32_t a)
{
    const double finest = 0.002, coarsest = 0.1; /* of an atom's norm */
    double power = t->power[a] * (double)t->population / (double)t->sample;
    double step =
        t->settings->lambda > 0 && power > 0 ? sqrt(6 / log(2) * (double)t->settings->lambda / power) : finest;
    return (float)fmin(fmax(step, finest), coarsest);
}

double spl_training_atom_bits(const struct spl_training *t, uint32_t a)
{
    double bits = 12, step = (double)get_step(t, a);
    for (uint32_t k = 0; k < t->m; k++) {
        double steps = fabs((double)t->atoms[(size_t)a * t->m + k]) / step;
        bits += steps > 0.5 ? 2.5 + log2(steps) : 1;
    }
    return bits;
}

struct used {
    uint64_t uses;
    uint32_t atom;
};

static int by_use(const void *a, const void *b)
{
    const struct used *x = a, *y = b;
    if (x->uses != y->uses)
        return x->uses > y->uses ? -1 : 1;
    return x->atom < y->atom ? -1 : x->atom > y->atom;
}

static int finish_atoms(const struct spl_training *t, uint32_t size, struct spl_dictionary *out, struct spl_error *err)
{
    struct used *order = spl_alloc_raw(t->count, sizeof *order, err);
    float *whole = spl_alloc_raw(t->n, sizeof *whole, err);
    int rc = SPL_E_NOMEM;
    struct spl_waves waves;
    if (!order || !whole || spl_dictionary_init(out, t->count, size, err))
        goto done;
    out->count = 0;
    spl_waves_init(&waves, size);
    for (uint32_t a = 0; a < t->count; a++)
        order[a] = (struct used){t->uses[a], a};
    qsort(order, t->count, sizeof *order, by_use);
    for (uint32_t i = 0; i < t->count; i++) {
        const float *atom = t->atoms + (size_t)order[i].atom * t->m;
        if (t->basis)
            spl_blas_apply_transposed(t->m, t->n, t->basis, atom, whole);
        int16_t *coefficient = out->coefficients + (size_t)out->count * t->n;
        spl_waves_analyse(&waves, t->basis ? whole : atom, get_step(t, order[i].atom), coefficient);
        if (order[i].uses &&
            spl_waves_synthesise(&waves, coefficient, out->texels + (size_t)out->count * t->n, &out->scale[out->count]))
            out->count++;
    }
    rc = 0;
done:
    free(order);
    free(whole);
    return rc;
}

int spl_dictionary_train(const struct spl_texture_source *source, const struct spl_train_settings *settings,
                         spl_train_report *report, void *context, struct spl_dictionary *out, struct spl_error *err)
{
    struct spl_training t = {0};
    uint64_t begin_ns = spl_now_ns();
    int rc = check(source, settings, err);
    *out = (struct spl_dictionary){0};
    if (rc || (rc = spl_blas_open(err)))
        return rc;
    if (!source->count) {
        out->size = source->size;
        return 0;
    }
    rc = spl_training_init(&t, source, settings, err);
    if (!rc)
        rc = run(&t, begin_ns, report, context, err);
    if (!rc)
        rc = finish_atoms(&t, source->size, out, err);
    if (rc)
        spl_dictionary_finish(out);
    spl_training_finish(&t);
    return rc;
}
