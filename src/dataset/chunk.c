/* Quantisation: as few bits as the chunk's own spread needs under the stated errors, chosen by calculation, measured on
 * the codes as they will decode, and refined where the measurement misses the bound.
 *
 * A range of extent E gets b bits so that 2^b cells of the wanted step cover it, centred: every value then lies within
 * half a step of its code. The step common to several axes is shrunk afterwards as far as the chosen bits allow, which
 * is accuracy at no cost. Pure functions; any thread. */
#include "dataset/chunk_clip.h"

#include <float.h>
#include <math.h>
#include <string.h>

#include "base/error.h"
#include "geom/octahedral.h"

/* Mean distance to the centre of a unit cube, and of a unit square: what a step costs where codes fall uniformly. */
#define CUBE_MEAN 0.480296
#define SQUARE_MEAN 0.382598

enum { position_bits_max = 24, normal_bits_max = 12, radius_bits_max = 12, attempts = 3 };

/* The codes of one chunk; each axis on its own so that the loops below vectorise. */
struct codes {
    int32_t position[3][SPL_CHUNK_SPLATS];
    int32_t u[SPL_CHUNK_SPLATS], v[SPL_CHUNK_SPLATS], radius[SPL_CHUNK_SPLATS];
    int32_t cy[SPL_CHUNK_SPLATS], cu[SPL_CHUNK_SPLATS], cv[SPL_CHUNK_SPLATS];
    int32_t classification[SPL_CHUNK_SPLATS], uncertainty[SPL_CHUNK_SPLATS];
};

/* Smallest b <= limit with 2^b * step >= extent. */
static unsigned bits_for(double extent, double step, unsigned limit)
{
    if (extent <= step)
        return 0;
    int exponent;
    double mantissa = frexp(extent / step, &exponent);
    int bits = mantissa == 0.5 ? exponent - 1 : exponent;
    return bits > (int)limit ? limit : (unsigned)(bits > 0 ? bits : 0);
}

static unsigned bits_for_count(uint32_t largest)
{
    return largest ? 32 - (unsigned)__builtin_clz(largest) : 0;
}

/* The smallest step with which `bits` still cover every extent, rounded up to a float; `wanted` where none has bits. */
static float fit_step(const double *extent, const unsigned *bits, int axes, double wanted)
{
    double fitted = 0;
    for (int a = 0; a < axes; a++)
        if (bits[a])
            fitted = fmax(fitted, ldexp(extent[a], -(int)bits[a]));
    if (fitted == 0)
        fitted = wanted;
    float step = (float)fmin(fitted, FLT_MAX);
    if (step < fitted && step < FLT_MAX)
        step = nextafterf(step, FLT_MAX);
    return fmaxf(step, FLT_MIN);
}

/* Code 0 of a range around `middle`. */
static float centred_origin(double middle, float step, unsigned bits)
{
    return (float)(middle - 0.5 * step * (double)((1u << bits) - 1));
}

static void quantise(const double *value, uint32_t count, float origin, float step, unsigned bits, int32_t *code)
{
    double inverse = 1.0 / step, largest = (double)((1u << bits) - 1);
    for (uint32_t i = 0; i < count; i++) {
        double c = (value[i] - origin) * inverse;
        c = c > 0 ? c : 0;
        c = c < largest ? c : largest;
        code[i] = (int32_t)(c + 0.5);
    }
}

static void find_range(const double *value, uint32_t count, double *low, double *high)
{
    double l = value[0], h = value[0];
    for (uint32_t i = 1; i < count; i++) {
        l = value[i] < l ? value[i] : l;
        h = value[i] > h ? value[i] : h;
    }
    *low = l;
    *high = h;
}

