/* BC1 by stb_dxt, decoded again; BC7's mode 6 by the block's main axis, refined by least squares. Both work on sRGB
 * bytes, as GPUs' sRGB formats do. */
#include "measure/blocks.h"

#include <math.h>
#include <string.h>

#define STB_DXT_STATIC
#define STB_DXT_IMPLEMENTATION
#include <stb/stb_dxt.h>

#include "base/memory.h"
#include "base/parallel.h"

static void expand_565(uint32_t packed, int out[3])
{
    uint32_t r = packed >> 11, g = packed >> 5 & 63, b = packed & 31;
    out[0] = (int)(r << 3 | r >> 2);
    out[1] = (int)(g << 2 | g >> 4);
    out[2] = (int)(b << 3 | b >> 2);
}

void spl_block_bc1(const uint8_t in[16][3], uint8_t out[16][3])
{
    unsigned char rgba[64], bits[8];
    int colour[4][3];
    for (int i = 0; i < 16; i++) {
        memcpy(rgba + 4 * i, in[i], 3);
        rgba[4 * i + 3] = 255;
    }
    stb_compress_dxt_block(bits, rgba, 0, STB_DXT_HIGHQUAL);
    uint32_t first = bits[0] | (uint32_t)bits[1] << 8, second = bits[2] | (uint32_t)bits[3] << 8;
    expand_565(first, colour[0]);
    expand_565(second, colour[1]);
    for (int c = 0; c < 3; c++) {
        colour[2][c] = first > second ? (2 * colour[0][c] + colour[1][c]) / 3 : (colour[0][c] + colour[1][c]) / 2;
        colour[3][c] = first > second ? (colour[0][c] + 2 * colour[1][c]) / 3 : 0;
    }
    for (int i = 0; i < 16; i++)
        for (int c = 0; c < 3; c++)
            out[i][c] = (uint8_t)colour[bits[4 + i / 4] >> 2 * (i % 4) & 3][c];
}

static const int weights[16] = {0, 4, 9, 13, 17, 21, 26, 30, 34, 38, 43, 47, 51, 55, 60, 64};

/* The nearest end point of 7 bits a channel over the shared lowest bit. */
static void round_end(const float end[3], int low, int out[3])
{
    for (int c = 0; c < 3; c++) {
        int v = (int)floorf((end[c] - (float)low) / 2 + 0.5f);
        out[c] = (v < 0 ? 0 : v > 127 ? 127 : v) * 2 + low;
    }
}

/* Decodes with the best step for each texel; returns the squared error. */
static float fit(const uint8_t in[16][3], const int a[3], const int b[3], int step[16], uint8_t out[16][3])
{
    float sum = 0;
    for (int i = 0; i < 16; i++) {
        int best = INT32_MAX;
        for (int s = 0; s < 16; s++) {
            int error = 0, color[3];
            for (int c = 0; c < 3; c++) {
                color[c] = (a[c] * (64 - weights[s]) + b[c] * weights[s] + 32) >> 6;
                error += (color[c] - in[i][c]) * (color[c] - in[i][c]);
            }
            if (error >= best)
                continue;
            best = error;
            step[i] = s;
            for (int c = 0; c < 3; c++)
                out[i][c] = (uint8_t)color[c];
        }
        sum += (float)best;
    }
    return sum;
}

/* End points from the block's mean along its main axis, which power iterations find. */
static void start_ends(const uint8_t in[16][3], float a[3], float b[3])
{
    float mean[3] = {0}, axis[3] = {1, 1, 1}, low = 0, high = 0;
    for (int i = 0; i < 16; i++)
        for (int c = 0; c < 3; c++)
            mean[c] += in[i][c] / 16.0f;
    for (int round = 0; round < 8; round++) {
        float next[3] = {0}, norm = 0;
        for (int i = 0; i < 16; i++) {
            float along = 0;
            for (int c = 0; c < 3; c++)
                along += ((float)in[i][c] - mean[c]) * axis[c];
            for (int c = 0; c < 3; c++)
                next[c] += along * ((float)in[i][c] - mean[c]);
        }
        for (int c = 0; c < 3; c++)
            norm += next[c] * next[c];
        if (!(norm > 0))
            break;
        for (int c = 0; c < 3; c++)
            axis[c] = next[c] / sqrtf(norm);
    }
    for (int i = 0; i < 16; i++) {
        float along = 0;
        for (int c = 0; c < 3; c++)
            along += ((float)in[i][c] - mean[c]) * axis[c];
        low = fminf(low, along);
        high = fmaxf(high, along);
    }
    for (int c = 0; c < 3; c++) {
        a[c] = mean[c] + low * axis[c];
        b[c] = mean[c] + high * axis[c];
    }
}

