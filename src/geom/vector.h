/* Doubles in threes. */
#ifndef SPL_GEOM_VECTOR_H
#define SPL_GEOM_VECTOR_H

#include <math.h>

static inline double dot3(const double a[3], const double b[3])
{
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
}

static inline double distance3(const double a[3], const double b[3])
{
    return sqrt((a[0] - b[0]) * (a[0] - b[0]) + (a[1] - b[1]) * (a[1] - b[1]) + (a[2] - b[2]) * (a[2] - b[2]));
}

static inline void sub3(const double a[3], const double b[3], double out[3])
{
    for (int i = 0; i < 3; i++)
        out[i] = a[i] - b[i];
}

/* out = a + t b; out may be a. */
static inline void mad3(const double a[3], double t, const double b[3], double out[3])
{
    for (int i = 0; i < 3; i++)
        out[i] = a[i] + t * b[i];
}

static inline void cross3(const double a[3], const double b[3], double out[3])
{
    out[0] = a[1] * b[2] - a[2] * b[1];
    out[1] = a[2] * b[0] - a[0] * b[2];
    out[2] = a[0] * b[1] - a[1] * b[0];
}

/* Scales `a` to length 1 and returns the length it had. */
static inline double normalise3(double a[3])
{
    double length = sqrt(dot3(a, a));
    for (int i = 0; i < 3; i++)
        a[i] /= length;
    return length;
}

/* A unit vector orthogonal to the unit vector `n`. */
static inline void orthogonal3(const double n[3], double out[3])
{
    double axis[3] = {fabs(n[0]) < 0.6, fabs(n[0]) >= 0.6, 0};
    cross3(n, axis, out);
    normalise3(out);
}

#endif
