/* Photographs left out of packing against renders.
 *
 * What textures can add is detail, so an error's other causes are taken away one by one: exposure, by one factor a
 * channel, the coloured render's for both (a least-squares fit would forgive blur); light that differs from place to
 * place, by the means of blocks; and place, since a sharp edge a pixel aside costs as much as no edge at all: blocks of
 * the photograph are moved to where they fit the render best. What remains the render does not hold. Blocks are summed
 * in their order. */
#include "measure/left_out.h"

#include <math.h>
#include <stdlib.h>

#include "base/memory.h"
#include "base/parallel.h"

enum { SHIFTS = 2 * SPL_LEFT_OUT_SHIFT + 1 };
static const float widths_px[] = {2, 8}; /* between one class and the next */

double spl_left_out_psnr(const struct spl_left_out *sums, enum spl_left_out_width width, enum spl_left_out_kind kind,
                         enum spl_left_out_step step)
{
    double mean = sums->squared[width][kind][step] / (3 * (double)sums->pixels[width]);
    return sums->pixels[width] ? -10 * log10(mean / (255 * 255)) : (double)NAN;
}

struct compare {
    const struct spl_left_out_images *images;
    int width, height, across;
    uint8_t *counts; /* by pixel: 1 + enum spl_left_out_width; 0 = not compared */
    float factor[3];
    struct spl_left_out *blocks;
};

static void mark_rows(void *context, size_t begin, size_t end, unsigned worker)
{
    struct compare *c = context;
    const uint8_t *photograph = c->images->photograph->pixels;
    int r = SPL_LEFT_OUT_SHIFT;
    (void)worker;
    for (int y = (int)begin; y < (int)end; y++)
        for (int x = 0; x < c->width; x++) {
            float width = c->images->width_px[(size_t)y * (size_t)c->width + (size_t)x];
            bool there = !isnan(width) && x >= r && y >= r && x + r < c->width && y + r < c->height;
            for (int i = 0; there && i < SHIFTS * SHIFTS; i++) {
                size_t at = (size_t)(y + i / SHIFTS - r) * (size_t)c->width + (size_t)(x + i % SHIFTS - r);
                there = photograph[4 * at + 3] == 255;
            }
            int class = 1;
            while (class < SPL_LEFT_OUT_WIDTHS && width > widths_px[class - 1])
                class ++;
            c->counts[(size_t)y * (size_t)c->width + (size_t)x] = (uint8_t)(there ? class : 0);
        }
}

static void find_factors(struct compare *c)
{
    const uint8_t *photograph = c->images->photograph->pixels;
    const uint8_t *render = c->images->render[SPL_LEFT_OUT_COLORED]->pixels;
    uint64_t theirs[3] = {0}, ours[3] = {0};
    for (size_t i = 0; i < (size_t)c->width * (size_t)c->height; i++)
        for (size_t k = 0; c->counts[i] && k < 3; k++) {
            theirs[k] += photograph[4 * i + k];
            ours[k] += render[4 * i + k];
        }
    for (int k = 0; k < 3; k++)
        c->factor[k] = ours[k] ? (float)((double)theirs[k] / (double)ours[k]) : 1;
}

/* Errors of one block, by width: squared, and less what its means differ by. */
struct block {
    double squared[SPL_LEFT_OUT_WIDTHS], levelled[SPL_LEFT_OUT_WIDTHS], all_levelled;
};

/* The block at (x0, y0), the photograph being moved by (dx, dy). */
static struct block add_block(const struct compare *c, int x0, int y0, const uint8_t *render, const float factor[3],
                              int dx, int dy)
{
    const uint8_t *photograph = c->images->photograph->pixels;
    struct block block = {0};
    double sum[SPL_LEFT_OUT_WIDTHS][3] = {0}, count[SPL_LEFT_OUT_WIDTHS] = {0};
    for (int y = y0; y < y0 + SPL_LEFT_OUT_BLOCK && y < c->height; y++)
        for (int x = x0; x < x0 + SPL_LEFT_OUT_BLOCK && x < c->width; x++) {
            size_t at = (size_t)y * (size_t)c->width + (size_t)x;
            size_t there = (size_t)(y + dy) * (size_t)c->width + (size_t)(x + dx);
            if (!c->counts[at])
                continue;
            int w = c->counts[at] - 1;
            count[w]++;
            for (size_t k = 0; k < 3; k++) {
                float d = fminf((float)render[4 * at + k] * factor[k], 255) - (float)photograph[4 * there + k];
                sum[w][k] += (double)d;
                block.squared[w] += (double)(d * d);
            }
        }
    for (int w = 0; w < SPL_LEFT_OUT_WIDTHS; w++) {
        block.levelled[w] = block.squared[w];
        for (int k = 0; k < 3; k++)
            block.levelled[w] -= sum[w][k] * sum[w][k] / fmax(count[w], 1);
        block.levelled[w] = fmax(block.levelled[w], 0);
        block.all_levelled += block.levelled[w];
    }
    return block;
}