/* Returns the sum of error over radius. */
static double encode_positions(double value[3][SPL_CHUNK_SPLATS], const double *inverse_radius, uint32_t count,
                               double bound, struct spl_chunk *chunk, struct codes *codes)
{
    double inverse_sum = 0, middle[3], extent[3], largest = 0, widest = 0;
    for (uint32_t i = 0; i < count; i++)
        inverse_sum += inverse_radius[i];
    for (int a = 0; a < 3; a++) {
        double low, high;
        find_range(value[a], count, &low, &high);
        middle[a] = 0.5 * (low + high);
        extent[a] = high - low;
        widest = fmax(widest, extent[a]);
        largest = fmax(largest, fmax(fabs(low), fabs(high)));
    }
    double mean_bound = bound * count / inverse_sum; /* of the error itself, with the harmonic mean of the radii */
    /* Neither more bits than there are, nor finer than the floats that decoding adds up. */
    double floor_step = fmax(fmax(ldexp(widest, -position_bits_max), largest * 0x1p-25), FLT_MIN);
    double wanted = fmax(mean_bound / CUBE_MEAN, floor_step), sum = 0;
    for (int attempt = 0; attempt < attempts; attempt++) {
        unsigned bits[3];
        for (int a = 0; a < 3; a++)
            bits[a] = bits_for(extent[a], wanted, position_bits_max);
        float step = fit_step(extent, bits, 3, wanted);
        double square[SPL_CHUNK_SPLATS] = {0};
        chunk->step = step;
        for (int a = 0; a < 3; a++) {
            float origin = chunk->origin[a] = centred_origin(middle[a], step, bits[a]);
            quantise(value[a], count, origin, step, bits[a], codes->position[a]);
            for (uint32_t i = 0; i < count; i++) {
                double d = (double)(origin + step * (float)codes->position[a][i]) - value[a][i];
                square[i] += d * d;
            }
        }
        chunk->geometry_bits = bits[0] << SPL_GEOMETRY_X | bits[1] << SPL_GEOMETRY_Y | bits[2] << SPL_GEOMETRY_Z;
        sum = 0;
        for (uint32_t i = 0; i < count; i++)
            sum += sqrt(square[i]) * inverse_radius[i];
        if (sum <= bound * count || wanted <= floor_step)
            break;
        /* First in proportion, then so that the farthest corner of a cell keeps the bound. */
        wanted = fmax(attempt ? mean_bound * 1.1547 * 0.999 : wanted * bound * count / sum * 0.97, floor_step);
    }
    return sum;
}

static void encode_radii(const double *radius, uint32_t count, double bound, struct spl_chunk *chunk,
                         struct codes *codes)
{
    double low, high, sum = 0;
    find_range(radius, count, &low, &high);
    double extent = high - low, wanted = 2 * bound * low;
    unsigned bits = bits_for(extent, wanted, radius_bits_max);
    chunk->radius_step = fit_step(&extent, &bits, 1, wanted);
    chunk->radius_min = centred_origin(0.5 * (low + high), chunk->radius_step, bits);
    chunk->geometry_bits |= bits << SPL_GEOMETRY_RADIUS;
    quantise(radius, count, chunk->radius_min, chunk->radius_step, bits, codes->radius);
    for (uint32_t i = 0; i < count; i++)
        sum += radius[i];
    chunk->radius_mean = (float)(sum / count);
}

/* The world axis nearest the mean normal, as SPL_GEOMETRY_AXIS holds it. */
static unsigned mean_axis(const struct spl_splat *splats, uint32_t count)
{
    float sum[3] = {0};
    for (uint32_t i = 0; i < count; i++)
        for (int a = 0; a < 3; a++)
            sum[a] += splats[i].normal[a];
    unsigned axis = fabsf(sum[0]) > fabsf(sum[1]) ? 0 : 1;
    axis = fabsf(sum[2]) >= fabsf(sum[axis]) ? 2 : axis;
    return axis | (sum[axis] < 0 ? 4u : 0u);
}

