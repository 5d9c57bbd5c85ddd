/* Medians of a few hundred radii, by sorting where somebody reads them in order, else, as quantiles of many, by
 * dividing the part that they lie in. An even count gives the upper of its two middle values, so a median is always a
 * value of the sample. */
#include "pack/median.h"

#include <stdlib.h>

#include "base/memory.h"

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

double spl_nth(double *values, size_t count, size_t nth)
{
    size_t begin = 0, end = count;
    while (end - begin > 1) {
        double a = values[begin], b = values[begin + (end - begin) / 2], c = values[end - 1];
        double pivot = a < b ? (b < c ? b : a < c ? c : a) : (a < c ? a : b < c ? c : b);
        size_t i = begin, j = end - 1;
        for (;;) {
            while (values[i] < pivot)
                i++;
            while (values[j] > pivot)
                j--;
            if (i >= j)
                break;
            double t = values[i];
            values[i++] = values[j];
            values[j--] = t;
        }
        /* [begin, i) <= pivot <= [j + 1, end), and i - 1 <= j + 1 */
        size_t split = values[i] < pivot ? i + 1 : i;
        if (nth < split && split < end)
            end = split;
        else if (nth >= split && split > begin)
            begin = split;
        else
            break;
    }
    return values[nth];
}

float spl_middle(const float *values, size_t count)
{
    double copy[SPL_MIDDLE_MAX];
    spl_assert(count <= SPL_MIDDLE_MAX);
    for (size_t i = 0; i < count; i++)
        copy[i] = (double)values[i];
    return (float)spl_nth(copy, count, count / 2);
}
