/* The runs behind `splatd bench --textures`. Trainings are timed one after the other on all threads; a row's PSNR is
 * over all values of all textures, weights and atoms rounded as they are stored. The paper's coding is charged what the
 * paper charges: an index and a weight an atom, counts being implied by its batches, and a byte a texel of the
 * dictionary; ours what the container stores. Photographs are charged all their pixels and mips, and two bytes a splat
 * that say which is its own. */
#include "measure/textures.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "base/clock.h"
#include "base/memory.h"
#include "base/parallel.h"
#include "dataset/atoms.h"
#include "sparse/code.h"

enum {
    coded_chunks = 64,
    compared_atoms = 1024,
    adaptive_atoms = 4096, /* as pack trains */
    compared_textures = 50000,
    large_atoms = 16384,    /* above, a round over this many textures */
    large_trained = 196608, /* takes minutes, so there is */
    large_epochs = 1,       /* one, and as many others */
    large_coded = 16384,    /* are coded: a lower bound of the quality */
};
static const double mips = 4.0 / 3, cut_off = 40;

struct watch {
    const struct spl_textures_options *options;
    const char *what;
    struct spl_train_progress *curve; /* may be NULL */
    uint32_t *epochs;
};

static bool watch_epoch(void *context, const struct spl_train_progress *epoch)
{
    struct watch *watch = context;
    if (watch->curve && *watch->epochs < SPL_TEXTURES_EPOCHS_MAX)
        watch->curve[(*watch->epochs)++] = *epoch;
    if (watch->options->progress)
        watch->options->progress(watch->options->context, watch->what, epoch);
    return true;
}

static int train(const struct spl_textures_options *o, const struct spl_texture_source *source, struct watch *watch,
                 enum spl_train_method method, uint32_t atoms, float lambda, struct spl_dictionary *out,
                 struct spl_error *err)
{
    const struct spl_train_settings settings = {.method = method,
                                                .dictionary = atoms,
                                                .atoms = SPL_ATOMS_MAX,
                                                .psnr = lambda > 0 ? 0 : (float)cut_off,
                                                .lambda = lambda,
                                                .epochs = atoms > large_atoms && o->epochs > large_epochs ? large_epochs
                                                                                                          : o->epochs,
                                                .seed = o->seed,
                                                .memory_bytes = o->memory_bytes,
                                                .threads = o->threads};
    return spl_dictionary_train(source, &settings, watch_epoch, watch, out, err);
}

struct coding {
    const struct spl_coder *coder;
    const uint8_t *textures;
    uint64_t count;
    uint32_t n;
    struct spl_code_sums sums[coded_chunks];
    struct spl_error error[coded_chunks];
};

static void code_piece(void *context, size_t begin, size_t end, unsigned worker)
{
    struct coding *c = context;
    (void)worker;
    for (size_t chunk = begin; chunk < end; chunk++) {
        const uint8_t *texture[SPL_CHUNK_SPLATS];
        uint8_t mean[SPL_CHUNK_SPLATS][3];
        struct spl_chunk_code code;
        uint64_t first = chunk * SPL_CHUNK_SPLATS;
        uint32_t count = c->count - first < SPL_CHUNK_SPLATS ? (uint32_t)(c->count - first) : SPL_CHUNK_SPLATS;
        for (uint32_t i = 0; i < count; i++)
            texture[i] = c->textures + (first + i) * c->n;
        spl_coder_code(c->coder, texture, count, mean, &code, &c->sums[chunk], &c->error[chunk]);
    }
}