/* Returns the sum of angles. */
static double encode_normals(const struct spl_splat *splats, uint32_t count, double bound, struct spl_chunk *chunk,
                             struct codes *codes)
{
    unsigned turn = mean_axis(splats, count);
    float local[3][SPL_CHUNK_SPLATS];
    double u[SPL_CHUNK_SPLATS], v[SPL_CHUNK_SPLATS], stretch = 0;
    for (uint32_t i = 0; i < count; i++) {
        float n[3], eu, ev;
        spl_octahedral_turn(splats[i].normal, turn & 3, turn >> 2, n);
        spl_octahedral_encode(n, &eu, &ev);
        u[i] = eu;
        v[i] = ev;
        for (int a = 0; a < 3; a++)
            local[a][i] = n[a];
    }
    /* How far a step moves the direction, in root mean square over a cell: 1 at the pole, sqrt(6) amid a face. */
    for (uint32_t i = 0; i < count; i++) {
        float x = fabsf(local[0][i]), y = fabsf(local[1][i]), z = fabsf(local[2][i]), l1 = x + y + z;
        stretch += l1 * sqrtf(fmaxf(4.0f - (x - z) * (x - z) - (y - z) * (y - z), 0.0f));
    }
    double low[2], high[2], extent[2];
    find_range(u, count, &low[0], &high[0]);
    find_range(v, count, &low[1], &high[1]);
    extent[0] = high[0] - low[0];
    extent[1] = high[1] - low[1];
    double floor_step = fmax(ldexp(fmax(extent[0], extent[1]), -normal_bits_max), 0x1p-24);
    double wanted = bound * M_SQRT2 / (SQUARE_MEAN * fmax(stretch / count, 1e-6));
    wanted = fmin(fmax(wanted, floor_step), 2.0);
    uint32_t widths = chunk->geometry_bits | turn << SPL_GEOMETRY_AXIS;
    double sum = 0;
    for (int attempt = 0; attempt < attempts; attempt++) {
        unsigned bits[2] = {bits_for(extent[0], wanted, normal_bits_max), bits_for(extent[1], wanted, normal_bits_max)};
        float step = chunk->normal_step = fit_step(extent, bits, 2, wanted);
        chunk->normal_u = centred_origin(0.5 * (low[0] + high[0]), step, bits[0]);
        chunk->normal_v = centred_origin(0.5 * (low[1] + high[1]), step, bits[1]);
        chunk->geometry_bits = widths | bits[0] << SPL_GEOMETRY_U | bits[1] << SPL_GEOMETRY_V;
        quantise(u, count, chunk->normal_u, step, bits[0], codes->u);
        quantise(v, count, chunk->normal_v, step, bits[1], codes->v);
        float chord[SPL_CHUNK_SPLATS];
        for (uint32_t i = 0; i < count; i++) {
            float n[3];
            spl_octahedral_decode(chunk->normal_u + step * (float)codes->u[i],
                                  chunk->normal_v + step * (float)codes->v[i], n);
            float x = n[0] - local[0][i], y = n[1] - local[1][i], z = n[2] - local[2][i];
            chord[i] = sqrtf(x * x + y * y + z * z);
        }
        sum = 0;
        for (uint32_t i = 0; i < count; i++)
            sum += chord[i] < 0.1f ? chord[i] : 2.0f * asinf(fminf(0.5f * chord[i], 1.0f));
        if (sum <= bound * count || wanted <= floor_step)
            break;
        wanted = fmax(attempt ? bound / 2.2 : wanted * bound * count / sum * 0.97, floor_step);
    }
    return sum;
}

/* Subtracts the least code from all; returns the width and sets *base. */
static unsigned rebase(int32_t *code, uint32_t count, int32_t *base)
{
    int32_t low = code[0], high = code[0];
    for (uint32_t i = 1; i < count; i++) {
        low = code[i] < low ? code[i] : low;
        high = code[i] > high ? code[i] : high;
    }
    for (uint32_t i = 0; i < count; i++)
        code[i] -= low;
    *base = low;
    return bits_for_count((uint32_t)(high - low));
}

static void encode_colors(const uint8_t (*color)[3], uint32_t count, struct spl_chunk *chunk, struct codes *codes)
{
    for (uint32_t i = 0; i < count; i++) {
        int32_t r = color[i][0], g = color[i][1], b = color[i][2];
        codes->cu[i] = b - g;
        codes->cv[i] = r - g;
        codes->cy[i] = g + ((b - g + r - g) >> 2);
    }
    int32_t y, u, v;
    chunk->color_bits = rebase(codes->cy, count, &y) << SPL_COLOR_Y;
    chunk->color_bits |= rebase(codes->cu, count, &u) << SPL_COLOR_U;
    chunk->color_bits |= rebase(codes->cv, count, &v) << SPL_COLOR_V;
    chunk->color_bits |= (uint32_t)y << SPL_COLOR_BASE_Y;
    chunk->color_base = (uint32_t)(uint16_t)u | (uint32_t)(uint16_t)v << 16;
}

static void encode_classes(const struct spl_splat *splats, uint32_t count, struct spl_chunk *chunk, struct codes *codes)
{
    int32_t base;
    for (uint32_t i = 0; i < count; i++)
        codes->classification[i] = splats[i].classification;
    unsigned bits = rebase(codes->classification, count, &base);
    chunk->extra_bits |= bits << SPL_EXTRA_CLASS | (uint32_t)base << SPL_EXTRA_CLASS_BASE;
}

