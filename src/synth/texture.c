/* Colours are computed in doubles on the sRGB scale and rounded once, so they are exact functions of the position.
 * Edges are ramps of `ramp` metres and noise stops at waves of 16 mm: what a dense scan can carry. */
#include "synth/texture.h"

#include <math.h>
#include <string.h>

#include "synth/random.h"
#include "geom/vector.h"

static const double ramp = 0.005;
static const double finest_wave = 0.016;

static double smooth(double low, double high, double x)
{
    double t = (x - low) / (high - low);
    t = t < 0 ? 0 : t > 1 ? 1 : t;
    return t * t * (3 - 2 * t);
}

static uint32_t cell_hash(int32_t x, int32_t y, int32_t z, uint32_t seed)
{
    uint32_t h = seed ^ (uint32_t)x * 0x8da6b343u ^ (uint32_t)y * 0xd8163841u ^ (uint32_t)z * 0xcb1ab31fu;
    h = (h ^ h >> 16) * 0x7feb352du;
    h = (h ^ h >> 15) * 0x846ca68bu;
    return h ^ h >> 16;
}

static double cell_value(int32_t x, int32_t y, int32_t z, uint32_t seed)
{
    return cell_hash(x, y, z, seed) * 0x1p-32;
}

/* Value noise with quintic interpolation, 0..1; the third dimension is skipped where it is constant. */
static double noise(double x, double y, double z, bool flat, uint32_t seed)
{
    double fx = floor(x), fy = floor(y), fz = flat ? 0 : floor(z), slices[2];
    int32_t ix = (int32_t)fx, iy = (int32_t)fy, iz = (int32_t)fz;
    x -= fx;
    y -= fy;
    z -= fz;
    double sx = x * x * x * (x * (x * 6 - 15) + 10), sy = y * y * y * (y * (y * 6 - 15) + 10);
    for (int k = 0; k < (flat ? 1 : 2); k++) {
        double a = cell_value(ix, iy, iz + k, seed), b = cell_value(ix + 1, iy, iz + k, seed);
        double c = cell_value(ix, iy + 1, iz + k, seed), d = cell_value(ix + 1, iy + 1, iz + k, seed);
        a += (b - a) * sx;
        c += (d - c) * sx;
        slices[k] = a + (c - a) * sy;
    }
    if (flat)
        return slices[0];
    return slices[0] + (slices[1] - slices[0]) * (z * z * z * (z * (z * 6 - 15) + 10));
}

/* Octaves from wave `coarse` down to the finest, each 0.6 as strong as the last; 0..1 around 0.5. */
static double octaves(const double p[3], double coarse, double stretch, bool flat, double finest, uint32_t seed)
{
    double sum = 0, weight = 1, total = 0;
    for (double wave = coarse; wave >= (finest > 0 ? finest : finest_wave); wave /= 2.17) {
        sum += weight * noise(p[0] / wave, p[1] / wave, p[2] / (wave * stretch), flat, seed++);
        total += weight;
        weight *= 0.6;
    }
    return total > 0 ? sum / total : 0.5;
}

static void mix(double color[3], const uint8_t target[3], double share)
{
    for (int i = 0; i < 3; i++)
        color[i] += (target[i] - color[i]) * share;
}

static void three_way(const struct spl_material *m, double value, double color[3])
{
    /* The sum of octaves crowds around 0.5; the ramp's ends lie where it still gets to. */
    double x = (value - 0.5) * 3;
    x = x < -1 ? -1 : x > 1 ? 1 : x;
    mix(color, m->colors[1], 1);
    mix(color, m->colors[x < 0 ? 0 : 2], fabs(x));
}

static void masonry(const struct spl_material *m, double u, double v, double color[3])
{
    double row = floor(v / m->size[1]);
    double shifted = u + (fmod(row, 2) != 0 ? m->size[0] / 2 : 0), column = floor(shifted / m->size[0]);
    double x = shifted - column * m->size[0], y = v - row * m->size[1];
    double edge = fmin(fmin(x, m->size[0] - x), fmin(y, m->size[1] - y)); /* to the middle of the joint */
    double block = cell_value((int32_t)column, (int32_t)row, 0, m->seed);
    mix(color, m->colors[1], block);
    double tint = octaves((double[3]){u, v, 0}, 0.21, 1, true, m->finest, m->seed + 1) - 0.5;
    for (int i = 0; i < 3; i++)
        color[i] += 255 * m->grain * tint;
    mix(color, m->colors[2], 1 - smooth(m->joint / 2 - ramp / 2, m->joint / 2 + ramp / 2, edge));
}

/* Two by three panes; u and v run over the rectangle from -half to +half. */
static void window(const struct spl_material *m, const double half[2], double u, double v, double color[3])
{
    double x = fabs(u), y = fabs(fmod(v + half[1], half[1] * 2 / 3)), bar = 0.03;
    y = fmin(y, half[1] * 2 / 3 - y);
    double edge = fmin(fmin(x, half[0] - x), y);
    mix(color, m->colors[1], (v + half[1]) / (2 * half[1]));
    mix(color, m->colors[2], 1 - smooth(bar - ramp, bar, edge));
}

