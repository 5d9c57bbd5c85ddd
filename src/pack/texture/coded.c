/* From textures to a dictionary and codes: what src/sparse does, over what lies in the file of textures.
 *
 * With a price of bits, lambda, every splat gets the atoms that pay, so that the error of all together is the smallest
 * for its bytes; lambda is sought on some chunks so that this error is the wanted one. Codes are made in parallel over
 * chunks and kept as the words that the container holds, some ten bytes a splat, since the colours that they change
 * must be known before the first node is written. One error wins. */
#include "pack/texture/textures.h"

#include <errno.h>
#include <math.h>
#include <stdatomic.h>
#include <stdlib.h>
#include <string.h>
#include <threads.h>
#include <unistd.h>

#include "base/memory.h"
#include "base/parallel.h"
#include "dataset/texture.h"
#include "pack/texture/presets.h"
#include "sparse/texture_file.h"

static const struct {
    uint32_t dictionary, weight_bits; /* 0: the preset's */
    bool weighs;                      /* gain against bits */
} codings[SPL_TEXTURES_COUNT] = {
    [SPL_TEXTURES_ADAPTIVE] = {0, 8, true},
    [SPL_TEXTURES_D8W4] = {256, 4, false},
    [SPL_TEXTURES_D12W4] = {4096, 4, false},
    [SPL_TEXTURES_D16W8] = {65536, 8, false},
};
/* What a bit of codes saves where textures are as good as wanted, in shares of their squared error, on Sceaux; the
 * packer starts there and seeks the lambda that gives the wanted quality. */
static const double share_of_target = 0.025, share_range = 8;
static const double db_per_lambda = 1.75; /* lower for e times the lambda, likewise */
enum { sampled_chunks = 128, lambda_trials = 4 };
enum { epochs_expected = 5 };           /* until training settles, on Sceaux */
static const double seconds_most = 600; /* of training */
static const uint64_t memory_default = 2ull << 30;

struct reader {
    const struct spl_textures *textures;
};

static int read_at(const struct spl_textures *textures, uint64_t first, uint64_t count, uint8_t *out,
                   struct spl_error *err)
{
    uint64_t bytes = count * textures->values, offset = first * textures->values;
    while (bytes) {
        ssize_t got = pread(textures->fd, out, bytes, (off_t)offset);
        if (got < 0 && errno == EINTR)
            continue;
        if (got <= 0)
            return spl_fail_errno(err, got ? errno : EIO, "cannot read textures back");
        out += got;
        offset += (uint64_t)got;
        bytes -= (uint64_t)got;
    }
    return SPL_OK;
}

static int read_textures(void *context, uint64_t first, uint32_t count, uint8_t *out, struct spl_error *err)
{
    const struct spl_textures *textures = ((const struct reader *)context)->textures;
    int rc = SPL_OK;
    for (uint64_t i = first, run; !rc && i < first + count; i += run) {
        for (run = 1; i + run < first + count && textures->id[i + run] == textures->id[i] + run; run++)
            ;
        rc = read_at(textures, textures->id[i], run, out, err);
        out += run * textures->values;
    }
    return rc;
}

int spl_textures_keep(const struct spl_textures *textures, const char *path, const struct spl_texture_origin *origin,
                      struct spl_error *err)
{
    struct reader reader = {textures};
    const struct spl_texture_source source = {
        .count = textures->count, .size = textures->size, .read = read_textures, .context = &reader};
    return spl_texture_file_write(path, &source, origin, err);
}

struct reporting {
    json_t *epochs;
    const struct spl_photo_options *options;
    struct spl_stage *stage;
    uint64_t sample; /* textures of an epoch */
};

/* Nobody knows how many epochs it takes to settle: one more than was expected is announced when it begins. */
static void advance(void *context, uint64_t textures)
{
    const struct reporting *reporting = context;
    if (atomic_load(&reporting->stage->done) + textures > reporting->stage->total)
        reporting->stage->total += reporting->sample;
    spl_stage_add(reporting->stage, textures, 0);
}

static bool report_epoch(void *context, const struct spl_train_progress *p)
{
    const struct reporting *reporting = context;
    /* without its seconds: equal input gives an equal file */
    json_array_append_new(reporting->epochs, json_pack("{s:i, s:f, s:f, s:i}", "epoch", (int)p->epoch, "psnr",
                                                       isfinite(p->psnr) ? p->psnr : 999.0, "atoms", p->atoms_per_splat,
                                                       "dictionary", (int)p->dictionary));
    if (reporting->options->trained)
        reporting->options->trained(reporting->options->context, p->epoch, p->seconds, p->psnr, p->atoms_per_splat,
                                    p->dictionary);
    return !spl_stage_is_cancelled(reporting->stage);
}

struct coding {
    struct spl_coded *coded;
    const struct spl_textures *textures;
    const struct spl_splats *splats;
    struct spl_coder *coder;
    struct spl_chosen *chosen;
    struct spl_stage *stage;
    struct spl_code_sums *sums; /* by chunk, or by chunk of the sample */
    uint32_t stride;            /* > 0: a sample, every so many-th chunk; nothing is kept */
    uint8_t *scratch;           /* by worker: the textures of a chunk */
    atomic_int failed;
    mtx_t mutex;
    struct spl_error *err; /* guarded by: mutex */
};

