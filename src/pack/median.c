/* Medians of a few hundred radii, by sorting: samples are so small that nothing cleverer pays. An even count gives the
 * upper of its two middle values, so a median is always a value of the sample. */
#include "pack/median.h"

#include <stdlib.h>

static int compare(const void *a, const void *b)
{
    float x = *(const float *)a, y = *(const float *)b;
    return x < y ? -1 : x > y;
}

float spl_median(float *values, size_t count)
{
    qsort(values, count, sizeof *values, compare);
    return values[count / 2];
}
