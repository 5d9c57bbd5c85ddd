/* The runs behind `splatd bench --textures`. Trainings are timed one after the other on all threads; a row's PSNR is
 * over all values of all textures, weights and atoms rounded as they are stored. The paper's coding is charged what the
 * paper charges: an index and a weight an atom, counts being implied by its batches, and a byte a texel of the
 * dictionary; ours what the container stores. Photographs are charged all their pixels and mips. */
#include "measure/textures.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "base/clock.h"
#include "base/memory.h"
#include "base/parallel.h"
#include "measure/blocks.h"
#include "sparse/code.h"

enum { coded_chunks = 64, compared_atoms = 1024, adaptive_atoms = 2048, compared_textures = 50000 };
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

static int train(const struct spl_textures_options *o, struct watch *watch, enum spl_train_method method,
                 uint32_t atoms, float lambda, struct spl_dictionary *out, struct spl_error *err)
{
    const struct spl_train_settings settings = {.method = method,
                                                .dictionary = atoms,
                                                .atoms = SPL_ATOMS_MAX,
                                                .psnr = lambda > 0 ? 0 : (float)cut_off,
                                                .lambda = lambda,
                                                .epochs = o->epochs,
                                                .seed = o->seed,
                                                .memory_bytes = o->memory_bytes,
                                                .threads = o->threads};
    return spl_dictionary_train(o->source, &settings, watch_epoch, watch, out, err);
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
static int code_all(const struct spl_textures_options *o, const struct spl_coder *coder, struct spl_code_sums *sums,
                    struct spl_error *err)
{
    const struct spl_texture_source *source = o->source;
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

static struct spl_textures_row *add_row(struct spl_textures_report *report, const char *name)
{
    spl_assert(report->rows < SPL_TEXTURES_ROWS_MAX);
    struct spl_textures_row *row = &report->row[report->rows++];
    *row = (struct spl_textures_row){.atoms = NAN};
    snprintf(row->name, sizeof row->name, "%s", name);
    return row;
}

/* One row: a dictionary of at most `atoms`, and what coding with it gives. */
static int measure_coding(const struct spl_textures_options *o, struct spl_textures_report *report, const char *name,
                          uint32_t atoms, uint32_t weight_bits, float lambda, struct spl_error *err)
{
    struct watch watch = {.options = o, .what = name};
    struct spl_dictionary dictionary = {0};
    struct spl_coder *coder = NULL;
    struct spl_code_sums sums = {0};
    uint64_t begin_ns = spl_now_ns(), used = 0;
    const struct spl_code_settings settings = {
        .atoms = SPL_ATOMS_MAX, .psnr = lambda > 0 ? 0 : (float)cut_off, .lambda = lambda, .weight_bits = weight_bits};
    int rc = train(o, &watch, SPL_TRAIN_BATCHES, atoms, lambda, &dictionary, err);
    if (rc)
        goto done;
    struct spl_error why = {0};
    coder = spl_coder_create(&dictionary, &settings, o->memory_bytes, o->threads, &why);
    rc = coder ? code_all(o, coder, &sums, err) : spl_fail_field(err, why.code, why.field, "%s", why.message);
    if (rc)
        goto done;
    struct spl_textures_row *row = add_row(report, name);
    for (int k = 1; k <= SPL_ATOMS_MAX; k++)
        used += (uint64_t)k * sums.histogram[k];
    double splats = (double)o->splats, texels = (double)dictionary.count * spl_texture_values(dictionary.size);
    row->paper = !(lambda > 0);
    row->codes = row->paper ? (double)used * (log2(atoms) + weight_bits) / 8 / splats : (double)sums.bits / 8 / splats;
    row->dictionary = (texels + (row->paper ? 0 : 4.0 * dictionary.count)) / splats;
    row->psnr = to_psnr(sums.squared_error, (double)sums.values);
    row->atoms = (double)used / (double)sums.splats;
    row->count = dictionary.count;
    row->seconds = (double)(spl_now_ns() - begin_ns) / SPL_NS_PER_S;
done:
    spl_coder_destroy(coder);
    spl_dictionary_finish(&dictionary);
    return rc;
}

enum { plain, bc7, bc1, half, half_bc7, half_bc1, baselines };

static void code_blocks(uint8_t *pixels, uint32_t size, void (*code)(const uint8_t[16][3], uint8_t[16][3]))
{
    for (uint32_t y = 0; y < size; y += 4)
        for (uint32_t x = 0; x < size; x += 4) {
            uint8_t in[16][3], out[16][3];
            for (uint32_t i = 0; i < 16; i++)
                memcpy(in[i], pixels + 3 * ((y + i / 4) * size + x + i % 4), 3);
            code((const uint8_t(*)[3])in, out);
            for (uint32_t i = 0; i < 16; i++)
                memcpy(pixels + 3 * ((y + i / 4) * size + x + i % 4), out[i], 3);
        }
}

/* Half the size by boxes of 2 × 2. */
static void halve(const uint8_t *in, uint32_t size, uint8_t *out)
{
    for (uint32_t i = 0; i < 3 * size * size / 4; i++) {
        uint32_t c = i % 3, x = i / 3 % (size / 2) * 2, y = i / 3 / (size / 2) * 2;
        const uint8_t *at = in + 3 * (y * size + x) + c;
        out[i] = (uint8_t)((at[0] + at[3] + at[3 * size] + at[3 * size + 3] + 2) / 4);
    }
}

/* Twice the size, bilinear, the edge repeated. */
static float enlarged(const uint8_t *half_pixels, uint32_t half_size, uint32_t x, uint32_t y, uint32_t c)
{
    uint32_t last = half_size - 1, x0 = x / 2, y0 = y / 2;
    uint32_t x1 = x & 1 ? (x0 < last ? x0 + 1 : last)
                  : x0  ? x0 - 1
                        : 0,
             y1 = y & 1 ? (y0 < last ? y0 + 1 : last)
                  : y0  ? y0 - 1
                        : 0;
    float near =
        0.75f * half_pixels[3 * (y0 * half_size + x0) + c] + 0.25f * half_pixels[3 * (y0 * half_size + x1) + c];
    float far = 0.75f * half_pixels[3 * (y1 * half_size + x0) + c] + 0.25f * half_pixels[3 * (y1 * half_size + x1) + c];
    return 0.75f * near + 0.25f * far;
}

/* Adds the squared errors, of 255, of what one texture is in each baseline. */
static void compare_texture(const uint8_t *texture, uint32_t size, double error[baselines])
{
    uint8_t pixels[SPL_TEXTURE_VALUES_MAX], coded[SPL_TEXTURE_VALUES_MAX];
    uint32_t texels = size * size;
    float mean[3] = {0};
    for (uint32_t i = 0; i < texels; i++)
        for (uint32_t c = 0; c < 3; c++) {
            pixels[3 * i + c] = texture[c * texels + i];
            mean[c] += (float)texture[c * texels + i] / (float)texels;
        }
    for (int kind = plain; kind < baselines; kind++) {
        bool small = kind >= half;
        if (small)
            halve(pixels, size, coded);
        else
            memcpy(coded, pixels, 3 * (size_t)texels);
        if (kind == bc7 || kind == half_bc7)
            code_blocks(coded, small ? size / 2 : size, spl_block_bc7);
        if (kind == bc1 || kind == half_bc1)
            code_blocks(coded, small ? size / 2 : size, spl_block_bc1);
        for (uint32_t i = 0; i < 3 * texels; i++) {
            uint32_t c = i % 3, x = i / 3 % size, y = i / 3 / size;
            float value = kind == plain ? roundf(mean[c])
                          : small       ? enlarged(coded, size / 2, x, y, c)
                                        : (float)coded[i];
            error[kind] += (double)((value - pixels[i]) * (value - pixels[i]));
        }
    }
}

/* Colours alone, and the photographs as they are, at half the size, and in blocks. */
static int measure_baselines(const struct spl_textures_options *o, struct spl_textures_report *report,
                             struct spl_error *err)
{
    static const struct {
        const char *name;
        int kind; /* -1: the textures themselves */
        double bytes;
    } photographs[] = {{"LOD 0", -1, 3},         {"LOD 0 BC7", bc7, 1},           {"LOD 0 BC1", bc1, 0.5},
                       {"LOD 1", half, 3.0 / 4}, {"LOD 1 BC7", half_bc7, 1. / 4}, {"LOD 1 BC1", half_bc1, 0.5 / 4}};
    const struct spl_texture_source *source = o->source;
    uint64_t stride = source->count / compared_textures + 1, compared = 0;
    uint8_t texture[SPL_TEXTURE_VALUES_MAX];
    double error[baselines] = {0};
    for (uint64_t i = 0; i < source->count; i += stride, compared++) {
        int rc = source->read(source->context, i, 1, texture, err);
        if (rc)
            return rc;
        compare_texture(texture, source->size, error);
    }
    double values = (double)compared * spl_texture_values(source->size) * 255 * 255;
    add_row(report, "colours only")->psnr = to_psnr(error[plain], values);
    for (size_t i = 0; o->pixels && i < sizeof photographs / sizeof *photographs; i++) {
        struct spl_textures_row *row = add_row(report, photographs[i].name);
        row->codes = mips * photographs[i].bytes * (double)o->pixels / (double)o->splats;
        row->psnr = photographs[i].kind < 0 ? INFINITY : to_psnr(error[photographs[i].kind], values);
    }
    return 0;
}

int spl_textures_measure(const struct spl_textures_options *o, struct spl_textures_report *report,
                         struct spl_error *err)
{
    static const double shares[] = {0.06, 0.03, 0.015, 0.0075}; /* lambda, of the error at the cut-off */
    struct watch ksvd = {o, "k-SVD", report->ksvd, &report->ksvd_epochs};
    struct watch batches = {o, "mini-batches", report->batches, &report->batches_epochs};
    struct spl_dictionary dictionary = {0};
    *report = (struct spl_textures_report){.dictionary = compared_atoms};
    if (!o->source->count || o->source->size < 8 || o->source->size % 8)
        return spl_fail(err, SPL_E_INPUT,
                        "%llu textures of %u texels a side: nothing to compare; there must be some, of 8, 16 "
                        "or 32",
                        (unsigned long long)o->source->count, o->source->size);
    int rc = measure_baselines(o, report, err);
    if (!rc)
        rc = train(o, &batches, SPL_TRAIN_BATCHES, compared_atoms, 0, &dictionary, err);
    spl_dictionary_finish(&dictionary);
    if (!rc)
        rc = train(o, &ksvd, SPL_TRAIN_KSVD, compared_atoms, 0, &dictionary, err);
    spl_dictionary_finish(&dictionary);
    if (!rc)
        rc = measure_coding(o, report, "paper D8W4", 256, 4, 0, err);
    if (!rc)
        rc = measure_coding(o, report, "paper D12W4", 4096, 4, 0, err);
    report->first_adaptive = report->rows;
    for (size_t i = 0; !rc && i < sizeof shares / sizeof *shares; i++) {
        char name[40];
        double lambda = shares[i] * spl_texture_values(o->source->size) * pow(10, -cut_off / 10);
        snprintf(name, sizeof name, "adaptive, lambda %.2g", lambda);
        rc = measure_coding(o, report, name, adaptive_atoms, 6, (float)lambda, err);
        report->adaptives += !rc;
    }
    return rc;
}

double spl_textures_bytes_at(const struct spl_textures_report *report, double psnr)
{
    for (uint32_t i = report->first_adaptive; i + 1 < report->first_adaptive + report->adaptives; i++) {
        const struct spl_textures_row *a = &report->row[i], *b = a + 1;
        if (a->psnr <= psnr && psnr <= b->psnr && a->psnr < b->psnr) {
            double share = (psnr - a->psnr) / (b->psnr - a->psnr);
            double low = log(a->codes + a->dictionary), high = log(b->codes + b->dictionary);
            return exp(low + share * (high - low));
        }
    }
    return NAN;
}

static uint32_t place_epochs(const struct spl_train_progress *epochs, uint32_t count, struct spl_chart_point *points)
{
    for (uint32_t i = 0; i < count; i++) {
        points[i] = (struct spl_chart_point){
            .ms = epochs[i].seconds, .psnr = epochs[i].psnr, .index = -1, .front = i + 1 == count};
        snprintf(points[i].detail, sizeof points[i].detail, "epoch %u, %.2f atoms a splat", epochs[i].epoch,
                 epochs[i].atoms_per_splat);
    }
    return count;
}

int spl_textures_chart_training(const struct spl_textures_report *report, char **svg, size_t *length,
                                struct spl_error *err)
{
    struct spl_chart_point points[2][SPL_TEXTURES_EPOCHS_MAX];
    struct spl_chart_curve curves[2] = {{.name = "mini-batches", .points = points[0]},
                                        {.name = "k-SVD", .color = 1, .points = points[1]}};
    curves[0].count = place_epochs(report->batches, report->batches_epochs, points[0]);
    curves[1].count = place_epochs(report->ksvd, report->ksvd_epochs, points[1]);
    char subtitle[160];
    snprintf(subtitle, sizeof subtitle,
             "%u atoms, up to %d a splat until %g dB, %llu textures; weights not yet quantised", report->dictionary,
             SPL_ATOMS_MAX, cut_off, (unsigned long long)(report->batches_epochs ? report->batches[0].sample : 0));
    return spl_chart_write(&(struct spl_chart){.title = "Training: quality against time",
                                               .subtitle = subtitle,
                                               .axis = "seconds",
                                               .unit = "s",
                                               .note = "a point is an epoch",
                                               .curves = curves,
                                               .curve_count = 2},
                           svg, length, err);
}

int spl_textures_chart_rate(const struct spl_textures_report *report, char **svg, size_t *length, struct spl_error *err)
{
    struct spl_chart_point points[3][SPL_TEXTURES_ROWS_MAX];
    struct spl_chart_curve curves[3] = {{.name = "adaptive", .points = points[0]},
                                        {.name = "the paper's coding", .color = 1, .points = points[1]},
                                        {.name = "photographs", .color = 2, .dash = 2, .points = points[2]}};
    for (uint32_t i = 0; i < report->rows; i++) {
        const struct spl_textures_row *row = &report->row[i];
        bool adaptive = i >= report->first_adaptive && i < report->first_adaptive + report->adaptives;
        if (!isfinite(row->psnr) || !(row->codes > 0))
            continue;
        struct spl_chart_curve *curve = &curves[adaptive ? 0 : row->paper ? 1 : 2];
        struct spl_chart_point *point = &points[curve - curves][curve->count++];
        *point = (struct spl_chart_point){
            .ms = row->codes + row->dictionary, .psnr = row->psnr, .index = -1, .front = adaptive};
        snprintf(point->label, sizeof point->label, "%s", adaptive ? "" : row->name);
        snprintf(point->detail, sizeof point->detail, "%s: codes %.2f, dictionary %.2f", row->name, row->codes,
                 row->dictionary);
    }
    return spl_chart_write(&(struct spl_chart){.title = "Textures: quality against bytes a splat",
                                               .subtitle = "codes and dictionary, or photographs with mips; without "
                                                           "geometry and mean colours",
                                               .axis = "bytes a splat",
                                               .unit = "bytes",
                                               .note = "PSNR against the splats' textures",
                                               .curves = curves,
                                               .curve_count = 3},
                           svg, length, err);
}