static int code_chunk(struct coding *coding, uint32_t chunk, unsigned worker, struct spl_code_sums *sums,
                      struct spl_error *err)
{
    const struct spl_chunk *header = &coding->splats->chunks[chunk];
    const struct spl_textures *textures = coding->textures;
    uint8_t *scratch = coding->scratch + (size_t)worker * SPL_CHUNK_SPLATS * textures->values;
    const uint8_t *texture[SPL_CHUNK_SPLATS];
    uint32_t first = UINT32_MAX, last = 0, words[SPL_TEXTURE_WORDS_MAX];
    struct spl_chunk_code code;
    for (uint32_t i = 0; i < header->count; i++) {
        bool has = textures->has[header->first_id + i];
        texture[i] = has ? scratch + (size_t)i * textures->values : NULL;
        first = has && first == UINT32_MAX ? i : first;
        last = has ? i : last;
    }
    if (first == UINT32_MAX)
        return SPL_OK;
    /* gaps between are holes of the file or not there: they read as anything and are not looked at */
    int rc = read_at(textures, header->first_id + (uint64_t)first, last - first + 1,
                     scratch + (size_t)first * textures->values, err);
    if (!rc)
        rc = spl_coder_code(coding->coder, texture, header->count, coding->chosen->color + header->first_id, &code,
                            sums, err);
    if (rc || coding->stride)
        return rc;
    uint32_t count = spl_texture_encode(&code, words);
    if (!count)
        return SPL_OK;
    uint32_t *kept = coding->coded->words[chunk] = spl_alloc_raw(count, sizeof *kept, err);
    if (!kept)
        return SPL_E_NOMEM;
    memcpy(kept, words, count * sizeof *kept);
    coding->coded->planes[chunk] = (uint8_t)code.planes;
    return SPL_OK;
}

static void code_chunks(void *context, size_t begin, size_t end, unsigned worker)
{
    struct coding *coding = context;
    for (uint32_t i = (uint32_t)begin; i < end && !atomic_load(&coding->failed); i++) {
        struct spl_error why = {0};
        uint32_t chunk = coding->stride ? i * coding->stride : i;
        int rc = spl_stage_check(coding->stage, &why);
        if (!rc)
            rc = code_chunk(coding, chunk, worker, &coding->sums[i], &why);
        if (!rc)
            continue;
        mtx_lock(&coding->mutex);
        spl_fail_field(coding->err, rc, why.field, "%s", why.message);
        mtx_unlock(&coding->mutex);
        atomic_store(&coding->failed, rc);
    }
    spl_stage_add(coding->stage, end - begin, worker);
}

static void add_sums(struct spl_code_sums *sums, const struct spl_code_sums *more)
{
    sums->squared_error += more->squared_error;
    sums->plain_error += more->plain_error;
    sums->values += more->values;
    sums->splats += more->splats;
    sums->bits += more->bits;
    for (int i = 0; i <= SPL_ATOMS_MAX; i++)
        sums->histogram[i] += more->histogram[i];
}

/* Codes all chunks, or a sample, and adds up to `total`. */
static int code_all(struct coding *coding, struct spl_code_sums *total, struct spl_error *err)
{
    unsigned threads = coding->stage->threads;
    uint32_t chunks = coding->splats->chunk_count;
    uint32_t wanted = coding->stride ? (chunks + coding->stride - 1) / coding->stride : chunks;
    struct spl_error first = {0};
    coding->sums = spl_alloc(wanted, sizeof *coding->sums, err);
    coding->scratch = spl_alloc_raw((size_t)threads * SPL_CHUNK_SPLATS, coding->textures->values, err);
    coding->err = &first;
    int rc = coding->sums && coding->scratch ? SPL_OK : SPL_E_NOMEM;
    if (!rc && mtx_init(&coding->mutex, mtx_plain) != thrd_success)
        rc = spl_fail(err, SPL_E_NOMEM, "no mutex could be made");
    if (!rc) {
        spl_parallel_for(threads, wanted, 1, code_chunks, coding);
        mtx_destroy(&coding->mutex);
        rc = atomic_load(&coding->failed);
        if (rc)
            spl_fail_field(err, rc, first.field, "%s", first.message);
    }
    /* in the order of chunks: lambda and what META says must not depend on who did which */
    for (uint32_t i = 0; coding->sums && i < wanted; i++)
        add_sums(total, &coding->sums[i]);
    free(coding->sums);
    free(coding->scratch);
    return rc;
}

