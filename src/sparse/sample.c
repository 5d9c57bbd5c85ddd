/* The sample of a training: how much memory allows, which textures, on what basis.
 *
 * Of n values a texture's energy lies in far fewer: textures and atoms are projected on the m main axes of a first,
 * small sample (principal components), and all of the training happens there; what lies outside no atom could hold
 * anyway, and it is counted as error. The sample is stratified (one texture out of each run of equal length) and
 * shuffled, so every batch is spread over the dataset. */
#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "base/memory.h"
#include "base/parallel.h"
#include "sparse/blas.h"
#include "sparse/matrix.h"
#include "sparse/random.h"
#include "sparse/training.h"

enum {
    read_textures = 1024, /* at a time */
    planned_threads = 8,
    project_grain = 64,   /* of them, a thread's at a time */
    axes_textures = 8192, /* the sample for the axes */
    axes_min = 64,
    sample_min = 256,
    batch_min = 8192,
    textures_an_atom = 16, /* with fewer no atom earns its bytes; some more are begun with */
    few_atoms = 64,
};

/* A share of all energy: outside the axes that are kept. */
static const double outside_max = 0.002;

/* Where stratum j of `sample` begins in `population`; sample < 2^32. */
static uint64_t stratum_begin(uint64_t j, uint64_t sample, uint64_t population)
{
    return population / sample * j + population % sample * j / sample;
}

/* The texture that stands for stratum j. */
static uint64_t stratum(uint64_t seed, uint64_t j, uint64_t sample, uint64_t population)
{
    uint64_t begin = stratum_begin(j, sample, population), end = stratum_begin(j + 1, sample, population);
    return begin + spl_random_at(seed, j) % (end - begin);
}

struct reader {
    const struct spl_texture_source *source;
    uint64_t first, count; /* what the buffer holds */
    uint8_t *buffer;       /* [read_textures × n] */
};

static int read_texture(struct reader *r, uint64_t index, const uint8_t **out, struct spl_error *err)
{
    if (index < r->first || index >= r->first + r->count) {
        uint64_t left = r->source->count - index;
        r->first = index;
        r->count = left < read_textures ? left : read_textures;
        int rc = r->source->read(r->source->context, r->first, (uint32_t)r->count, r->buffer, err);
        if (rc) {
            r->count = 0;
            return rc;
        }
    }
    *out = r->buffer + (index - r->first) * spl_texture_values(r->source->size);
    return 0;
}

/* The main axes of a small sample: fills t->basis and t->m, unless all of them are needed. */
static int find_basis(struct spl_training *t, struct reader *reader, struct spl_error *err)
{
    size_t n = t->n, rows = 0, wanted = n / 2;
    uint64_t sample = t->population < axes_textures ? t->population : axes_textures;
    int rc = SPL_E_NOMEM;
    float *y = spl_alloc_raw(SPL_BLOCK_TEXTURES * n, sizeof *y, err);
    float *covariance = spl_alloc(n * n + SPL_BLAS_PAD, sizeof *covariance, err);
    float *values = spl_alloc_raw(wanted, sizeof *values, err), *axes = NULL;
    double all = 0, inside = 0;
    if (!y || !covariance || !values)
        goto done;
    for (uint64_t j = 0; j < sample; j++) {
        float mean[3];
        const uint8_t *texture;
        rc = read_texture(reader, stratum(t->settings->seed, j, sample, t->population), &texture, err);
        if (rc)
            goto done;
        all += spl_texture_centre(texture, reader->source->size, y + rows++ * n, mean);
        if (rows == SPL_BLOCK_TEXTURES || j + 1 == sample) {
            spl_blas_covariance(rows, n, y, covariance);
            rows = 0;
        }
    }
    rc = 0;
    if (wanted < axes_min || !(all > 0))
        goto done;
    rc = SPL_E_NOMEM;
    axes = spl_alloc_raw(n * n, sizeof *axes, err);
    if (!axes)
        goto done;
    rc = spl_blas_eigen(n, covariance, wanted, values, axes, err);
    if (rc)
        goto done;
    size_t m = 0;
    while (m < wanted && (m < axes_min || all - inside > outside_max * all))
        inside += values[m++];
    if (all - inside > 4 * outside_max * all)
        goto done; /* energy is spread evenly: half the axes would not do */
    t->m = (uint32_t)m;
    t->basis = spl_realloc(axes, m * n, sizeof *axes, err);
    if (t->basis)
        axes = NULL;
    rc = t->basis ? 0 : SPL_E_NOMEM;
done:
    free(y);
    free(covariance);
    free(values);
    free(axes);
    return rc;
}

