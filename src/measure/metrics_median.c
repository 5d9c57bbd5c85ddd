/* The median of many floats without sorting or moving them.
 *
 * Floats that are not negative sort like their bits, so that a value of some rank is found by counting: a histogram of
 * the upper 16 bits finds the bin, one of the lower 16 bits inside that bin the value, exactly. Two passes, 256 KiB. */
#include <math.h>
#include <string.h>

#include "base/float.h"
#include "measure/metrics_parts.h"

enum { bins = 1 << 16 };

static inline uint32_t bits_of(float value)
{
    return spl_float_to_bits(value) & 0x7fffffff; /* -0 is 0 */
}

/* The bin that holds rank `*rank`, which becomes the rank inside it. */
static uint32_t find_bin(const uint32_t *histogram, uint64_t *rank)
{
    uint32_t bin = 0;
    while (*rank >= histogram[bin])
        *rank -= histogram[bin++];
    return bin;
}

static float select_rank(const float *values, size_t count, uint64_t rank)
{
    uint32_t histogram[bins] = {0};
    for (size_t i = 0; i < count; i++)
        if (!isnan(values[i]))
            histogram[bits_of(values[i]) >> 16]++;
    uint32_t upper = find_bin(histogram, &rank);
    memset(histogram, 0, sizeof histogram);
    for (size_t i = 0; i < count; i++)
        if (!isnan(values[i]) && bits_of(values[i]) >> 16 == upper)
            histogram[bits_of(values[i]) & 0xffff]++;
    return spl_float_of_bits(upper << 16 | find_bin(histogram, &rank));
}

double spl_metrics_median(const float *values, size_t count)
{
    uint64_t there = 0;
    for (size_t i = 0; i < count; i++)
        there += !isnan(values[i]);
    if (!there)
        return NAN;
    double upper = (double)select_rank(values, count, there / 2);
    return there % 2 ? upper : (upper + (double)select_rank(values, count, there / 2 - 1)) / 2;
}