/* The end points that are best for these steps. */
static void refine_ends(const uint8_t in[16][3], const int step[16], float a[3], float b[3])
{
    float aa = 0, ab = 0, bb = 0;
    for (int i = 0; i < 16; i++) {
        float w = (float)weights[step[i]] / 64;
        aa += (1 - w) * (1 - w);
        ab += w * (1 - w);
        bb += w * w;
    }
    float det = aa * bb - ab * ab;
    if (!(det > 1e-3f))
        return;
    for (int c = 0; c < 3; c++) {
        float ya = 0, yb = 0;
        for (int i = 0; i < 16; i++) {
            float w = (float)weights[step[i]] / 64;
            ya += (1 - w) * (float)in[i][c];
            yb += w * (float)in[i][c];
        }
        a[c] = (bb * ya - ab * yb) / det;
        b[c] = (aa * yb - ab * ya) / det;
    }
}

void spl_block_bc7(const uint8_t in[16][3], uint8_t out[16][3])
{
    float a[3], b[3], best = INFINITY;
    int best_step[16] = {0};
    start_ends(in, a, b);
    for (int round = 0; round < 3; round++) {
        for (int low = 0; low < 4; low++) {
            int first[3], second[3], step[16];
            uint8_t tried[16][3];
            round_end(a, low & 1, first);
            round_end(b, low >> 1, second);
            float error = fit(in, first, second, step, tried);
            if (error >= best)
                continue;
            best = error;
            memcpy(best_step, step, sizeof step);
            memcpy(out, tried, sizeof tried);
        }
        refine_ends(in, best_step, a, b);
    }
}

struct coding {
    const uint8_t *from;
    uint8_t *to;
    uint32_t width, height;
    void (*code)(const uint8_t[16][3], uint8_t[16][3]);
};

static void code_rows(void *context, size_t begin, size_t end, unsigned worker)
{
    const struct coding *c = context;
    (void)worker;
    for (size_t row = begin; row < end; row++)
        for (uint32_t left = 0; left < c->width; left += 4) {
            uint8_t in[16][3], out[16][3];
            size_t at[16];
            for (uint32_t i = 0; i < 16; i++) {
                size_t x = left + i % 4, y = row * 4 + i / 4;
                at[i] = 4 * ((y < c->height ? y : c->height - 1) * c->width + (x < c->width ? x : c->width - 1));
                memcpy(in[i], c->from + at[i], 3);
            }
            c->code((const uint8_t(*)[3])in, out);
            for (uint32_t i = 16; i-- > 0;) /* of texels that repeat another, the one that is there comes last */
                memcpy(c->to + at[i], out[i], 3);
        }
}

int spl_blocks_code(const struct spl_pyramid *from, void (*code)(const uint8_t in[16][3], uint8_t out[16][3]),
                    unsigned threads, struct spl_pyramid *out, struct spl_error *err)
{
    *out = *from;
    memset(out->texels, 0, sizeof out->texels);
    for (uint32_t l = 0; l < from->levels; l++) {
        size_t bytes = (size_t)from->width[l] * from->height[l] * 4;
        out->texels[l] = spl_alloc_raw(bytes, 1, err);
        if (!out->texels[l]) {
            spl_pyramid_finish(out);
            return SPL_E_NOMEM;
        }
        memcpy(out->texels[l], from->texels[l], bytes);
        struct coding coding = {from->texels[l], out->texels[l], from->width[l], from->height[l], code};
        spl_parallel_for(threads, (from->height[l] + 3) / 4, 4, code_rows, &coding);
    }
    return 0;
}
