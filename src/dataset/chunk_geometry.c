/* Quantisation of positions, normals and radii: as few bits as the chunk's own spread needs under the stated errors,
 * chosen by calculation, measured on the codes as they will decode, and refined where the measurement misses the bound.
 *
 * A range of extent E gets b bits so that 2^b cells of the wanted step cover it, centred: every value then lies within
 * half a step of its code. The step common to several axes is shrunk afterwards as far as the chosen bits allow, which
 * is accuracy at no cost. Pure functions; any thread. */
#include "dataset/chunk_geometry.h"

#include <float.h>
#include <math.h>

#include "geom/octahedral.h"

/* Mean distance to the centre of a unit cube, and of a unit square: what a step costs where codes fall uniformly. */
#define CUBE_MEAN 0.480296
#define SQUARE_MEAN 0.382598

enum { position_bits_max = 24, normal_bits_max = 12, radius_bits_max = 12, attempts = 3 };

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
                               double bound, struct spl_chunk *chunk, struct spl_geometry_codes *codes)
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
                         struct spl_geometry_codes *codes)
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
                             struct spl_geometry_codes *codes)
{
    unsigned turn = mean_axis(splats, count);
    float local[3][SPL_CHUNK_SPLATS];
    double u[SPL_CHUNK_SPLATS] = {0}, v[SPL_CHUNK_SPLATS] = {0}, stretch = 0;
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
void spl_geometry_quantise(const struct spl_splat *splats, const double (*position)[3], uint32_t count,
                           const struct spl_chunk_options *options, struct spl_chunk *chunk,
                           struct spl_geometry_codes *codes, struct spl_chunk_error *error)
{
    double value[3][SPL_CHUNK_SPLATS], radius[SPL_CHUNK_SPLATS], inverse_radius[SPL_CHUNK_SPLATS];
    for (uint32_t i = 0; i < count; i++) {
        for (int a = 0; a < 3; a++)
            value[a][i] = position[i][a];
        radius[i] = splats[i].radius;
        inverse_radius[i] = 1.0 / radius[i];
    }
    error->position_over_radius = encode_positions(value, inverse_radius, count, options->position_error, chunk, codes);
    encode_radii(radius, count, options->radius_error, chunk, codes);
    error->normal_radians = encode_normals(splats, count, options->normal_error, chunk, codes);
}
