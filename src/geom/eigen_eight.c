/* Eight matrices side by side, each operation of eigen.c on all of them: what comes out is the same to the bit.
 * Matrices whose least eigenvalue is not simple take the other way, one by one. Compiled for AVX-512, for AVX2 and for
 * the base architecture; contraction is off. */
#include <math.h>
#include <stdint.h>

#include "geom/eigen.h"

enum { lanes = SPL_EIGEN_LANES };
typedef double spl_eight __attribute__((vector_size(lanes * 8), aligned(8), may_alias));
typedef int64_t spl_marks __attribute__((vector_size(lanes * 8)));

#define SPL_INLINE static inline __attribute__((always_inline))
#define SELECT(which, yes, no) ((spl_eight)(((spl_marks)(yes) & (which)) | ((spl_marks)(no) & ~(which))))

SPL_INLINE void root(spl_eight *values)
{
    double *v = (double *)values;
    for (int k = 0; k < lanes; k++)
        v[k] = sqrt(v[k]);
}

SPL_INLINE void cross(const spl_eight a[3], const spl_eight b[3], spl_eight out[3], spl_eight *squared)
{
    out[0] = a[1] * b[2] - a[2] * b[1];
    out[1] = a[2] * b[0] - a[0] * b[2];
    out[2] = a[0] * b[1] - a[1] * b[0];
    *squared = out[0] * out[0] + out[1] * out[1] + out[2] * out[2];
}

/* Unit eigenvectors of `value`; returns where it is simple. */
SPL_INLINE void vectors_of(const spl_eight m[6], const spl_eight *value, spl_eight out[3], spl_marks *simple)
{
    const spl_eight rows[3][3] = {
        {m[0] - *value, m[1], m[2]}, {m[1], m[3] - *value, m[4]}, {m[2], m[4], m[5] - *value}};
    spl_eight longest, length, other[3];
    cross(rows[0], rows[1], out, &longest);
    for (int i = 1; i < 3; i++) {
        cross(rows[i == 1 ? 0 : 1], rows[2], other, &length);
        const spl_marks longer = length > longest;
        longest = SELECT(longer, length, longest);
        for (int c = 0; c < 3; c++)
            out[c] = SELECT(longer, other[c], out[c]);
    }
    *simple = longest >= 1e-15;
    root(&longest);
    for (int c = 0; c < 3; c++)
        out[c] *= 1 / longest;
}

SPL_INLINE void decompose(const double in[6][lanes], double values[3][lanes], double least[3][lanes])
{
    spl_eight scale = {0}, a[6], normal[3];
    for (int i = 0; i < 6; i++) {
        const spl_eight v = *(const spl_eight *)in[i], size = (spl_eight)((spl_marks)v & INT64_MAX);
        scale = SELECT(size > scale, size, scale);
    }
    for (int i = 0; i < 6; i++)
        a[i] = *(const spl_eight *)in[i] / scale;
    spl_eight mean = (a[0] + a[3] + a[5]) / 3, off = a[1] * a[1] + a[2] * a[2] + a[4] * a[4];
    spl_eight dx = a[0] - mean, dy = a[3] - mean, dz = a[5] - mean;
    spl_eight p = (dx * dx + dy * dy + dz * dz + 2 * off) / 6;
    root(&p);
    spl_eight det = dx * (dy * dz - a[4] * a[4]) - a[1] * (a[1] * dz - a[4] * a[2]) + a[2] * (a[1] * a[4] - dy * a[2]);
    spl_eight r = det / (2 * p * p * p), first, second;
    r = SELECT(r > -1, r, (spl_eight){0} - 1);
    r = SELECT(r < 1, r, (spl_eight){0} + 1);
    for (int k = 0; k < lanes; k++) {
        const double angle = acos(r[k]) / 3;
        first[k] = cos(angle);
        second[k] = cos(angle + 2.0943951023931953);
    }
    spl_eight high = mean + 2 * p * first, low = mean + 2 * p * second, middle = 3 * mean - high - low;
    middle = SELECT(middle > low, middle, low);
    middle = SELECT(middle < high, middle, high);
    spl_marks simple;
    vectors_of(a, &low, normal, &simple);
    simple &= (middle - low > 1e-7) & (scale > 0) & (p >= 1e-10);
    *(spl_eight *)values[0] = low * scale;
    *(spl_eight *)values[1] = middle * scale;
    *(spl_eight *)values[2] = high * scale;
    for (int c = 0; c < 3; c++)
        *(spl_eight *)least[c] = normal[c];
    for (int k = 0; k < lanes; k++) {
        const double m[6] = {in[0][k], in[1][k], in[2][k], in[3][k], in[4][k], in[5][k]};
        double own[3], normal_own[3], most[3];
        if (simple[k])
            continue;
        spl_eigen_symmetric(m, own, normal_own, most);
        for (int c = 0; c < 3; c++) {
            values[c][k] = own[c];
            least[c][k] = normal_own[c];
        }
    }
}

#if defined(__x86_64__)
__attribute__((target("avx2"))) static void decompose_avx2(const double in[6][lanes], double values[3][lanes],
                                                           double least[3][lanes])
{
    decompose(in, values, least);
}

__attribute__((target("avx512f,avx512dq,avx512vl"))) static void
decompose_avx512(const double in[6][lanes], double values[3][lanes], double least[3][lanes])
{
    decompose(in, values, least);
}
#endif

void spl_eigen_symmetric_eight(const double m[6][SPL_EIGEN_LANES], double values[3][SPL_EIGEN_LANES],
                               double least[3][SPL_EIGEN_LANES])
{
#if defined(__x86_64__)
    if (__builtin_cpu_supports("avx512f") && __builtin_cpu_supports("avx512dq") && __builtin_cpu_supports("avx512vl")) {
        decompose_avx512(m, values, least);
        return;
    }
    if (__builtin_cpu_supports("avx2")) {
        decompose_avx2(m, values, least);
        return;
    }
#endif
    decompose(m, values, least);
}
