/* Layers of numbers as 8 or 16 bit pictures.
 *
 * A pixel with nothing in it is black (0) in every picture, and no pixel with something in it is: the darkest end of
 * the colour map, hashed ids and 16 bit depths keep clear of 0. Pure functions; any thread. */
#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "base/float.h"
#include "base/memory.h"
#include "image/encode.h"

/* Near is warm and light, far is blue and dark; lightness falls evenly along the map, so steps look equal. */
static const uint8_t anchors[][3] = {
    {253, 243, 181}, {253, 203, 104}, {243, 153, 62}, {219, 105, 79},
    {180, 73, 106},  {134, 54, 122},  {88, 43, 116},  {52, 30, 85},
};
enum { ANCHORS = sizeof anchors / sizeof *anchors, MAP_STEPS = 256 };

static void make_map(uint8_t map[MAP_STEPS][3])
{
    for (int i = 0; i < MAP_STEPS; i++) {
        float t = (float)i / (MAP_STEPS - 1) * (ANCHORS - 1);
        int left = t < ANCHORS - 2 ? (int)t : ANCHORS - 2;
        for (int c = 0; c < 3; c++) {
            float a = anchors[left][c], b = anchors[left + 1][c];
            map[i][c] = (uint8_t)(a + (b - a) * (t - (float)left) + 0.5f);
        }
    }
}

/* Positive floats sort like their bits, so the upper 16 bits make a histogram whose bins are 1/128 of their value
 * wide: enough for a robust range, in one pass. */
enum { BINS = 0x7f80, BIN_SHIFT = 16 };

static int robust_range(const float *values, size_t count, float *near, float *far, struct spl_error *err)
{
    size_t *histogram = spl_alloc(BINS, sizeof *histogram, err);
    if (!histogram)
        return SPL_E_NOMEM;
    size_t total = 0;
    float least = INFINITY, most = 0;
    for (size_t i = 0; i < count; i++) {
        float value = values[i];
        if (!(value > 0 && value < INFINITY))
            continue;
        histogram[spl_float_to_bits(value) >> BIN_SHIFT]++;
        total++;
        least = value < least ? value : least;
        most = value > most ? value : most;
    }
    *near = *far = 0;
    if (total) {
        size_t skip = total / 100, seen = 0;
        uint32_t first = 0, last = BINS - 1;
        while ((seen += histogram[first]) <= skip)
            first++;
        for (seen = 0; (seen += histogram[last]) <= skip;)
            last--;
        *near = fmaxf(spl_float_of_bits(first << BIN_SHIFT), least);
        *far = fminf(spl_float_of_bits((last + 1) << BIN_SHIFT), most);
    }
    free(histogram);
    return SPL_OK;
}

/* Depth or range through the colour map, nothing = black. near and far get the values at the map's ends: the 1st and
 * 99th percentile to within 1 % of their value, 0 and 0 where nothing is. */
static int convert_distance(const float *values, size_t count, uint8_t *rgb, float *near, float *far,
                            struct spl_error *err)
{
    int rc = robust_range(values, count, near, far, err);
    if (rc)
        return rc;
    uint8_t map[MAP_STEPS][3];
    make_map(map);
    float scale = *far > *near ? (MAP_STEPS - 1) / (*far - *near) : 0;
    for (size_t i = 0; i < count; i++) {
        static const uint8_t nothing[3];
        float step = fminf(fmaxf((values[i] - *near) * scale, 0), MAP_STEPS - 1);
        memcpy(rgb + 3 * i, values[i] >= 0 ? map[(int)(step + 0.5f)] : nothing, 3);
    }
    return SPL_OK;
}

/* A share of 0..1 as 0..255; what is not a number becomes 0. */
static uint8_t unit_to_byte(float value)
{
    return value > 0 ? (uint8_t)(fminf(value, 1) * 255 + 0.5f) : 0;
}

void spl_convert_normal(const float *normals, size_t count, uint8_t *rgb)
{
    for (size_t i = 0; i < count; i++) {
        const float *n = normals + 3 * i;
        float length2 = n[0] * n[0] + n[1] * n[1] + n[2] * n[2];
        for (int c = 0; c < 3; c++)
            rgb[3 * i + c] = length2 > 0 ? unit_to_byte((n[c] + 1) / 2) : 0;
    }
}

/* A colour by hash of the id, never black; nothing = black. */
static void convert_id(const uint32_t *ids, size_t count, uint8_t *rgb)
{
    for (size_t i = 0; i < count; i++) {
        uint32_t h = ids[i];
        if (h == UINT32_MAX) {
            memset(rgb + 3 * i, 0, 3);
            continue;
        }
        /* murmur3's finaliser: neighbouring ids get colours far apart */
        h = (h ^ h >> 16) * 0x85ebca6bu;
        h = (h ^ h >> 13) * 0xc2b2ae35u;
        h ^= h >> 16;
        for (int c = 0; c < 3; c++)
            rgb[3 * i + c] = (uint8_t)(48 + (h >> 8 * c & 255) * 207 / 255);
    }
}

void spl_convert_primitive(const uint32_t *primitives, size_t count, uint8_t *rgb)
{
    for (size_t i = 0; i < count; i++)
        spl_shape_color((enum spl_shape)primitives[i], rgb + 3 * i);
}

void spl_convert_coverage(const float *values, size_t count, uint8_t *grey)
{
    for (size_t i = 0; i < count; i++)
        grey[i] = unit_to_byte(values[i]);
}

uint64_t spl_convert_depth16(const float *values, size_t count, double scale, uint16_t *grey)
{
    uint64_t saturated = 0;
    for (size_t i = 0; i < count; i++) {
        double steps = (double)values[i] * scale + 0.5;
        if (!(values[i] >= 0)) {
            grey[i] = 0;
        } else if (steps >= 65536) {
            grey[i] = 65535;
            saturated++;
        } else {
            grey[i] = steps < 1 ? 1 : (uint16_t)steps;
        }
    }
    return saturated;
}

int spl_convert_picture(const struct spl_image *image, uint8_t **out, struct spl_encoded *encoded,
                        struct spl_error *err)
{
    size_t count = (size_t)image->width * image->height;
    bool grey = image->layer == SPL_LAYER_COVERAGE;
    uint8_t *picture = *out = spl_alloc_raw(count, grey ? 1 : 3, err);
    if (!picture)
        return SPL_E_NOMEM;
    if (grey) {
        spl_convert_coverage(image->pixels, count, picture);
        encoded->far = 1;
    } else if (image->layer == SPL_LAYER_NORMAL) {
        spl_convert_normal(image->pixels, count, picture);
    } else if (image->layer == SPL_LAYER_ID) {
        convert_id(image->pixels, count, picture);
    } else if (image->layer == SPL_LAYER_PRIMITIVE) {
        spl_convert_primitive(image->pixels, count, picture);
    } else {
        return convert_distance(image->pixels, count, picture, &encoded->near, &encoded->far, err);
    }
    return SPL_OK;
}
