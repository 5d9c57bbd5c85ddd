/* BC1 without its mode of three colours. Texels are coded by their place along the main axis; then in turns ends are
 * put on the steps of 5, 6 and 5 bits that are best for the codes, and texels choose the nearest of the four colours.
 * An even surface lies between the steps: one colour of two ends is nearer to it. */
#include "dataset/block.h"

#include <math.h>
#include <string.h>

enum { axis_rounds = 6, rounds = 4, around = 2, tried = 2 * around + 1 };
static const int steps[3] = {31, 63, 31};

/* Four numbers that are worked out at once: the channels of a texel, the last one 0, or one channel of four texels. */
typedef float four __attribute__((vector_size(16)));
typedef int32_t four_ints __attribute__((vector_size(16)));

struct texels {
    four at[16];        /* by texel */
    four channel[3][4]; /* the same by channel */
};

/* Ends as steps of their channels. */
struct ends {
    int at[2][3];
};

static four all(float value)
{
    return (four){value, value, value, value};
}

static four_ints choose_ints(four_ints where, four_ints a, four_ints b)
{
    return (where & a) | (~where & b);
}

static four choose_floats(four_ints where, four a, four b)
{
    return (four)choose_ints(where, (four_ints)a, (four_ints)b);
}

static void load(const float texels[16][3], struct texels *t)
{
    for (int i = 0; i < 16; i++) {
        t->at[i] = (four){texels[i][0], texels[i][1], texels[i][2], 0};
        for (int c = 0; c < 3; c++)
            t->channel[c][i / 4][i % 4] = texels[i][c];
    }
}

/* The value of a channel's step, and the step nearest to a value. */
static float level(int channel, int step)
{
    return (float)(channel == 1 ? step << 2 | step >> 4 : step << 3 | step >> 2);
}