/* Columns of 5×7 letters, lowest bit on top: A to Z. */
static const uint8_t letters[26][5] = {
    {0x7c, 0x12, 0x11, 0x12, 0x7c}, {0x7f, 0x49, 0x49, 0x49, 0x36}, {0x3e, 0x41, 0x41, 0x41, 0x22},
    {0x7f, 0x41, 0x41, 0x41, 0x3e}, {0x7f, 0x49, 0x49, 0x49, 0x41}, {0x7f, 0x09, 0x09, 0x09, 0x01},
    {0x3e, 0x41, 0x41, 0x51, 0x73}, {0x7f, 0x08, 0x08, 0x08, 0x7f}, {0x00, 0x41, 0x7f, 0x41, 0x00},
    {0x20, 0x40, 0x41, 0x3f, 0x01}, {0x7f, 0x08, 0x14, 0x22, 0x41}, {0x7f, 0x40, 0x40, 0x40, 0x40},
    {0x7f, 0x02, 0x1c, 0x02, 0x7f}, {0x7f, 0x04, 0x08, 0x10, 0x7f}, {0x3e, 0x41, 0x41, 0x41, 0x3e},
    {0x7f, 0x09, 0x09, 0x09, 0x06}, {0x3e, 0x41, 0x51, 0x21, 0x5e}, {0x7f, 0x09, 0x19, 0x29, 0x46},
    {0x26, 0x49, 0x49, 0x49, 0x32}, {0x03, 0x01, 0x7f, 0x01, 0x03}, {0x3f, 0x40, 0x40, 0x40, 0x3f},
    {0x1f, 0x20, 0x40, 0x20, 0x1f}, {0x3f, 0x40, 0x38, 0x40, 0x3f}, {0x63, 0x14, 0x08, 0x14, 0x63},
    {0x03, 0x04, 0x78, 0x04, 0x03}, {0x61, 0x59, 0x49, 0x4d, 0x43},
};
enum { line_letters = SPL_PLAQUE_LETTERS, line_count = SPL_PLAQUE_LINES, letter_width = 6, letter_height = 10 };
static const char inscription[line_count][line_letters + 1] = {
    "MEASURE WHAT CAN  ", "BE MEASURED AND   ", "MAKE MEASURABLE   ",
    "WHAT CANNOT BE    ", "SPLATS JUDGED BY  ", "VEXING QUARTZ FORM",
};

/* Whether letter-pixel (x, y) of the text is inked; y grows downwards. */
static bool inked(const char (*text)[line_letters + 1], int x, int y)
{
    x -= letter_width;
    y -= letter_height / 2;
    if (x < 0 || y < 0 || x >= line_letters * letter_width || y >= line_count * letter_height)
        return false;
    char letter = text[y / letter_height][x / letter_width];
    int column = x % letter_width, row = y % letter_height;
    return letter >= 'A' && letter <= 'Z' && column < 5 && row < 7 && letters[letter - 'A'][column] >> row & 1;
}

/* The bitmap, interpolated, with the contrast of its edges raised: strokes stay letters, edges stay ramps. */
static void plaque(const struct spl_material *m, const double half[2], double u, double v, double color[3])
{
    double x = (u + half[0]) / (2 * half[0]) * (line_letters + 2) * letter_width - 0.5;
    double y = (half[1] - v) / (2 * half[1]) * (line_count + 1) * letter_height - 0.5;
    const char(*text)[line_letters + 1] = m->text ? m->text : inscription;
    int ix = (int)floor(x), iy = (int)floor(y);
    x -= ix;
    y -= iy;
    double top = inked(text, ix, iy) * (1 - x) + inked(text, ix + 1, iy) * x;
    double bottom = inked(text, ix, iy + 1) * (1 - x) + inked(text, ix + 1, iy + 1) * x;
    mix(color, m->colors[1], smooth(0.25, 0.75, top * (1 - y) + bottom * y));
}

static void leaf(const struct spl_material *m, const struct spl_primitive *p, double u, double v, double color[3])
{
    uint64_t bits;
    memcpy(&bits, &p->center[0], sizeof bits);
    mix(color, m->colors[1], unit_of(hash64(bits)));
    double rib = fabs(v) / p->half[0], side = fabs(fmod(fabs(u) / p->half[0] * 4 + 2 * rib, 1) - 0.5);
    mix(color, m->colors[2], 0.6 * (1 - smooth(0.08, 0.2, rib)) + 0.2 * side);
}

void spl_material_shade(const struct spl_material *m, const struct spl_primitive *p, const double position[3],
                        double color[3])
{
    double from[3];
    for (int i = 0; i < 3; i++)
        color[i] = m->colors[0][i];
    sub3(position, p->center, from);
    double u = dot3(from, p->u), v = dot3(from, p->v);
    if (p->kind == SPL_PRIMITIVE_CONE) { /* unrolled */
        u = atan2(v, u) * (p->half[0] + p->half[1]) / 2;
        v = dot3(from, p->normal);
    }
    u += p->offset[0];
    v += p->offset[1];
    switch (m->kind) {
    case SPL_MATERIAL_FLAT:
        break;
    case SPL_MATERIAL_MASONRY:
        masonry(m, u, v, color);
        break;
    case SPL_MATERIAL_PLASTER:
        three_way(m, octaves((double[3]){u, v, 0}, m->size[0], 1, true, m->finest, m->seed), color);
        break;
    case SPL_MATERIAL_SOLID:
        three_way(m, octaves(position, m->size[0], m->size[1] / m->size[0], false, m->finest, m->seed), color);
        break;
    case SPL_MATERIAL_WINDOW:
        window(m, p->half, u, v, color);
        break;
    case SPL_MATERIAL_PLAQUE:
        plaque(m, p->half, u, v, color);
        break;
    case SPL_MATERIAL_LEAF:
        leaf(m, p, u, v, color);
        break;
    }
    for (int i = 0; i < 3; i++)
        color[i] = color[i] <= 0 ? 0 : color[i] >= 255 ? 255 : color[i];
}

void spl_material_color(const struct spl_material *material, const struct spl_primitive *primitive,
                        const double position[3], uint8_t color[3])
{
    double exact[3];
    spl_material_shade(material, primitive, position, exact);
    for (int i = 0; i < 3; i++)
        color[i] = (uint8_t)(exact[i] + 0.5);
}
