/* BC1 without its mode of three colours. Texels are coded by their place along the main axis; then in turns ends are
 * put on the steps of 5, 6 and 5 bits that are best for the codes, and texels choose the nearest of the four colours.
 * An even surface lies between the steps: one colour of two ends is nearer to it. */
#include "dataset/block.h"

#include <math.h>
#include <string.h>

enum { axis_rounds = 6, rounds = 4, around = 2 };
static const int steps[3] = {31, 63, 31};

/* Ends as steps of their channels. */
struct ends {
    int at[2][3];
};

/* The value of a channel's step, and the step nearest to a value. */
static float level(int channel, int step)
{
    return (float)(channel == 1 ? step << 2 | step >> 4 : step << 3 | step >> 2);
}

static int to_step(int channel, float value)
{
    return (int)(fminf(fmaxf(value, 0), 255) * (float)steps[channel] / 255 + 0.5f);
}

static void expand(const struct ends *ends, float colors[4][3])
{
    for (int e = 0; e < 2; e++)
        for (int c = 0; c < 3; c++)
            colors[e][c] = level(c, ends->at[e][c]);
    for (int c = 0; c < 3; c++) {
        colors[2][c] = colors[0][c] + (colors[1][c] - colors[0][c]) * (1.0f / 3.0f);
        colors[3][c] = colors[0][c] + (colors[1][c] - colors[0][c]) * (2.0f * (1.0f / 3.0f));
    }
}

static float choose(const float texels[16][3], const struct ends *ends, uint8_t codes[16])
{
    float colors[4][3], sum = 0;
    expand(ends, colors);
    for (int i = 0; i < 16; i++) {
        float best = INFINITY;
        for (int k = 0; k < 4; k++) {
            float r = texels[i][0] - colors[k][0], g = texels[i][1] - colors[k][1], b = texels[i][2] - colors[k][2];
            float error = r * r + g * g + b * b;
            if (error < best) {
                best = error;
                codes[i] = (uint8_t)k;
            }
        }
        sum += best;
    }
    return sum;
}

/* Codes by the place along the main axis. */
static void start(const float texels[16][3], uint8_t codes[16])
{
    static const uint8_t code_of[4] = {0, 2, 3, 1};
    float along[16];
    float mean[3] = {0}, axis[3] = {0.6f, 0.7f, 0.4f}, low = 0, high = 0;
    for (int i = 0; i < 16; i++)
        for (int c = 0; c < 3; c++)
            mean[c] += texels[i][c] / 16;
    for (int round = 0; round < axis_rounds; round++) {
        float next[3] = {0}, norm = 0;
        for (int i = 0; i < 16; i++) {
            float dot = 0;
            for (int c = 0; c < 3; c++)
                dot += (texels[i][c] - mean[c]) * axis[c];
            for (int c = 0; c < 3; c++)
                next[c] += dot * (texels[i][c] - mean[c]);
        }
        for (int c = 0; c < 3; c++)
            norm += next[c] * next[c];
        if (!(norm > 0))
            break;
        for (int c = 0; c < 3; c++)
            axis[c] = next[c] / sqrtf(norm);
    }
    for (int i = 0; i < 16; i++) {
        along[i] = 0;
        for (int c = 0; c < 3; c++)
            along[i] += (texels[i][c] - mean[c]) * axis[c];
        low = fminf(low, along[i]);
        high = fmaxf(high, along[i]);
    }
    for (int i = 0; i < 16; i++)
        codes[i] = code_of[high > low ? (int)(3 * (along[i] - low) / (high - low) + 0.5f) : 0];
}

/* The ends, of all steps, that are best for these codes: sums over the texels make each channel's error a quadratic of
 * its two ends, whose best steps lie near its least. */
static void fit(const float texels[16][3], const uint8_t codes[16], struct ends *out)
{
    static const float share[4] = {0, 1, 1.0f / 3, 2.0f / 3};
    float aa = 0, ab = 0, bb = 0, a[3] = {0}, b[3] = {0};
    for (int i = 0; i < 16; i++) {
        float w = share[codes[i]];
        aa += (1 - w) * (1 - w);
        ab += w * (1 - w);
        bb += w * w;
        for (int c = 0; c < 3; c++) {
            a[c] += (1 - w) * texels[i][c];
            b[c] += w * texels[i][c];
        }
    }
    float det = aa * bb - ab * ab;
    for (int c = 0; c < 3; c++) {
        float mean = (a[c] + b[c]) / 16, best = INFINITY; /* where one code is all there is, any pair around the mean */
        int first = to_step(c, det > 1e-3f ? (bb * a[c] - ab * b[c]) / det : mean);
        int second = to_step(c, det > 1e-3f ? (aa * b[c] - ab * a[c]) / det : mean);
        for (int i = first - around; i <= first + around; i++)
            for (int k = second - around; k <= second + around; k++) {
                if (i < 0 || k < 0 || i > steps[c] || k > steps[c])
                    continue;
                float x = level(c, i), y = level(c, k);
                float error = x * x * aa + 2 * x * y * ab + y * y * bb - 2 * (x * a[c] + y * b[c]);
                if (error < best) {
                    best = error;
                    out->at[0][c] = i;
                    out->at[1][c] = k;
                }
            }
    }
}

double spl_block_encode(const float texels[16][3], uint32_t words[2])
{
    struct ends best = {{{0}}}, tried;
    uint8_t codes[16] = {0}, tried_codes[16];
    float error = INFINITY;
    for (int way = 0; way < 2 && error > 0; way++) { /* along the main axis; as one colour between the ends */
        if (way == 0)
            start(texels, tried_codes);
        else
            memset(tried_codes, 2, sizeof tried_codes);
        for (int round = 0; round < (way ? 1 : rounds); round++) {
            fit(texels, tried_codes, &tried);
            float left = choose(texels, &tried, tried_codes);
            if (!(left < error))
                break;
            error = left;
            best = tried;
            memcpy(codes, tried_codes, sizeof codes);
        }
    }
    words[0] = words[1] = 0;
    for (int e = 0; e < 2; e++)
        words[0] |= (uint32_t)(best.at[e][0] << 11 | best.at[e][1] << 5 | best.at[e][2]) << 16 * e;
    for (int i = 0; i < 16; i++)
        words[1] |= (uint32_t)codes[i] << 2 * i;
    return (double)error;
}

static void expand_color(uint32_t color, float out[3])
{
    const int at[3] = {color >> 11 & 31, color >> 5 & 63, color & 31};
    for (int c = 0; c < 3; c++)
        out[c] = level(c, at[c]);
}

void spl_block_get_color(const uint32_t words[2], uint32_t texel, float color[3])
{
    uint32_t code = words[1] >> 2 * texel & 3;
    float share = code < 2 ? (float)code : (float)(code - 1) * (1.0f / 3.0f), a[3], b[3];
    expand_color(words[0] & 0xffff, a);
    expand_color(words[0] >> 16, b);
    for (int c = 0; c < 3; c++)
        color[c] = a[c] + (b[c] - a[c]) * share;
}
