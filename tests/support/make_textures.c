/* Textures for tests; see make_textures.h. Anything that goes wrong ends the test program. */
#include "support/make_textures.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

#include "dataset/dataset.h"
#include "dataset/rewrite.h"
#include "sparse/atom.h"
#include "support/make_dataset.h"

static uint32_t hash(uint32_t a, uint32_t b)
{
    uint32_t h = a * 0x9e3779b1u ^ (b + 0x7f4a7c15u) * 0x85ebca6bu;
    h ^= h >> 15;
    h *= 0xc2b2ae35u;
    return h ^ h >> 16;
}

static double unit(uint32_t a, uint32_t b)
{
    return hash(a, b) / 4294967296.0;
}

struct spl_dictionary make_dictionary(uint32_t count, uint32_t size, uint32_t seed)
{
    uint32_t plane = size * size, n = 3 * plane;
    struct spl_dictionary d;
    struct spl_waves waves;
    double *value = malloc(n * sizeof *value);
    float *atom = malloc(n * sizeof *atom);
    spl_assert(!spl_dictionary_init(&d, count, size, NULL) && value && atom);
    spl_waves_init(&waves, size);
    for (uint32_t a = 0; a < count; a++) {
        uint32_t key = hash(seed, a);
        double angle = 6.2831853 * unit(key, 1), wave = 1 + 5 * unit(key, 2) * unit(key, 3), square = 0;
        for (uint32_t c = 0; c < 3; c++) {
            double mean = 0, share = 0.4 + unit(key, 4 + c), phase = unit(key, 8) + 0.2 * unit(key, 9 + c);
            for (uint32_t i = 0; i < plane; i++) {
                double x = (i % size + 0.5) / size - 0.5, y = (i / size + 0.5) / size - 0.5;
                mean += value[c * plane + i] =
                    share * cos(6.2831853 * (wave * (x * cos(angle) + y * sin(angle)) + phase));
            }
            for (uint32_t i = 0; i < plane; i++)
                value[c * plane + i] -= mean / plane;
        }
        for (uint32_t i = 0; i < n; i++)
            square += value[i] * value[i];
        for (uint32_t i = 0; i < n; i++)
            atom[i] = (float)(value[i] / sqrt(square));
        int16_t *coefficient = d.coefficients + (size_t)a * n;
        spl_waves_analyse(&waves, atom, 0.01f, coefficient);
        spl_assert(spl_waves_synthesise(&waves, coefficient, d.texels + (size_t)a * n, &d.scale[a]));
    }
    free(value);
    free(atom);
    return d;
}

void make_code(const struct spl_dictionary *dictionary, uint32_t planes, uint32_t seed, uint32_t chunk, uint32_t splats,
               struct spl_chunk_code *code)
{
    uint32_t key = hash(seed, chunk), index_max = 0;
    memset(code, 0, sizeof *code);
    code->splats = splats;
    while (1u << index_max < dictionary->count)
        index_max++;
    for (uint32_t t = 0; t < planes; t++) {
        uint32_t bits = 1 + hash(key, t) % 8;
        double largest = 0.1 * sqrt(spl_texture_values(dictionary->size)) / (1 + t);
        code->plane[t] = (struct spl_code_plane){
            .step_code = (uint8_t)lround(fmin(fmax(56 + 4 * log2(largest / (1 << bits >> 1)), 0), SPL_CODE_STEPS - 1)),
            .gap_code = (uint8_t)(hash(key, 50 + t) % SPL_CODE_GAPS),
            .index_bits = (uint8_t)(t == 0 && chunk % 4 == 1 ? 0 : index_max),
            .weight_bits = (uint8_t)bits};
        code->plane[t].step = spl_code_step(code->plane[t].step_code);
        code->plane[t].gap = spl_code_gap(code->plane[t].gap_code);
    }
    for (uint32_t i = 0; i < splats && chunk % 5 != 3; i++) {
        struct spl_splat_code *s = &code->splat[i];
        s->count = (uint8_t)(hash(key, 100 + i) % (planes + 1));
        for (uint32_t t = 0; t < s->count; t++) {
            const struct spl_code_plane *p = &code->plane[t];
            uint32_t random = hash(key, 1000 + 8 * i + t);
            s->atom[t] = (uint16_t)((random & ((1u << p->index_bits) - 1)) % dictionary->count);
            s->weight[t] = (int16_t)((int)(random >> 16 & ((1u << p->weight_bits) - 1)) - (1 << p->weight_bits >> 1));
        }
        code->planes = s->count > code->planes ? s->count : code->planes;
    }
}

struct making {
    const struct spl_dataset *from;
    const struct spl_dictionary *dictionary;
    uint32_t planes, seed;
    uint32_t discs; /* chunks of them so far: codes do not depend on how many lines there are */
};

static int code_chunk(void *context, uint64_t chunk, struct spl_chunk_code *code, struct spl_error *err)
{
    struct making *m = context;
    const struct spl_chunk *header = &spl_dataset_get_chunks(m->from, &(uint64_t){0})[chunk];
    (void)err;
    if (spl_chunk_kind(header) == SPL_CHUNK_DISCS)
        make_code(m->dictionary, m->planes, m->seed, m->discs++, header->count, code);
    else
        *code = (struct spl_chunk_code){.splats = header->count};
    return SPL_OK;
}

static void must(int rc, const struct spl_error *err)
{
    if (!rc)
        return;
    fprintf(stderr, "make_textures: %s\n", err->message);
    abort();
}

void make_textured_file(const struct spl_dataset *from, const struct spl_dictionary *dictionary, uint32_t planes,
                        uint32_t seed, const char *path)
{
    struct making making = {from, dictionary, planes, seed, 0};
    struct spl_rewrite what = {.from = from, .dictionary = dictionary, .code_chunk = code_chunk, .context = &making};
    struct spl_error err = {0};
    must(spl_dataset_rewrite(&what, path, &err), &err);
}

struct spl_dataset *make_textured(const struct spl_dataset *from, const struct spl_dictionary *dictionary,
                                  uint32_t planes, uint32_t seed)
{
    char folder[256], path[300];
    struct spl_dataset *dataset;
    struct spl_error err = {0};
    make_folder(folder);
    snprintf(path, sizeof path, "%s/textured.spld", folder);
    make_textured_file(from, dictionary, planes, seed, path);
    int rc = spl_dataset_open(path, true, &dataset, &err);
    unlink(path);
    rmdir(folder);
    must(rc, &err);
    return dataset;
}