/* Sets the coder's lambda, at first `lambda`, to one that gives a sample `quality` dB. */
static int seek_lambda(struct coding *coding, double lambda, double quality, struct spl_error *err)
{
    double least = lambda / share_range, most = lambda * share_range;
    int rc = SPL_OK;
    coding->stride = coding->splats->chunk_count / sampled_chunks + 1;
    for (int i = 0; i < lambda_trials && !rc; i++) {
        struct spl_code_sums sums = {0};
        rc = code_all(coding, &sums, err);
        if (rc || !(sums.squared_error > 0))
            break;
        double over = -10 * log10(sums.squared_error / (double)sums.values) - quality;
        double before = lambda;
        lambda = fmin(fmax(lambda * exp(over / db_per_lambda), least), most);
        if (fabs(log(lambda / before)) < 0.01)
            break;
        spl_coder_set_lambda(coding->coder, (float)lambda);
    }
    coding->stride = 0;
    return rc;
}

int spl_coded_init(struct spl_coded *coded, const struct spl_textures *textures, const struct spl_splats *splats,
                   const struct spl_photo_options *options, struct spl_chosen *chosen, struct spl_stage *stage,
                   struct spl_error *err)
{
    const struct spl_texture_settings preset = spl_texture_settings_get(options);
    double quality = preset.quality;
    double wanted = textures->values * pow(10, -quality / 10);
    uint64_t memory = options->memory_bytes ? options->memory_bytes : memory_default;
    bool weighs = codings[options->textures].weighs;
    struct reader reader = {textures};
    const struct spl_texture_source source = {
        .count = textures->count, .size = textures->size, .read = read_textures, .context = &reader};
    const struct spl_train_settings train = {
        .method = SPL_TRAIN_BATCHES,
        .dictionary = codings[options->textures].dictionary ? codings[options->textures].dictionary : preset.dictionary,
        .epochs = preset.epochs,
        .sample = preset.sample,
        .atoms = SPL_ATOMS_MAX,
        .psnr = weighs ? 0 : (float)quality,
        .lambda = weighs ? (float)(share_of_target * wanted) : 0,
        .seconds = seconds_most,
        .seed = 1,
        .memory_bytes = memory,
        .threads = stage->threads,
        .advance = advance,
    };
    const struct spl_code_settings settings = {.atoms = train.atoms,
                                               .psnr = train.psnr,
                                               .lambda = train.lambda,
                                               .weight_bits = codings[options->textures].weight_bits};
    struct coding coding = {.coded = coded, .textures = textures, .splats = splats, .chosen = chosen, .stage = stage};
    *coded = (struct spl_coded){.chunk_count = splats->chunk_count, .epochs = json_array()};
    coded->words = spl_alloc(splats->chunk_count, sizeof *coded->words, err);
    coded->planes = spl_alloc(splats->chunk_count, sizeof *coded->planes, err);
    struct reporting reporting = {coded->epochs, options, stage, 0};
    int rc = !coded->words || !coded->planes ? SPL_E_NOMEM
             : !coded->epochs                ? spl_fail(err, SPL_E_NOMEM, "out of memory for the figures of training")
                                             : SPL_OK;
    uint64_t sample = preset.sample && preset.sample < textures->count ? preset.sample : textures->count;
    reporting.sample = sample;
    spl_stage_begin(stage, "training", NULL, sample * (preset.epochs ? preset.epochs : epochs_expected));
    if (!rc)
        rc = spl_dictionary_train(&source, &train, report_epoch, &reporting, &coded->dictionary, err);
    spl_stage_finish(stage);
    if (!rc && !(coding.coder = spl_coder_create(&coded->dictionary, &settings, memory, stage->threads, err)))
        rc = err && err->code ? err->code : SPL_E_NOMEM;
    uint32_t stride = splats->chunk_count / sampled_chunks + 1;
    uint32_t sampled = weighs ? lambda_trials * ((splats->chunk_count + stride - 1) / stride) : 0;
    spl_stage_begin(stage, "coding textures", NULL, (uint64_t)splats->chunk_count + sampled);
    if (!rc && weighs)
        rc = seek_lambda(&coding, (double)train.lambda, quality, err);
    if (!rc)
        rc = code_all(&coding, &coded->sums, err);
    spl_stage_finish(stage);
    spl_coder_destroy(coding.coder);
    if (rc)
        spl_coded_finish(coded);
    return rc;
}

void spl_coded_finish(struct spl_coded *coded)
{
    for (uint32_t i = 0; coded->words && i < coded->chunk_count; i++)
        free(coded->words[i]);
    free(coded->words);
    free(coded->planes);
    json_decref(coded->epochs);
    spl_dictionary_finish(&coded->dictionary);
    *coded = (struct spl_coded){0};
}

int spl_coded_get(void *context, uint64_t chunk, struct spl_chunk_code *code, struct spl_error *err)
{
    const struct spl_coded_chunks *chunks = context;
    uint64_t all;
    uint32_t splats = spl_dataset_get_chunks(chunks->splats->dataset, &all)[chunk].count;
    const uint32_t *words = chunks->coded->words[chunk];
    (void)err;
    if (words)
        spl_texture_decode(words, chunks->coded->planes[chunk], splats, code);
    else
        *code = (struct spl_chunk_code){.splats = splats};
    return SPL_OK;
}
