/* BC1 without its mode of three colours. Ends begin at the extremes along the main axis; then in turns texels choose
 * the nearest of the four colours and ends are put where least squares has them; at last each channel of each end goes
 * up or down by a step of its 5 or 6 bits as long as that helps, which is what even surfaces need: their colour lies
 * between the steps. */
#include "pack/maps/blocks.h"

#include <math.h>
#include <string.h>

enum { axis_rounds = 6, fit_rounds = 3, step_rounds = 4 };
static const int steps[3] = {31, 63, 31};

/* Ends as steps of their channels. */
struct ends {
    int at[2][3];
};

static void expand(const struct ends *ends, float colors[4][3])
{
    for (int e = 0; e < 2; e++) {
        colors[e][0] = (float)(ends->at[e][0] << 3 | ends->at[e][0] >> 2);
        colors[e][1] = (float)(ends->at[e][1] << 2 | ends->at[e][1] >> 4);
        colors[e][2] = (float)(ends->at[e][2] << 3 | ends->at[e][2] >> 2);
    }
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

static void round_ends(float ends[2][3], struct ends *out)
{
    for (int e = 0; e < 2; e++)
        for (int c = 0; c < 3; c++) {
            int step = (int)lrintf(ends[e][c] * (float)steps[c] / 255);
            out->at[e][c] = step < 0 ? 0 : step > steps[c] ? steps[c] : step;
        }
}

static void start(const float texels[16][3], float ends[2][3])
{
    float mean[3] = {0}, axis[3] = {0.6f, 0.7f, 0.4f}, low = 0, high = 0;
    for (int i = 0; i < 16; i++)
        for (int c = 0; c < 3; c++)
            mean[c] += texels[i][c] / 16;
    for (int round = 0; round < axis_rounds; round++) {
        float next[3] = {0}, norm = 0;
        for (int i = 0; i < 16; i++) {
            float along = 0;
            for (int c = 0; c < 3; c++)
                along += (texels[i][c] - mean[c]) * axis[c];
            for (int c = 0; c < 3; c++)
                next[c] += along * (texels[i][c] - mean[c]);
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
            along += (texels[i][c] - mean[c]) * axis[c];
        low = fminf(low, along);
        high = fmaxf(high, along);
    }
    for (int c = 0; c < 3; c++) {
        ends[0][c] = mean[c] + low * axis[c];
        ends[1][c] = mean[c] + high * axis[c];
    }
}

/* The ends that are best for these codes; false where any would do. */
static int refine(const float texels[16][3], const uint8_t codes[16], float ends[2][3])
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
    if (!(det > 1e-3f))
        return 0;
    for (int c = 0; c < 3; c++) {
        ends[0][c] = (bb * a[c] - ab * b[c]) / det;
        ends[1][c] = (aa * b[c] - ab * a[c]) / det;
    }
    return 1;
}

double spl_map_block_encode(const float texels[16][3], uint32_t words[2])
{
    struct ends best, tried;
    uint8_t codes[16], tried_codes[16];
    float ends[2][3];
    start(texels, ends);
    round_ends(ends, &best);
    float error = choose(texels, &best, codes);
    memcpy(tried_codes, codes, sizeof codes);
    for (int round = 0; round < fit_rounds && refine(texels, tried_codes, ends); round++) {
        round_ends(ends, &tried);
        float left = choose(texels, &tried, tried_codes);
        if (!(left < error))
            break;
        error = left;
        best = tried;
        memcpy(codes, tried_codes, sizeof codes);
    }
    for (int round = 0, better = 1; round < step_rounds && better && error > 0; round++) {
        better = 0;
        for (int k = 0; k < 12; k++) {
            tried = best;
            int *at = &tried.at[k / 6][k / 2 % 3];
            *at += k % 2 ? 1 : -1;
            if (*at < 0 || *at > steps[k / 2 % 3])
                continue;
            float left = choose(texels, &tried, tried_codes);
            if (!(left < error))
                continue;
            error = left;
            best = tried;
            memcpy(codes, tried_codes, sizeof codes);
            better = 1;
        }
    }
    words[0] = words[1] = 0;
    for (int e = 0; e < 2; e++)
        words[0] |= (uint32_t)(best.at[e][0] << 11 | best.at[e][1] << 5 | best.at[e][2]) << 16 * e;
    for (int i = 0; i < 16; i++)
        words[1] |= (uint32_t)codes[i] << 2 * i;
    return (double)error;
}
