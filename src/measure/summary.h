/* What a series of measurements comes to. Medians and quartiles, since a shared machine's noise is one-sided. */
#ifndef SPL_MEASURE_SUMMARY_H
#define SPL_MEASURE_SUMMARY_H

#include <stddef.h>

struct spl_summary {
    double min, q1, median, q3, max;
};

/* Sorts `values` in place; quantiles are interpolated linearly. count == 0 gives zeros. */
struct spl_summary spl_summarise(double *values, size_t count);

/* The value below which `share` (0..1) of the `count` (> 0) ascending values lie, interpolated linearly. */
double spl_quantile(const double *sorted, size_t count, double share);

#endif
