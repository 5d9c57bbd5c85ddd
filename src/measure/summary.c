/* Order statistics of a few hundred values at most: sorting is the simplest way there. Pure; any thread. */
#include "measure/summary.h"

#include <stdlib.h>

static int compare(const void *a, const void *b)
{
    double x = *(const double *)a, y = *(const double *)b;
    return (x > y) - (x < y);
}

double spl_quantile(const double *sorted, size_t count, double share)
{
    double at = share * (double)(count - 1);
    size_t below = (size_t)at, above = below + 1 < count ? below + 1 : below;
    return sorted[below] + (at - (double)below) * (sorted[above] - sorted[below]);
}

struct spl_summary spl_summarise(double *values, size_t count)
{
    struct spl_summary out = {0};
    if (!count)
        return out;
    qsort(values, count, sizeof *values, compare);
    out.min = values[0];
    out.q1 = spl_quantile(values, count, 0.25);
    out.median = spl_quantile(values, count, 0.5);
    out.q3 = spl_quantile(values, count, 0.75);
    out.max = values[count - 1];
    return out;
}