/* Codes all textures, in chunks as they come. */
static int code_all(const struct spl_textures_options *o, const struct spl_texture_source *source,
                    const struct spl_coder *coder, struct spl_code_sums *sums, struct spl_error *err)
{
    struct coding *c = spl_alloc(1, sizeof *c, err);
    uint32_t n = spl_texture_values(source->size);
    uint8_t *textures = spl_alloc_raw((size_t)coded_chunks * SPL_CHUNK_SPLATS, n, err);
    int rc = c && textures ? 0 : SPL_E_NOMEM;
    for (uint64_t first = 0; !rc && first < source->count; first += coded_chunks * SPL_CHUNK_SPLATS) {
        uint64_t left = source->count - first, most = coded_chunks * SPL_CHUNK_SPLATS;
        *c = (struct coding){.coder = coder, .textures = textures, .count = left < most ? left : most, .n = n};
        rc = source->read(source->context, first, (uint32_t)c->count, textures, err);
        size_t chunks = (c->count + SPL_CHUNK_SPLATS - 1) / SPL_CHUNK_SPLATS;
        if (!rc)
            spl_parallel_for(o->threads, chunks, 1, code_piece, c);
        for (size_t i = 0; !rc && i < chunks; i++) {
            if (c->error[i].code)
                rc = spl_fail(err, c->error[i].code, "%s", c->error[i].message);
            sums->squared_error += c->sums[i].squared_error;
            sums->plain_error += c->sums[i].plain_error;
            sums->values += c->sums[i].values;
            sums->splats += c->sums[i].splats;
            sums->bits += c->sums[i].bits;
            for (int k = 0; k <= SPL_ATOMS_MAX; k++)
                sums->histogram[k] += c->sums[i].histogram[k];
        }
    }
    free(textures);
    free(c);
    return rc;
}

static double to_psnr(double squared_error, double values)
{
    return squared_error > 0 ? -10 * log10(squared_error / values) : INFINITY;
}

static struct spl_textures_row *add_row(struct spl_textures_report *report, const char *name,
                                        enum spl_textures_kind kind)
{
    spl_assert(report->rows < SPL_TEXTURES_ROWS_MAX);
    struct spl_textures_row *row = &report->row[report->rows++];
    *row = (struct spl_textures_row){.atoms = NAN, .packed = {NAN, NAN}, .left_out = {NAN, NAN}, .kind = kind};
    snprintf(row->name, sizeof row->name, "%s", name);
    return row;
}

/* Of a mean colour: the dataset's, else 24 bits. */
static double find_color_bytes(const struct spl_textures_options *o)
{
    const struct spl_dataset_info *info = o->dataset ? spl_dataset_get_info(o->dataset) : NULL;
    return info ? (double)info->attribute_bits[SPL_ATTRIBUTE_COLOR] / 8 / (double)info->splats : 3;
}

/* Every `stride`-th texture of a source, from `offset` on. */
struct thinned {
    const struct spl_texture_source *from;
    uint64_t stride, offset;
};

static int read_thinned(void *context, uint64_t first, uint32_t count, uint8_t *out, struct spl_error *err)
{
    const struct thinned *t = context;
    size_t n = spl_texture_values(t->from->size);
    int rc = 0;
    for (uint32_t i = 0; !rc && i < count; i++)
        rc = t->from->read(t->from->context, t->offset + (first + i) * t->stride, 1, out + i * n, err);
    return rc;
}

static struct spl_texture_source thin(struct thinned *t)
{
    return (struct spl_texture_source){.count = (t->from->count - t->offset + t->stride - 1) / t->stride,
                                       .size = t->from->size,
                                       .read = read_thinned,
                                       .context = t};
}

/* So that every so-manieth texture is no more than are trained on. */
static uint64_t find_stride(const struct spl_textures_options *o, uint32_t atoms)
{
    uint64_t most = o->sample ? o->sample : UINT64_MAX;
    if (atoms > large_atoms && most > large_trained)
        most = large_trained;
    return most < o->source->count ? (o->source->count + most - 1) / most : 1;
}

/* One row: a dictionary of at most `atoms`, and what coding with it gives. Large dictionaries are trained on some of
 * the textures and measured on some of the others: without a Gram matrix each step multiplies with all atoms. */
