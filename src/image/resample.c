/* Four pixels become one, by rows. Of an enlarged image, where the nearest pixel is empty, so is the result (but for
 * colour and coverage, whose alpha fades): a silhouette stays where the image has it. A square that several pixels lie
 * in holds what any of them does. */
#include "image/resample.h"

#include <math.h>
#include <string.h>

#include "base/parallel.h"
#include "image/rows.h"

enum { strip = 256 }; /* columns, whose places are those of all rows */

struct job {
    const struct spl_image *from;
    struct spl_image *to;
    double scale;
    uint32_t rim;
    uint32_t first; /* row */
};

/* The four neighbours of a pixel: [0] is the nearest. */
struct taps {
    size_t at[4];
    float weight[4];
};

struct axis {
    uint32_t near, far; /* the nearest pixel and the one on the other side */
    float share;        /* of the far one, at most 1/2 */
};

static struct axis place(double at, uint32_t size)
{
    double position = at - 0.5, nearest = floor(position + 0.5), off = position - nearest;
    double far = nearest + (off < 0 ? -1 : 1), last = size - 1.0;
    return (struct axis){.near = (uint32_t)fmin(fmax(nearest, 0), last),
                         .far = (uint32_t)fmin(fmax(far, 0), last),
                         .share = (float)fabs(off)};
}

/* Of [at, at + scale), 1 < scale <= 2, which ends in the pixel behind the one that it begins in. */
static struct axis cover(double at, double scale, uint32_t size)
{
    double first = floor(at), share = (first + 1 - at) / scale, last = size - 1.0;
    bool begins = share >= 0.5; /* in the pixel that it has more of */
    return (struct axis){.near = (uint32_t)fmin(begins ? first : first + 1, last),
                         .far = (uint32_t)fmin(begins ? first + 1 : first, last),
                         .share = (float)(begins ? 1 - share : share)};
}

/* Of pixel `at` of the wanted image. */
static struct axis find_axis(const struct job *job, double at, uint32_t size)
{
    const double scale = job->scale;
    return scale < 1 ? place((at + 0.5) * scale + job->rim, size) : cover(at * scale + job->rim, scale, size);
}

static struct taps place_taps(const struct axis *x, const struct axis *y, uint32_t width)
{
    size_t near_row = (size_t)y->near * width, far_row = (size_t)y->far * width;
    return (struct taps){
        .at = {near_row + x->near, near_row + x->far, far_row + x->near, far_row + x->far},
        .weight = {(1 - x->share) * (1 - y->share), x->share * (1 - y->share), (1 - x->share) * y->share,
                   x->share * y->share},
    };
}

typedef float four __attribute__((vector_size(16)));

static void color(const uint8_t *from, const struct taps *t, uint8_t *to)
{
    four sum = {0}; /* r g b alpha */
    for (int i = 0; i < 4; i++) {
        const uint8_t *p = from + 4 * t->at[i];
        sum += t->weight[i] * p[3] * (four){p[0], p[1], p[2], 1};
    }
    const four mean = sum / sum[3] + 0.5f;
    for (int c = 0; c < 3; c++)
        to[c] = sum[3] > 0 ? (uint8_t)mean[c] : 0;
    to[3] = (uint8_t)(sum[3] + 0.5f);
}

/* Over those as far as the nearest pixel, or of a square as the one that is nearest to the eye. */
static float distance(const float *from, const struct taps *t, bool square, float tolerance)
{
    float nearest = from[t->at[0]], sum = 0, total = 0;
    for (int i = 1; i < 4 && square; i++)
        nearest = fminf(nearest, from[t->at[i]]); /* which of a number and NAN is the number */
    for (int i = 0; i < 4; i++) {
        float value = from[t->at[i]];
        if (fabsf(value - nearest) <= tolerance * nearest) { /* false for NAN */
            sum += t->weight[i] * value;
            total += t->weight[i];
        }
    }
    return total > 0 ? sum / total : NAN;
}

static void normal(const float *from, const struct taps *t, bool square, float to[3])
{
    float sum[3] = {0}, length = 0;
    const float *nearest = from + 3 * t->at[0];
    bool empty = !square && nearest[0] == 0 && nearest[1] == 0 && nearest[2] == 0;
    for (int c = 0; c < 3; c++) {
        for (int i = 0; i < 4; i++)
            sum[c] += t->weight[i] * from[3 * t->at[i] + c];
        length += sum[c] * sum[c];
    }
    for (int c = 0; c < 3; c++)
        to[c] = empty ? 0 : length > 0 ? sum[c] / sqrtf(length) : nearest[c];
}

static float coverage(const float *from, const struct taps *t)
{
    float sum = 0;
    for (int i = 0; i < 4; i++)
        sum += t->weight[i] * from[t->at[i]];
    return sum;
}

/* The nearest pixel's, or of a square the one's that has most of it of those that hold something. */
static uint32_t number(const uint32_t *from, const struct taps *t, bool square, uint32_t empty)
{
    uint32_t found = from[t->at[0]];
    float most = 0;
    for (int i = 0; i < 4 && square; i++)
        if (from[t->at[i]] != empty && t->weight[i] > most) {
            most = t->weight[i];
            found = from[t->at[i]];
        }
    return found;
}

static void sample(const struct spl_image *small, const struct taps *t, bool square, float tolerance, void *to)
{
    const void *from = small->pixels;
    switch (small->layer) {
    case SPL_LAYER_COLOR:
        color(from, t, to);
        break;
    case SPL_LAYER_DEPTH:
    case SPL_LAYER_RANGE:
        *(float *)to = distance(from, t, square, tolerance);
        break;
    case SPL_LAYER_NORMAL:
        normal(from, t, square, to);
        break;
    case SPL_LAYER_COVERAGE:
        *(float *)to = coverage(from, t);
        break;
    default:
        *(uint32_t *)to = number(from, t, square, small->layer == SPL_LAYER_ID ? UINT32_MAX : 0);
    }
}

static void resample_rows(void *context, size_t begin, size_t end, unsigned worker)
{
    (void)worker;
    const struct job *j = context;
    const size_t pixel_bytes = spl_pixel_bytes(j->to->type);
    const float tolerance = 0.01f / (float)fmin(j->scale, 1);
    struct axis columns[strip];
    for (uint32_t first = 0; first < j->to->width; first += strip) {
        const uint32_t count = j->to->width - first < strip ? j->to->width - first : strip;
        for (uint32_t x = 0; x < count; x++)
            columns[x] = find_axis(j, first + x, j->from->width);
        for (size_t y = j->first + begin; y < j->first + end; y++) {
            struct axis row = find_axis(j, (double)y, j->from->height);
            char *to = (char *)spl_image_row(j->to, y) + first * pixel_bytes;
            for (uint32_t x = 0; x < count; x++, to += pixel_bytes) {
                struct taps t = place_taps(&columns[x], &row, j->from->width);
                sample(j->from, &t, j->scale > 1, tolerance, to);
            }
        }
    }
}

void spl_image_sample(const struct spl_image *small, double x, double y, float tolerance, void *to)
{
    struct axis column = place(x, small->width), row = place(y, small->height);
    struct taps t = place_taps(&column, &row, small->width);
    sample(small, &t, false, tolerance, to);
}

void spl_image_resample(const struct spl_image *from, double scale, uint32_t rim, struct spl_image *to, uint32_t begin,
                        uint32_t end)
{
    struct job job = {.from = from, .to = to, .scale = scale, .rim = rim, .first = begin};
    spl_parallel_for(0, end - begin, 32, resample_rows, &job);
}
