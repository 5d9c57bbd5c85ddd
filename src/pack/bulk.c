/* Quantiles alone are spoilt by values that mean none, of which some scanners and grids write more than a hundredth;
 * but such ones lie together, and far off all else. */
#include "pack/bulk.h"

#include <stdlib.h>

#include "pack/median.h"

enum { ends = 20 };

static int compare_doubles(const void *a, const void *b)
{
    double x = *(const double *)a, y = *(const double *)b;
    return x < y ? -1 : x > y;
}

double spl_bulk_order(double *values, size_t count)
{
    size_t low = count / ends, high = count - 1 - count / ends;
    spl_nth(values, count, low);
    spl_nth(values + low, count - low, high - low);
    qsort(values, low, sizeof *values, compare_doubles);
    qsort(values + high, count - high, sizeof *values, compare_doubles);
    return values[high] - values[low];
}

void spl_bulk_find(const double *values, size_t count, size_t left_out, double gap, size_t *first, size_t *last)
{
    size_t low = count / ends, high = count - 1 - count / ends;
    *first = low;
    *last = high;
    while (*first > left_out && values[*first] - values[*first - 1] <= gap)
        --*first;
    while (*last < count - 1 - left_out && values[*last + 1] - values[*last] <= gap)
        ++*last;
}