static int measure_coding(const struct spl_textures_options *o, struct spl_textures_report *report, const char *name,
                          uint32_t atoms, uint32_t weight_bits, float lambda, struct spl_error *err)
{
    struct watch watch = {.options = o, .what = name};
    struct spl_dictionary dictionary = {0};
    struct spl_coder *coder = NULL;
    struct spl_code_sums sums = {0};
    uint64_t begin_ns = spl_now_ns(), used = 0, every = find_stride(o, atoms), coded_every = every;
    bool some = every > 1;
    if (some && atoms > large_atoms)
        coded_every *= o->source->count / every / large_coded + 1;
    struct thinned train_on = {o->source, every, 0}, measure_on = {o->source, coded_every, some};
    struct spl_texture_source trained = thin(&train_on), coded = thin(&measure_on);
    const struct spl_code_settings settings = {
        .atoms = SPL_ATOMS_MAX, .psnr = lambda > 0 ? 0 : (float)cut_off, .lambda = lambda, .weight_bits = weight_bits};
    int rc = train(o, some ? &trained : o->source, &watch, SPL_TRAIN_BATCHES, atoms, lambda, &dictionary, err);
    if (rc)
        goto done;
    struct spl_error why = {0};
    coder = spl_coder_create(&dictionary, &settings, o->memory_bytes, o->threads, &why);
    rc = coder ? code_all(o, some ? &coded : o->source, coder, &sums, err)
               : spl_fail_field(err, why.code, why.field, "%s", why.message);
    if (rc)
        goto done;
    struct spl_textures_row *row = add_row(report, name, lambda > 0 ? SPL_TEXTURES_OURS : SPL_TEXTURES_PAPER);
    for (int k = 0; k <= SPL_ATOMS_MAX; k++) {
        used += (uint64_t)k * sums.histogram[k];
        row->shares[k] = (double)sums.histogram[k] / (double)sums.splats;
    }
    double splats = (double)o->origin->splats, texels = (double)dictionary.count * spl_texture_values(dictionary.size);
    double stored = (double)spl_atoms_write(&dictionary, NULL);
    double bits = lambda > 0 ? (double)sums.bits : (double)used * (log2(atoms) + weight_bits);
    row->color = lambda > 0 ? find_color_bytes(o) : 3;
    row->codes = bits / 8 / (double)sums.splats * (double)o->source->count / splats;
    row->shared = (lambda > 0 ? stored : texels) / splats;
    row->psnr = to_psnr(sums.squared_error, (double)sums.values);
    row->atoms = (double)used / (double)sums.splats;
    row->count = dictionary.count;
    row->sample = some ? trained.count : 0;
    row->seconds = (double)(spl_now_ns() - begin_ns) / SPL_NS_PER_S;
done:
    spl_coder_destroy(coder);
    spl_dictionary_finish(&dictionary);
    return rc;
}

/* How far textures are from their mean colours. */
static int measure_colors(const struct spl_textures_options *o, struct spl_textures_report *report,
                          struct spl_error *err)
{
    const struct spl_texture_source *source = o->source;
    uint64_t stride = source->count / compared_textures + 1, compared = 0;
    uint32_t texels = source->size * source->size;
    double error = 0;
    for (uint64_t i = 0; i < source->count; i += stride, compared++) {
        uint8_t texture[SPL_TEXTURE_VALUES_MAX];
        int rc = source->read(source->context, i, 1, texture, err);
        if (rc)
            return rc;
        for (uint32_t c = 0; c < 3; c++) {
            const uint8_t *plane = texture + c * texels;
            double sum = 0;
            for (uint32_t t = 0; t < texels; t++)
                sum += plane[t];
            double mean = round(sum / texels);
            for (uint32_t t = 0; t < texels; t++)
                error += (plane[t] - mean) * (plane[t] - mean);
        }
    }
    struct spl_textures_row *row = add_row(report, "colours only", SPL_TEXTURES_OTHER);
    row->color = find_color_bytes(o);
    row->psnr = to_psnr(error, (double)compared * 3 * texels * 255 * 255);
    if (o->projected) {
        row->packed = o->projected->packed.colored;
        row->left_out = o->projected->left_out.colored;
    }
    return 0;
}