/* Half octaves below the largest; what lies below the last of them becomes zero. */
static void encode_uncertainties(const struct spl_splat *splats, uint32_t count, struct spl_chunk *chunk,
                                 struct codes *codes)
{
    float largest = 0;
    for (uint32_t i = 0; i < count; i++)
        largest = fmaxf(largest, splats[i].uncertainty);
    chunk->uncertainty_max = largest;
    const int32_t last = (1 << SPL_UNCERTAINTY_BITS_MAX) - 2;
    int32_t highest = 0;
    bool zeros = false;
    for (uint32_t i = 0; i < count; i++) {
        float ratio = largest > 0 ? splats[i].uncertainty / largest : 1.0f;
        int32_t code = ratio > 0 ? (int32_t)(0.5f - 2.0f * log2f(ratio)) : last + 1;
        codes->uncertainty[i] = code > last ? -1 : code;
        zeros |= code > last;
        if (code <= last && code > highest)
            highest = code;
    }
    if (highest == 0 && !zeros)
        return;
    unsigned bits = bits_for_count((uint32_t)highest + 1); /* the last code is taken by zero */
    for (uint32_t i = 0; i < count; i++)
        if (codes->uncertainty[i] < 0)
            codes->uncertainty[i] = (1 << bits) - 1;
    chunk->extra_bits |= bits << SPL_EXTRA_UNCERTAINTY;
}

struct bit_writer {
    uint32_t *words;
    uint32_t used;
    uint64_t pending;
    unsigned pending_bits;
};

static inline void put(struct bit_writer *w, int32_t code, unsigned bits)
{
    w->pending |= (uint64_t)(uint32_t)code << w->pending_bits;
    w->pending_bits += bits;
    if (w->pending_bits >= 32) {
        w->words[w->used++] = (uint32_t)w->pending;
        w->pending >>= 32;
        w->pending_bits -= 32;
    }
}

/* Writes one stream: `fields` codes a splat, one after the other, then the rest of the last word. A stream without width
 * has no codes: nobody set them where the attribute is absent. */
static void put_stream(struct bit_writer *w, int32_t *const *code, const unsigned *bits, int fields, uint32_t count)
{
    unsigned width = 0;
    for (int f = 0; f < fields; f++)
        width += bits[f];
    if (!width)
        return;
    for (uint32_t i = 0; i < count; i++)
        for (int f = 0; f < fields; f++)
            put(w, code[f][i], bits[f]);
    if (w->pending_bits)
        put(w, 0, 32 - w->pending_bits);
}

static void put_colors(struct bit_writer *w, const struct spl_chunk *chunk, struct codes *codes)
{
    uint32_t c = chunk->color_bits;
    put_stream(w, (int32_t *[]){codes->cy, codes->cu, codes->cv},
               (unsigned[]){c >> SPL_COLOR_Y & 15, c >> SPL_COLOR_U & 15, c >> SPL_COLOR_V & 15}, 3, chunk->count);
}

/* None and all cost nothing, one bit a splat otherwise. */
static void encode_linear(const struct spl_splat *splats, uint32_t count, struct spl_chunk *chunk,
                          uint32_t mask[SPL_LINEAR_WORDS])
{
    uint32_t linear = 0;
    for (uint32_t i = 0; i < count; i++) {
        mask[i / 32] |= (uint32_t)splats[i].linear << i % 32;
        linear += splats[i].linear;
    }
    uint32_t mode = linear == 0 ? 0 : linear == count ? SPL_LINEAR_ALL : SPL_LINEAR_SOME;
    chunk->geometry_bits |= mode << SPL_GEOMETRY_LINEAR;
}

static uint32_t write_streams(const struct spl_chunk *chunk, struct codes *codes, const uint32_t mask[SPL_LINEAR_WORDS],
                              uint32_t *words)
{
    uint32_t g = chunk->geometry_bits, e = chunk->extra_bits;
    struct bit_writer writer = {.words = words};
    put_stream(
        &writer,
        (int32_t *[]){codes->position[0], codes->position[1], codes->position[2], codes->u, codes->v, codes->radius},
        (unsigned[]){g >> SPL_GEOMETRY_X & 31, g >> SPL_GEOMETRY_Y & 31, g >> SPL_GEOMETRY_Z & 31,
                     g >> SPL_GEOMETRY_U & 15, g >> SPL_GEOMETRY_V & 15, g >> SPL_GEOMETRY_RADIUS & 15},
        6, chunk->count);
    for (int i = 0; g >> SPL_GEOMETRY_LINEAR == SPL_LINEAR_SOME && i < SPL_LINEAR_WORDS; i++)
        words[writer.used++] = mask[i];
    put_colors(&writer, chunk, codes);
    put_stream(&writer, (int32_t *[]){codes->classification}, (unsigned[]){e >> SPL_EXTRA_CLASS & 15}, 1, chunk->count);
    put_stream(&writer, (int32_t *[]){codes->uncertainty}, (unsigned[]){e >> SPL_EXTRA_UNCERTAINTY & 15}, 1,
               chunk->count);
    return writer.used;
}