struct projecting {
    struct spl_training *t;
    const uint32_t *slot;
    size_t first; /* of the sample */
    uint32_t size;
    const uint8_t *textures;
    float *whole; /* [n] a worker */
};

static void project(void *context, size_t begin, size_t end, unsigned worker)
{
    const struct projecting *p = context;
    struct spl_training *t = p->t;
    for (size_t i = begin; i < end; i++) {
        uint32_t slot = p->slot[p->first + i];
        float mean[3], *y = t->y + (size_t)slot * t->m, *whole = t->basis ? p->whole + (size_t)worker * t->n : y;
        t->norm[slot] = (float)spl_texture_centre(p->textures + i * t->n, p->size, whole, mean);
        if (t->basis)
            spl_blas_apply(t->m, t->n, t->basis, whole, y);
    }
}

/* Reads the sample into t->y, projected and shuffled: a run of textures after the other, its textures in parallel. */
static int read_sample(struct spl_training *t, struct reader *reader, struct spl_error *err)
{
    int rc = SPL_E_NOMEM;
    float *whole = spl_alloc_raw((size_t)t->threads * t->n, sizeof *whole, err);
    uint32_t *slot = spl_alloc_raw(t->sample, sizeof *slot, err);
    uint8_t *run = spl_alloc_raw(read_textures, t->n, err);
    if (!whole || !slot || !run)
        goto done;
    for (size_t i = 0; i < t->sample; i++) {
        size_t k = spl_random_at(~t->settings->seed, i) % (i + 1);
        slot[i] = slot[k]; /* Fisher–Yates, inside out; slot[0] = 0 at first */
        slot[k] = (uint32_t)i;
    }
    reader->count = 0;
    struct projecting projecting = {
        .t = t, .slot = slot, .size = reader->source->size, .textures = run, .whole = whole};
    for (size_t j = 0; j < t->sample; j++) {
        const uint8_t *texture;
        rc = read_texture(reader, stratum(t->settings->seed, j, t->sample, t->population), &texture, err);
        if (rc)
            goto done;
        memcpy(run + (j - projecting.first) * t->n, texture, t->n);
        if (j + 1 - projecting.first < read_textures && j + 1 < t->sample)
            continue;
        spl_parallel_for(t->threads, j + 1 - projecting.first, project_grain, project, &projecting);
        projecting.first = j + 1;
    }
    rc = 0;
done:
    free(whole);
    free(slot);
    free(run);
    return rc;
}

/* Sizes of everything: t->sample, t->batch, whether there is a Gram matrix. */
static int plan(struct spl_training *t, bool *gram, struct spl_error *err)
{
    const struct spl_train_settings *s = t->settings;
    uint64_t k = t->count, m = t->m, memory = s->memory_bytes, whole = t->settings->method == SPL_TRAIN_KSVD;
    uint64_t row = sizeof(struct spl_sparse_row) + 4 * m + 4ull * s->atoms, texture = 4 * m + 8;
    uint64_t batch = whole ? 0 : 4 * k < batch_min ? batch_min : 4 * k;
    if (batch > t->population)
        batch = t->population;
    *gram = 4 * k * k <= memory / 4;
    uint64_t block = spl_block_bytes(t->count, t->m, *gram) + 4ull * SPL_BLOCK_TEXTURES * t->m;
    uint64_t fixed = 8 * k * m + 32 * k + (*gram ? 4 * k * k : 0) + batch * row + 2 * read_textures * (uint64_t)t->n +
                     4ull * planned_threads * t->n + (t->basis ? 4ull * t->n * t->m : 0) + planned_threads * block;
    uint64_t each = texture + (whole ? row : 0) + 4 /* its slot while reading */;
    uint64_t least = t->population < sample_min ? t->population : sample_min;
    if (memory < fixed + each * least)
        return spl_fail_field(
            err, SPL_E_LIMIT, "memory",
            "training %u atoms of %u values takes at least %llu bytes, memory is %llu: allow more, or train "
            "fewer atoms",
            t->count, t->n, (unsigned long long)(fixed + each * least), (unsigned long long)memory);
    uint64_t sample = (memory - fixed) / each;
    if (s->sample && sample > s->sample)
        sample = s->sample;
    t->sample = sample < t->population ? sample : t->population;
    if (t->sample > UINT32_MAX / SPL_ATOMS_MAX)
        t->sample = UINT32_MAX / SPL_ATOMS_MAX;
    /* threads beyond those that were counted on work where memory is left, so that no sample depends on their number */
    uint64_t threads = planned_threads + (memory - fixed - each * t->sample) / (block + 4ull * t->n);
    t->threads = t->threads < threads ? t->threads : (unsigned)threads;
    t->batch = whole || batch > t->sample ? t->sample : batch;
    return 0;
}