/* Photographs put onto splats, and, as a reference, each splat's own texture. */
static void add_photographs(const struct spl_textures_options *o, struct spl_textures_report *report)
{
    static const struct {
        const char *name;
        double bytes; /* a pixel */
    } forms[SPL_PROJECTED_COUNT] = {{"LOD 0", 3},       {"LOD 0 BC7", 1},      {"LOD 0 BC1", 0.5},
                                    {"LOD 1", 3.0 / 4}, {"LOD 1 BC7", 1. / 4}, {"LOD 1 BC1", 0.5 / 4}};
    const struct spl_projected_report *p = o->projected;
    for (int k = 0; p && k < SPL_PROJECTED_COUNT; k++) {
        struct spl_textures_row *row = add_row(report, forms[k].name, SPL_TEXTURES_PHOTOGRAPHS);
        row->color = sizeof *o->origin->photo;
        row->shared = mips * forms[k].bytes * (double)o->origin->pixels / (double)o->origin->splats;
        row->psnr = p->texture[k];
        row->packed = p->packed.projected[k];
        row->left_out = p->left_out.projected[k];
    }
    struct spl_textures_row *row = add_row(report, "a texture for each splat", SPL_TEXTURES_OTHER);
    row->codes = mips * spl_texture_values(o->source->size) * (double)o->source->count / (double)o->origin->splats;
    row->psnr = INFINITY;
}

/* The dataset as it was packed. */
static void add_packed(const struct spl_textures_options *o, struct spl_textures_report *report)
{
    const struct spl_dataset_info *info = spl_dataset_get_info(o->dataset);
    const json_t *textures = json_object_get(spl_dataset_get_meta(o->dataset), "textures");
    uint64_t histogram[SPL_ATOMS_MAX + 1] = {0}, used = 0;
    double splats = (double)info->splats * 8, textured = json_number_value(json_object_get(textures, "splats"));
    if (!info->atoms || spl_dataset_count_atoms(o->dataset, histogram, NULL))
        return;
    for (int k = 1; k <= SPL_ATOMS_MAX; k++)
        used += (uint64_t)k * histogram[k];
    struct spl_textures_row *row = add_row(report, "as packed", SPL_TEXTURES_PACKED);
    row->color = (double)info->attribute_bits[SPL_ATTRIBUTE_COLOR] / splats;
    row->codes = (double)info->attribute_bits[SPL_ATTRIBUTE_TEXTURE] / splats;
    row->shared = (double)info->attribute_bits[SPL_ATTRIBUTE_DICTIONARY] / splats;
    row->psnr =
        json_is_number(json_object_get(textures, "psnr")) ? json_number_value(json_object_get(textures, "psnr")) : NAN;
    row->atoms = textured > 0 ? (double)used / textured : NAN;
    row->count = info->atoms;
    if (o->projected) {
        row->packed = o->projected->packed.textured;
        row->left_out = o->projected->left_out.textured;
    }
}

static double find_geometry_bytes(const struct spl_dataset *dataset)
{
    const struct spl_dataset_info *info = spl_dataset_get_info(dataset);
    uint64_t bits = 0;
    for (int a = 0; a < SPL_ATTRIBUTE_COUNT; a++)
        if (a != SPL_ATTRIBUTE_COLOR && a != SPL_ATTRIBUTE_TEXTURE && a != SPL_ATTRIBUTE_DICTIONARY)
            bits += info->attribute_bits[a];
    for (uint32_t s = 0; s < info->stream_count; s++)
        bits += info->streams[s].bits;
    return (double)bits / 8 / (double)info->splats;
}

