/* What the benches in C share: clocks and order. */
#ifndef SPL_BENCH_TIMING_H
#define SPL_BENCH_TIMING_H

#include <stdlib.h>
#include <time.h>

static inline double bench_now_ms(clockid_t clock)
{
    struct timespec t;
    clock_gettime(clock, &t);
    return (double)t.tv_sec * 1e3 + (double)t.tv_nsec * 1e-6;
}

static inline int bench_ascending(const void *a, const void *b)
{
    double x = *(const double *)a, y = *(const double *)b;
    return (x > y) - (x < y);
}

/* The middle one of `count` values, which are sorted. */
static inline double bench_median(double *values, size_t count)
{
    qsort(values, count, sizeof *values, bench_ascending);
    return values[count / 2];
}

#endif
