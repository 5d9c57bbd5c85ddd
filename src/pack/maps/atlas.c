/* Atlases of colours: halving, filling, encoding. Rows are independent of each other, so threads change nothing. */
#include "pack/maps/atlas.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "base/memory.h"
#include "base/parallel.h"
#include "dataset/block.h"

enum { apron = SPL_MAP_APRON, halvings_max = 12 };

float spl_linear_of_srgb(float srgb)
{
    float v = srgb / 255;
    return v <= 0.04045f ? v / 12.92f : powf((v + 0.055f) / 1.055f, 2.4f);
}

float spl_srgb_of_linear(float linear)
{
    float v = fminf(fmaxf(linear, 0), 1);
    return 255 * (v <= 0.0031308f ? 12.92f * v : 1.055f * powf(v, 1 / 2.4f) - 0.055f);
}

int spl_atlas_init(struct spl_atlas *atlas, uint32_t side, struct spl_error *err)
{
    *atlas = (struct spl_atlas){
        .side = side, .width = spl_polar_width(side, apron), .height = spl_polar_height(side, apron)};
    atlas->texels = spl_alloc((size_t)atlas->width * atlas->height, sizeof *atlas->texels, err);
    return atlas->texels ? SPL_OK : SPL_E_NOMEM;
}

void spl_atlas_finish(struct spl_atlas *atlas)
{
    free(atlas->texels);
    *atlas = (struct spl_atlas){0};
}

/* Adds the bilinear texel at a place within a chart proper, times `share`. */
static void add_bilinear(const struct spl_atlas *atlas, const double place[2], float share, float sum[4])
{
    double x = place[0] - 0.5, y = place[1] - 0.5;
    float u = (float)(x - floor(x)), v = (float)(y - floor(y));
    const float(*t)[4] = (const float(*)[4])atlas->texels + (size_t)y * atlas->width + (size_t)x;
    for (int c = 0; c < 4; c++)
        sum[c] += share * ((t[0][c] * (1 - u) + t[1][c] * u) * (1 - v) +
                           (t[atlas->width][c] * (1 - u) + t[atlas->width + 1][c] * u) * v);
}

void spl_atlas_scale(struct spl_atlas *atlas, const float factors[3])
{
    for (size_t i = 0; i < (size_t)atlas->width * atlas->height; i++)
        for (int c = 0; c < 3; c++)
            atlas->texels[i][c] *= factors[c];
}

bool spl_atlas_is_full(const struct spl_atlas *atlas)
{
    size_t count = (size_t)atlas->width * atlas->height, i = 0;
    while (i < count && atlas->texels[i][3] > 0)
        i++;
    return i == count;
}

struct job {
    const struct spl_atlas *from;
    struct spl_atlas *to;
    uint32_t *words;
    double *errors; /* by row of blocks */
};

/* A texel of half the side: the four below it; where it repeats another chart, what that has, at four places of it. */
static void halve_rows(void *context, size_t begin, size_t end, unsigned worker)
{
    const struct job *job = context;
    const struct spl_atlas *from = job->from, *to = job->to;
    (void)worker;
    for (uint32_t y = (uint32_t)begin; y < end; y++)
        for (uint32_t x = 0; x < to->width; x++) {
            float *out = to->texels[(size_t)y * to->width + x];
            memset(out, 0, sizeof *to->texels);
            if (spl_polar_is_proper(to->side, apron, x, y)) {
                uint32_t cap = to->side + 2 * apron, chart = x < cap ? 0 : x < 2 * cap ? 1 : 2;
                // charts begin at multiples of both
                uint32_t fx = 2 * x - (2 * chart + 1) * apron, fy = 2 * y - apron;
                for (uint32_t k = 0; k < 4; k++)
                    for (int c = 0; c < 4; c++)
                        out[c] += 0.25f * from->texels[(size_t)(fy + k / 2) * from->width + fx + k % 2][c];
                continue;
            }
            for (int k = 0; k < 4; k++) {
                double d[3], place[2];
                spl_polar_direction(to->side, apron, (double[2]){x + 0.25 + 0.5 * (k % 2), y + 0.25 + 0.5 * (k / 2)},
                                    d);
                spl_polar_place(from->side, apron, d, place);
                add_bilinear(from, place, 0.25f, out);
            }
        }
}

int spl_atlas_halve(const struct spl_atlas *atlas, unsigned threads, struct spl_atlas *half, struct spl_error *err)
{
    int rc = spl_atlas_init(half, atlas->side / 2, err);
    struct job job = {.from = atlas, .to = half};
    if (!rc)
        spl_parallel_for(threads, half->height, 8, halve_rows, &job);
    return rc;
}

/* What lacks weight takes it from the coarser level. */
static void pull_rows(void *context, size_t begin, size_t end, unsigned worker)
{
    const struct job *job = context;
    const struct spl_atlas *from = job->from, *to = job->to;
    (void)worker;
    for (uint32_t y = (uint32_t)begin; y < end; y++)
        for (uint32_t x = 0; x < to->width; x++) {
            float *out = to->texels[(size_t)y * to->width + x];
            if (out[3] <= 0) {
                double d[3], place[2];
                memset(out, 0, sizeof *to->texels);
                spl_polar_direction(to->side, apron, (double[2]){x + 0.5, y + 0.5}, d);
                spl_polar_place(from->side, apron, d, place);
                add_bilinear(from, place, 1, out);
            }
            for (int c = 0; c < 3; c++)
                out[c] /= out[3];
            out[3] = 1;
        }
}