/* The paper's codings. One that is too large for the memory is left away by name. */
static int measure_paper(const struct spl_textures_options *o, struct spl_textures_report *report,
                         struct spl_error *err)
{
    static const struct {
        const char *name;
        uint32_t atoms, weight_bits;
        enum spl_textures_runs run;
    } codings[] = {{"paper D8W4", 256, 4, SPL_TEXTURES_RUN_D8W4},
                   {"paper D12W4", 4096, 4, SPL_TEXTURES_RUN_D12W4},
                   {"paper D16W8", 65536, 8, SPL_TEXTURES_RUN_D16W8}};
    int rc = 0;
    for (size_t i = 0; !rc && i < sizeof codings / sizeof *codings; i++) {
        struct spl_error why = {0};
        if (!(o->runs & codings[i].run))
            continue;
        rc = measure_coding(o, report, codings[i].name, codings[i].atoms, codings[i].weight_bits, 0, &why);
        if (rc == SPL_E_LIMIT) {
            snprintf(report->left_away, sizeof report->left_away, "%s: %.400s", codings[i].name, why.message);
            rc = 0;
        } else if (rc)
            spl_fail_field(err, rc, why.field, "%s", why.message);
    }
    return rc;
}

/* k-SVD and mini-batches on the same textures. */
static int measure_trainings(const struct spl_textures_options *o, struct spl_textures_report *report,
                             struct spl_error *err)
{
    struct watch ksvd = {o, "k-SVD", report->ksvd, &report->ksvd_epochs};
    struct watch batches = {o, "mini-batches", report->batches, &report->batches_epochs};
    struct spl_dictionary dictionary = {0};
    struct thinned train_on = {o->source, find_stride(o, compared_atoms), 0};
    struct spl_texture_source thinned = thin(&train_on);
    const struct spl_texture_source *trained = train_on.stride > 1 ? &thinned : o->source;
    report->dictionary = compared_atoms;
    int rc = train(o, trained, &batches, SPL_TRAIN_BATCHES, compared_atoms, 0, &dictionary, err);
    spl_dictionary_finish(&dictionary);
    if (!rc)
        rc = train(o, trained, &ksvd, SPL_TRAIN_KSVD, compared_atoms, 0, &dictionary, err);
    spl_dictionary_finish(&dictionary);
    return rc;
}

int spl_textures_measure(const struct spl_textures_options *o, struct spl_textures_report *report,
                         struct spl_error *err)
{
    static const double shares[] = {0.06, 0.03, 0.015, 0.0075}; /* lambda, of the error at the cut-off */
    *report = (struct spl_textures_report){.splats = o->origin->splats};
    if (!o->source->count || o->source->size < 8 || o->source->size % 8)
        return spl_fail(err, SPL_E_INPUT,
                        "%llu textures of %u texels a side: nothing to compare; there must be some, of 8, 16 "
                        "or 32",
                        (unsigned long long)o->source->count, o->source->size);
    if (o->dataset && spl_dataset_get_info(o->dataset)->ids != o->origin->splats)
        return spl_fail_field(err, SPL_E_INPUT, "splats", "%s has %llu splats, the textures are of %llu: pack again",
                              spl_dataset_get_info(o->dataset)->id,
                              (unsigned long long)spl_dataset_get_info(o->dataset)->ids,
                              (unsigned long long)o->origin->splats);
    report->geometry = o->dataset ? find_geometry_bytes(o->dataset) : 0;
    int rc = measure_colors(o, report, err);
    if (!rc)
        add_photographs(o, report);
    if (!rc && o->dataset)
        add_packed(o, report);
    if (!rc && o->runs & SPL_TEXTURES_RUN_TRAININGS)
        rc = measure_trainings(o, report, err);
    if (!rc)
        rc = measure_paper(o, report, err);
    for (size_t i = 0; !rc && o->runs & SPL_TEXTURES_RUN_ADAPTIVE && i < sizeof shares / sizeof *shares; i++) {
        char name[40];
        double lambda = shares[i] * spl_texture_values(o->source->size) * pow(10, -cut_off / 10);
        snprintf(name, sizeof name, "adaptive, lambda %.2g", lambda);
        rc = measure_coding(o, report, name, adaptive_atoms, 6, (float)lambda, err);
    }
    return rc;
}