/* Appends the clip lines to the `used` words of the other streams. */
static uint32_t write_clips(const struct spl_splat *splats, struct spl_chunk *chunk, uint32_t *words, uint32_t used)
{
    struct spl_clip clips[SPL_CHUNK_SPLATS];
    float normals[SPL_CHUNK_SPLATS][3];
    for (uint32_t i = 0; i < chunk->count; i++) {
        struct spl_splat decoded = {0};
        clips[i] = splats[i].clip;
        if (clips[i].direction[0] != 0 || clips[i].direction[1] != 0 || clips[i].direction[2] != 0)
            spl_chunk_decode(chunk, words, i, &decoded);
        memcpy(normals[i], decoded.normal, sizeof normals[i]);
    }
    return spl_clip_encode(clips, (const float(*)[3])normals, chunk, words + used);
}

uint32_t spl_chunk_encode(const struct spl_splat *splats, const double (*position)[3], uint32_t count,
                          const struct spl_chunk_options *options, struct spl_chunk *chunk, uint32_t *words,
                          struct spl_chunk_error *error)
{
    spl_assert(count >= 1 && count <= SPL_CHUNK_SPLATS);
    double value[3][SPL_CHUNK_SPLATS], radius[SPL_CHUNK_SPLATS], inverse_radius[SPL_CHUNK_SPLATS];
    uint8_t color[SPL_CHUNK_SPLATS][3];
    for (uint32_t i = 0; i < count; i++) {
        const float *n = splats[i].normal;
        spl_assert(splats[i].radius > 0 && isfinite(splats[i].radius + n[0] + n[1] + n[2] + splats[i].uncertainty) &&
                   isfinite(position[i][0] + position[i][1] + position[i][2]));
        for (int a = 0; a < 3; a++)
            value[a][i] = position[i][a];
        radius[i] = splats[i].radius;
        inverse_radius[i] = 1.0 / radius[i];
        memcpy(color[i], splats[i].color, sizeof color[i]);
    }
    struct codes codes;
    *chunk = (struct spl_chunk){.count = count};
    double position_sum = encode_positions(value, inverse_radius, count, options->position_error, chunk, &codes);
    encode_radii(radius, count, options->radius_error, chunk, &codes);
    double normal_sum = encode_normals(splats, count, options->normal_error, chunk, &codes);
    uint32_t mask[SPL_LINEAR_WORDS] = {0};
    encode_linear(splats, count, chunk, mask);
    encode_colors((const uint8_t(*)[3])color, count, chunk, &codes);
    if (options->has_class)
        encode_classes(splats, count, chunk, &codes);
    if (options->has_uncertainty)
        encode_uncertainties(splats, count, chunk, &codes);
    if (error)
        *error = (struct spl_chunk_error){.position_over_radius = position_sum, .normal_radians = normal_sum};
    uint32_t used = write_streams(chunk, &codes, mask, words);
    return used + write_clips(splats, chunk, words, used);
}

uint32_t spl_chunk_recolor(const struct spl_chunk *chunk, const uint32_t *page, const uint8_t (*color)[3],
                           struct spl_chunk *out, uint32_t *words)
{
    struct codes codes;
    *out = *chunk;
    out->geometry_word = 0;
    encode_colors(color, chunk->count, out, &codes);
    uint32_t geometry = spl_chunk_color_word(out), begin = spl_chunk_class_word(chunk);
    uint32_t rest = chunk->geometry_word + spl_chunk_words(chunk) - begin;
    memcpy(words, page + chunk->geometry_word, geometry * sizeof *words);
    struct bit_writer writer = {.words = words, .used = geometry};
    put_colors(&writer, out, &codes);
    memcpy(words + writer.used, page + begin, rest * sizeof *words);
    return writer.used + rest;
}