/* The coarsest level: the mean where there is nothing, grey where there is nothing at all. */
static void fill_last(struct spl_atlas *atlas)
{
    float sum[4] = {0};
    size_t count = (size_t)atlas->width * atlas->height;
    for (size_t i = 0; i < count; i++)
        for (int c = 0; c < 4; c++)
            sum[c] += atlas->texels[i][c];
    for (int c = 0; c < 3; c++)
        sum[c] = sum[3] > 0 ? sum[c] / sum[3] : 0.2f;
    for (size_t i = 0; i < count; i++) {
        float *t = atlas->texels[i];
        for (int c = 0; c < 3; c++)
            t[c] = t[3] > 0 ? t[c] / t[3] : sum[c];
        t[3] = 1;
    }
}

/* Weights say how sure a texel is, and only whether it has any counts here: equal ones let a level's means be those of
 * the area that is known. */
static void even_weights(struct spl_atlas *atlas)
{
    size_t count = (size_t)atlas->width * atlas->height;
    for (size_t i = 0; i < count; i++) {
        float *t = atlas->texels[i];
        for (int c = 0; c < 3; c++)
            t[c] = t[3] > 0 ? t[c] / t[3] : 0;
        t[3] = t[3] > 0;
    }
}

/* What repeats another chart and is empty takes the texel there. */
static void repeat_rows(void *context, size_t begin, size_t end, unsigned worker)
{
    const struct job *job = context;
    struct spl_atlas *to = job->to;
    (void)worker;
    for (uint32_t y = (uint32_t)begin; y < end; y++)
        for (uint32_t x = 0; x < to->width; x++) {
            float *out = to->texels[(size_t)y * to->width + x];
            double d[3], place[2];
            if (out[3] > 0 || spl_polar_is_proper(to->side, apron, x, y))
                continue;
            spl_polar_direction(to->side, apron, (double[2]){x + 0.5, y + 0.5}, d);
            spl_polar_place(to->side, apron, d, place);
            if (spl_polar_is_proper(to->side, apron, (uint32_t)place[0], (uint32_t)place[1]))
                memcpy(out, to->texels[(size_t)place[1] * to->width + (size_t)place[0]], sizeof *to->texels);
        }
}

int spl_atlas_fill(struct spl_atlas *atlas, unsigned threads, struct spl_error *err)
{
    struct spl_atlas levels[halvings_max] = {{0}};
    int last = 0, rc = SPL_OK;
    struct job repeated = {.to = atlas};
    even_weights(atlas);
    spl_parallel_for(threads, atlas->height, 8, repeat_rows, &repeated);
    levels[0] = *atlas;
    while (!rc && last + 1 < halvings_max && levels[last].side % 2 == 0 && levels[last].side > 4)
        if (!(rc = spl_atlas_halve(&levels[last], threads, &levels[last + 1], err)))
            last++;
    if (!rc)
        fill_last(&levels[last]);
    for (int l = last; l-- > 0 && !rc;) {
        struct job job = {.from = &levels[l + 1], .to = &levels[l]};
        spl_parallel_for(threads, levels[l].height, 8, pull_rows, &job);
    }
    for (int l = 1; l < halvings_max; l++)
        spl_atlas_finish(&levels[l]);
    return rc;
}

static void encode_rows(void *context, size_t begin, size_t end, unsigned worker)
{
    const struct job *job = context;
    const struct spl_atlas *from = job->from;
    size_t across = from->width / 4;
    (void)worker;
    for (size_t row = begin; row < end; row++)
        for (size_t block = 0; block < across; block++) {
            float texels[16][3];
            for (size_t i = 0; i < 16; i++)
                for (int c = 0; c < 3; c++)
                    texels[i][c] =
                        spl_srgb_of_linear(from->texels[(4 * row + i / 4) * from->width + 4 * block + i % 4][c]);
            job->errors[row] += spl_block_encode((const float(*)[3])texels, job->words + 2 * (row * across + block));
        }
}

double spl_atlas_encode(const struct spl_atlas *atlas, unsigned threads, uint32_t *words)
{
    double errors[(SPL_MAP_SIDE_MAX + 2 * apron) / 4] = {0}, sum = 0;
    struct job job = {.from = atlas, .words = words, .errors = errors};
    spl_parallel_for(threads, atlas->height / 4, 2, encode_rows, &job);
    for (uint32_t row = 0; row < atlas->height / 4; row++)
        sum += errors[row];
    return sum;
}

void spl_atlas_get(const struct spl_atlas *atlas, const double direction[3], float color[3])
{
    float sum[4] = {0};
    double place[2];
    spl_polar_place(atlas->side, apron, direction, place);
    add_bilinear(atlas, place, 1, sum);
    for (int c = 0; c < 3; c++)
        color[c] = spl_srgb_of_linear(sum[c] / sum[3]);
}