static int to_step(int channel, float value)
{
    float within = value > 0 ? value : 0;
    return (int)((within < 255 ? within : 255) * (float)steps[channel] / 255 + 0.5f);
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

static float choose(const struct texels *t, const struct ends *ends, uint8_t codes[16])
{
    float colors[4][3], sum = 0;
    expand(ends, colors);
    for (int g = 0; g < 4; g++) {
        four best = all(INFINITY);
        four_ints code = {0};
        for (int k = 0; k < 4; k++) {
            four r = t->channel[0][g] - colors[k][0], green = t->channel[1][g] - colors[k][1];
            four b = t->channel[2][g] - colors[k][2];
            four error = r * r + green * green + b * b;
            four_ints less = error < best;
            best = choose_floats(less, error, best);
            code = choose_ints(less, (four_ints){k, k, k, k}, code);
        }
        for (int i = 0; i < 4; i++) {
            codes[4 * g + i] = (uint8_t)code[i];
            sum += best[i];
        }
    }
    return sum;
}

/* Codes by the place along the main axis. */
static void start(const struct texels *t, uint8_t codes[16])
{
    static const uint8_t code_of[4] = {0, 2, 3, 1};
    struct texels off;
    four mean = {0}, along[4];
    float axis[3] = {0.6f, 0.7f, 0.4f}, low = 0, high = 0;
    for (int i = 0; i < 16; i++)
        mean += t->at[i] / 16;
    for (int i = 0; i < 16; i++)
        off.at[i] = t->at[i] - mean;
    for (int c = 0; c < 3; c++)
        for (int g = 0; g < 4; g++)
            off.channel[c][g] = t->channel[c][g] - mean[c];
    for (int round = 0; round <= axis_rounds; round++) {
        four next = {0};
        float norm = 0;
        for (int g = 0; g < 4; g++)
            along[g] = off.channel[0][g] * axis[0] + off.channel[1][g] * axis[1] + off.channel[2][g] * axis[2];
        if (round == axis_rounds)
            break;
        for (int i = 0; i < 16; i++)
            next += along[i / 4][i % 4] * off.at[i];
        for (int c = 0; c < 3; c++)
            norm += next[c] * next[c];
        if (!(norm > 0))
            break;
        for (int c = 0; c < 3; c++)
            axis[c] = next[c] / sqrtf(norm);
    }
    for (int i = 0; i < 16; i++) {
        float at = along[i / 4][i % 4];
        low = at < low ? at : low;
        high = at > high ? at : high;
    }
    for (int i = 0; i < 16; i++)
        codes[i] = code_of[high > low ? (int)(3 * (along[i / 4][i % 4] - low) / (high - low) + 0.5f) : 0];
}

/* The ends, of all steps, that are best for these codes: sums over the texels make each channel's error a quadratic of
 * its two ends, whose best steps lie near its least. */
static void fit(const struct texels *t, const uint8_t codes[16], struct ends *out)
{
    static const float share[4] = {0, 1, 1.0f / 3, 2.0f / 3};
    float aa = 0, ab = 0, bb = 0;
    four a = {0}, b = {0}, x[tried] = {{0}}, y[tried] = {{0}}, of_x[tried], of_y[tried], best = all(INFINITY);
    four_ints at_x = {0}, at_y = {0};
    int begin[2][3];
    for (int i = 0; i < 16; i++) {
        float w = share[codes[i]];
        aa += (1 - w) * (1 - w);
        ab += w * (1 - w);
        bb += w * w;
        a += (1 - w) * t->at[i];
        b += w * t->at[i];
    }
    float det = aa * bb - ab * ab;
    for (int c = 0; c < 3; c++) {
        float mean = (a[c] + b[c]) / 16; /* where one code is all there is, any pair around the mean */
        begin[0][c] = to_step(c, det > 1e-3f ? (bb * a[c] - ab * b[c]) / det : mean) - around;
        begin[1][c] = to_step(c, det > 1e-3f ? (aa * b[c] - ab * a[c]) / det : mean) - around;
    }
    for (int i = 0; i < tried; i++) {
        for (int c = 0; c < 3; c++) {
            x[i][c] = begin[0][c] + i < 0 ? 0 : level(c, begin[0][c] + i);
            y[i][c] = begin[1][c] + i < 0 ? 0 : level(c, begin[1][c] + i);
        }
        of_x[i] = x[i] * x[i] * aa;
        of_y[i] = y[i] * y[i] * bb;
        for (int c = 0; c < 3; c++) { /* what is no step is never best */
            of_x[i][c] = begin[0][c] + i < 0 || begin[0][c] + i > steps[c] ? INFINITY : of_x[i][c];
            of_y[i][c] = begin[1][c] + i < 0 || begin[1][c] + i > steps[c] ? INFINITY : of_y[i][c];
        }
    }
    for (int i = 0; i < tried; i++)
        for (int k = 0; k < tried; k++) {
            four error = of_x[i] + 2 * x[i] * y[k] * ab + of_y[k] - 2 * (x[i] * a + y[k] * b);
            four_ints less = error < best;
            best = choose_floats(less, error, best);
            at_x = choose_ints(less, (four_ints){i, i, i, i}, at_x);
            at_y = choose_ints(less, (four_ints){k, k, k, k}, at_y);
        }
    for (int c = 0; c < 3; c++) {
        out->at[0][c] = begin[0][c] + at_x[c];
        out->at[1][c] = begin[1][c] + at_y[c];
    }
}

double spl_block_encode(const float texels[16][3], uint32_t words[2])
{
    struct texels t;
    struct ends best = {{{0}}}, next;
    uint8_t codes[16] = {0}, next_codes[16];
    float error = INFINITY;
    load(texels, &t);
    for (int way = 0; way < 2 && error > 0; way++) { /* along the main axis; as one colour between the ends */
        if (way == 0)
            start(&t, next_codes);
        else
            memset(next_codes, 2, sizeof next_codes);
        for (int round = 0; round < (way ? 1 : rounds); round++) {
            fit(&t, next_codes, &next);
            float left = choose(&t, &next, next_codes);
            if (!(left < error))
                break;
            error = left;
            best = next;
            memcpy(codes, next_codes, sizeof codes);
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