int spl_training_init(struct spl_training *t, const struct spl_texture_source *source,
                      const struct spl_train_settings *settings, struct spl_error *err)
{
    struct reader reader = {.source = source};
    bool gram;
    int rc = SPL_E_NOMEM;
    *t = (struct spl_training){
        .settings = settings, .population = source->count, .threads = spl_thread_count(settings->threads)};
    t->n = t->m = spl_texture_values(source->size);
    uint64_t most = settings->lambda > 0 ? source->count / textures_an_atom + few_atoms : source->count;
    t->count = settings->dictionary < most ? settings->dictionary : (uint32_t)most;
    t->count = t->count < source->count ? t->count : (uint32_t)source->count;
    uint64_t axes_bytes = 8ull * t->n * t->n + (uint64_t)t->n * (read_textures + 4 * SPL_BLOCK_TEXTURES);
    if (axes_bytes > settings->memory_bytes)
        return spl_fail_field(err, SPL_E_LIMIT, "memory",
                              "training on textures of %u values takes at least %llu bytes, memory is "
                              "%llu: allow more",
                              t->n, (unsigned long long)axes_bytes, (unsigned long long)settings->memory_bytes);
    reader.buffer = spl_alloc_raw(read_textures * (size_t)t->n, 1, err);
    if (!reader.buffer)
        goto done;
    rc = find_basis(t, &reader, err);
    if (rc)
        goto done;
    rc = plan(t, &gram, err);
    if (rc)
        goto done;
    rc = SPL_E_NOMEM;
    size_t k = t->count, m = t->m;
    t->y = spl_alloc_raw(t->sample * m, sizeof(float), err);
    t->norm = spl_alloc_raw(t->sample, sizeof(float), err);
    t->error = spl_alloc_raw(t->sample, sizeof(float), err);
    t->atoms = spl_alloc_raw(k * m, sizeof(float), err);
    t->next = spl_alloc_raw(k * m, sizeof(float), err);
    t->gram = gram ? spl_alloc_raw(k * k, sizeof(float), err) : NULL;
    t->history = spl_alloc(k, sizeof(double), err);
    t->uses = spl_alloc(k, sizeof(uint64_t), err);
    t->benefit = spl_alloc(k, sizeof(double), err);
    t->power = spl_alloc(k, sizeof(double), err);
    t->row = spl_alloc(t->batch, sizeof *t->row, err);
    t->residual = spl_alloc_raw(t->batch * m, sizeof(float), err);
    t->user = spl_alloc_raw(t->batch * settings->atoms, sizeof *t->user, err);
    t->first_user = spl_alloc_raw(k + 1, sizeof *t->first_user, err);
    if (!t->y || !t->norm || !t->error || !t->atoms || !t->next || (gram && !t->gram) || !t->history || !t->uses ||
        !t->benefit || !t->power || !t->row || !t->residual || !t->user || !t->first_user)
        goto done;
    rc = read_sample(t, &reader, err);
done:
    free(reader.buffer);
    return rc;
}

void spl_training_finish(struct spl_training *t)
{
    free(t->basis);
    free(t->y);
    free(t->norm);
    free(t->error);
    free(t->atoms);
    free(t->next);
    free(t->gram);
    free(t->history);
    free(t->uses);
    free(t->benefit);
    free(t->power);
    free(t->row);
    free(t->residual);
    free(t->user);
    free(t->first_user);
    *t = (struct spl_training){0};
}