static void compare_kind(const struct compare *c, int x0, int y0, enum spl_left_out_kind kind, struct spl_left_out *out)
{
    static const float as_it_is[3] = {1, 1, 1};
    const uint8_t *render = c->images->render[kind]->pixels;
    struct block plain = add_block(c, x0, y0, render, as_it_is, 0, 0),
                 matched = add_block(c, x0, y0, render, c->factor, 0, 0);
    struct block best = matched;
    for (int i = 0; i < SHIFTS * SHIFTS; i++) {
        struct block moved =
            add_block(c, x0, y0, render, c->factor, i % SHIFTS - SPL_LEFT_OUT_SHIFT, i / SHIFTS - SPL_LEFT_OUT_SHIFT);
        if (moved.all_levelled < best.all_levelled)
            best = moved;
    }
    for (int w = 0; w < SPL_LEFT_OUT_WIDTHS; w++) {
        out->squared[w][kind][SPL_LEFT_OUT_PLAIN] = plain.squared[w];
        out->squared[w][kind][SPL_LEFT_OUT_MATCHED] = matched.squared[w];
        out->squared[w][kind][SPL_LEFT_OUT_LEVELLED] = matched.levelled[w];
        out->squared[w][kind][SPL_LEFT_OUT_REGISTERED] = best.levelled[w];
    }
}

static void compare_blocks(void *context, size_t begin, size_t end, unsigned worker)
{
    struct compare *c = context;
    const double bar = pow(10, SPL_LEFT_OUT_BAR / 10.0);
    (void)worker;
    for (size_t i = begin; i < end; i++) {
        struct spl_left_out *out = &c->blocks[i];
        int x0 = (int)i % c->across * SPL_LEFT_OUT_BLOCK, y0 = (int)i / c->across * SPL_LEFT_OUT_BLOCK;
        for (int y = y0; y < y0 + SPL_LEFT_OUT_BLOCK && y < c->height; y++)
            for (int x = x0; x < x0 + SPL_LEFT_OUT_BLOCK && x < c->width; x++) {
                uint8_t counts = c->counts[(size_t)y * (size_t)c->width + (size_t)x];
                if (counts)
                    out->pixels[counts - 1]++;
            }
        for (int kind = 0; kind < SPL_LEFT_OUT_KINDS; kind++)
            compare_kind(c, x0, y0, (enum spl_left_out_kind)kind, out);
        for (int w = 0; w < SPL_LEFT_OUT_WIDTHS; w++) {
            double textured = out->squared[w][SPL_LEFT_OUT_TEXTURED][SPL_LEFT_OUT_LEVELLED];
            double colored = out->squared[w][SPL_LEFT_OUT_COLORED][SPL_LEFT_OUT_LEVELLED];
            out->worse[w] = textured > colored ? out->pixels[w] : 0;
            out->good[w] = textured * bar <= colored ? out->pixels[w] : 0;
        }
    }
}

void spl_left_out_add(struct spl_left_out *sums, const struct spl_left_out *more)
{
    for (int w = 0; w < SPL_LEFT_OUT_WIDTHS; w++) {
        sums->pixels[w] += more->pixels[w];
        sums->worse[w] += more->worse[w];
        sums->good[w] += more->good[w];
        for (int i = 0; i < SPL_LEFT_OUT_KINDS * SPL_LEFT_OUT_STEPS; i++)
            sums->squared[w][i / SPL_LEFT_OUT_STEPS][i % SPL_LEFT_OUT_STEPS] +=
                more->squared[w][i / SPL_LEFT_OUT_STEPS][i % SPL_LEFT_OUT_STEPS];
    }
}

static int check(const struct spl_left_out_images *images, struct spl_error *err)
{
    for (int kind = 0; kind < SPL_LEFT_OUT_KINDS; kind++) {
        const struct spl_image *a = images->photograph, *b = images->render[kind];
        if (a->type != SPL_PIXEL_RGBA8 || b->type != SPL_PIXEL_RGBA8)
            return spl_fail_field(err, SPL_E_INPUT, "color", "the photograph or its render is no RGBA image");
        if (a->width != b->width || a->height != b->height)
            return spl_fail_field(err, SPL_E_INPUT, "width", "the photograph has %u x %u pixels, its render %u x %u",
                                  a->width, a->height, b->width, b->height);
    }
    return SPL_OK;
}

int spl_left_out_compare(const struct spl_left_out_images *images, unsigned threads, struct spl_left_out *out,
                         struct spl_error *err)
{
    *out = (struct spl_left_out){0};
    int rc = check(images, err);
    if (rc)
        return rc;
    uint32_t width = images->photograph->width, height = images->photograph->height;
    uint32_t across = (width + SPL_LEFT_OUT_BLOCK - 1) / SPL_LEFT_OUT_BLOCK;
    size_t blocks = (size_t)across * ((height + SPL_LEFT_OUT_BLOCK - 1) / SPL_LEFT_OUT_BLOCK);
    struct compare c = {.images = images, .width = (int)width, .height = (int)height, .across = (int)across};
    c.counts = spl_alloc_raw((size_t)width * height, 1, err);
    c.blocks = c.counts ? spl_alloc(blocks, sizeof *c.blocks, err) : NULL;
    if (c.blocks) {
        spl_parallel_for(threads, height, 16, mark_rows, &c);
        find_factors(&c);
        spl_parallel_for(threads, blocks, 16, compare_blocks, &c);
        for (size_t i = 0; i < blocks; i++)
            spl_left_out_add(out, &c.blocks[i]);
    }
    rc = c.blocks ? SPL_OK : SPL_E_NOMEM;
    free(c.counts);
    free(c.blocks);
    return rc;
}
