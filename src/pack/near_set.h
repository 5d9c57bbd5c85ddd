/* Collecting the nearest of many points: what lies within a bound is added, and the bound tightened whenever
 * SPL_NEAR_SET_SPARE more than the wanted ones are there, so that a dense cluster costs a search no more than its
 * surroundings. Loops are written to vectorise, and inline, so that they are compiled for whatever processor the search
 * that uses them is: a file that includes this defines SPL_NEAR_AVX2 or SPL_NEAR_AVX512 before, or neither. All give
 * the same, in the same order. */
#ifndef SPL_PACK_NEAR_SET_H
#define SPL_PACK_NEAR_SET_H

#include <math.h>

#include "pack/points.h"

#if defined(SPL_NEAR_AVX512)
#include <immintrin.h>
#define SPL_NEAR_TARGET __attribute__((target("avx512f,avx512vl,avx512dq,bmi,popcnt")))
enum { SPL_LANES = 8 };
#elif defined(SPL_NEAR_AVX2)
#define SPL_NEAR_TARGET __attribute__((target("avx2,bmi,popcnt")))
enum { SPL_LANES = 4 };
#else
#define SPL_NEAR_TARGET
enum { SPL_LANES = 2 };
#endif
#define SPL_INLINE SPL_NEAR_TARGET static inline __attribute__((always_inline))

/* A few doubles, unaligned in memory; comparisons give masks. */
typedef double spl_vec __attribute__((vector_size(SPL_LANES * 8), aligned(8), may_alias));
typedef int64_t spl_mask __attribute__((vector_size(SPL_LANES * 8), aligned(8), may_alias));
typedef float spl_vec_floats __attribute__((vector_size(SPL_LANES * 4), aligned(4), may_alias));
typedef int32_t spl_vec_steps __attribute__((vector_size(SPL_LANES * 4), aligned(4), may_alias));
typedef uint32_t spl_vec_index __attribute__((vector_size(SPL_LANES * 4), aligned(4), may_alias));
#define SPL_VEC(v) ((v) - (spl_vec){0}) /* of -0 too */

enum {
    SPL_NEAR_SET_SPARE = 40, /* points beyond the wanted ones that wait for a reduction */
    SPL_NEAR_SET_RUN = 16,   /* a search adds at most before it reduces again */
    SPL_NEAR_SET_MAX = (SPL_NEIGHBOURS_MAX + 1 + SPL_NEAR_SET_SPARE + SPL_NEAR_SET_RUN + 7) / 8 * 8
};

struct spl_near_set {
    unsigned count, wanted;                       /* of which SPL_NEIGHBOURS_MAX + 1 at most */
    double bound;                                 /* squared; `wanted` points lie within it */
    double squared[SPL_NEAR_SET_MAX + SPL_LANES]; /* and room for a vector that is stored at the end */
    uint32_t index[SPL_NEAR_SET_MAX + SPL_LANES];
};

/* GCC converts eight in two halves. */
SPL_INLINE spl_vec spl_from_floats(spl_vec_floats v)
{
#if defined(SPL_NEAR_AVX512)
    return (spl_vec)_mm512_cvtps_pd((__m256)v);
#else
    return __builtin_convertvector(v, spl_vec);
#endif
}

SPL_INLINE spl_vec spl_from_steps(spl_vec_steps v)
{
#if defined(SPL_NEAR_AVX512)
    return (spl_vec)_mm512_cvtepi32_pd((__m256i)v);
#else
    return __builtin_convertvector(v, spl_vec);
#endif
}

/* SPL_LANES indices from `first` on. */
SPL_INLINE spl_vec_index spl_indices(uint32_t first)
{
    spl_vec_index index;
    for (unsigned k = 0; k < SPL_LANES; k++)
        index[k] = k;
    return index + first;
}

SPL_INLINE spl_vec spl_select(spl_mask which, spl_vec yes, spl_vec no)
{
    return (spl_vec)(((spl_mask)yes & which) | ((spl_mask)no & ~which));
}

SPL_INLINE spl_vec spl_greater(spl_vec a, spl_vec b)
{
#if defined(SPL_NEAR_AVX512)
    return (spl_vec)_mm512_max_pd((__m512d)a, (__m512d)b);
#else
    return spl_select(a > b, a, b);
#endif
}

SPL_INLINE spl_vec spl_lesser(spl_vec a, spl_vec b)
{
#if defined(SPL_NEAR_AVX512)
    return (spl_vec)_mm512_min_pd((__m512d)a, (__m512d)b);
#else
    return spl_select(a < b, a, b);
#endif
}

/* Counts in each lane what is at most its limit. */
SPL_INLINE spl_mask spl_count_up(spl_mask count, spl_vec values, spl_vec limit)
{
#if defined(SPL_NEAR_AVX512)
    __mmask8 within = _mm512_cmp_pd_mask((__m512d)values, (__m512d)limit, _CMP_LE_OQ);
    return (spl_mask)_mm512_mask_add_epi64((__m512i)count, within, (__m512i)count, _mm512_set1_epi64(1));
#else
    return count - (values <= limit);
#endif
}

/* Bit k: whether value k of SPL_LANES is at most `limit`. */
SPL_INLINE unsigned spl_bits_within(spl_vec values, double limit)
{
#if defined(SPL_NEAR_AVX512)
    return _mm512_cmp_pd_mask((__m512d)values, _mm512_set1_pd(limit), _CMP_LE_OQ);
#else
    unsigned bits = 0;
    for (unsigned k = 0; k < SPL_LANES; k++)
        bits |= (unsigned)(values[k] <= limit) << k;
    return bits;
#endif
}

/* Bit k: whether index k of the first `n` of SPL_LANES is another than `other`. */
SPL_INLINE unsigned spl_bits_other(spl_vec_index index, unsigned n, uint32_t other)
{
    unsigned used = n < SPL_LANES ? (1u << n) - 1 : (1u << SPL_LANES) - 1;
#if defined(SPL_NEAR_AVX512)
    return used & _mm256_cmpneq_epi32_mask((__m256i)index, _mm256_set1_epi32((int)other));
#else
    unsigned bits = 0;
    for (unsigned k = 0; k < SPL_LANES; k++)
        bits |= (unsigned)(index[k] != other) << k;
    return used & bits;
#endif
}

/* How many of `n` values, padded with infinity to whole SPL_LANES, are at most `limit`. */
SPL_INLINE unsigned spl_count_within(const double *values, unsigned n, double limit)
{
#if defined(SPL_NEAR_AVX512)
    unsigned count = 0;
    for (unsigned i = 0; i < n; i += SPL_LANES)
        count += (unsigned)__builtin_popcount(spl_bits_within(*(const spl_vec *)(values + i), limit));
    return count;
#else
    spl_vec most = SPL_VEC(limit);
    spl_mask sum = {0};
    for (unsigned i = 0; i < n; i += SPL_LANES)
        sum -= *(const spl_vec *)(values + i) <= most;
    unsigned count = 0;
    for (int k = 0; k < SPL_LANES; k++)
        count += (unsigned)sum[k];
    return count;
#endif
}

/* The least of `n` values, padded like these, above `limit`. */
SPL_INLINE double spl_next_above(const double *values, unsigned n, double limit)
{
    spl_vec floor = SPL_VEC(limit), least = SPL_VEC(INFINITY);
    for (unsigned i = 0; i < n; i += SPL_LANES) {
        spl_vec v = *(const spl_vec *)(values + i);
#if defined(SPL_NEAR_AVX512)
        __mmask8 above = _mm512_cmp_pd_mask((__m512d)v, (__m512d)floor, _CMP_GT_OQ);
        least = (spl_vec)_mm512_mask_min_pd((__m512d)least, above, (__m512d)least, (__m512d)v);
#else
        least = spl_select((v > floor) & (v < least), v, least);
#endif
    }
    double found = least[0];
    for (int k = 1; k < SPL_LANES; k++)
        found = least[k] < found ? least[k] : found;
    return found;
}

/* Appends those of SPL_LANES points whose bits are set, in their order; returns the end. Writes up to SPL_LANES. */
SPL_INLINE unsigned spl_near_put(double *squared, uint32_t *index, unsigned at, unsigned bits, spl_vec from_squared,
                                 spl_vec_index from_index)
{
#if defined(SPL_NEAR_AVX512)
    __m512d nearest = _mm512_maskz_compress_pd((__mmask8)bits, (__m512d)from_squared);
    _mm512_storeu_pd(squared + at, nearest);
    _mm256_storeu_si256((__m256i *)(index + at), _mm256_maskz_compress_epi32((__mmask8)bits, (__m256i)from_index));
    return at + (unsigned)__builtin_popcount(bits);
#else
    for (unsigned k = 0; k < SPL_LANES; k++) {
        squared[at] = from_squared[k];
        index[at] = from_index[k];
        at += bits >> k & 1;
    }
    return at;
#endif
}

/* Keeps the `wanted` nearest candidates and tightens the bound to just them. The threshold that counts just `wanted`
 * is found by false position: on a surface the count grows linearly with the squared distance. Where several are
 * equally far (points on a grid), the first of them are kept. */
SPL_INLINE void spl_near_set_reduce(struct spl_near_set *c)
{
    unsigned n = c->count, low_count = 0, high_count = n, wanted = c->wanted, ties = 0;
    if (n <= wanted)
        return;
    *(spl_vec *)(c->squared + n) = SPL_VEC(INFINITY);
    double low = -1, high = c->bound, at_tie = INFINITY;
    for (int step = 0; low_count < wanted && ties == 0; step++) {
        bool by_value = step >= 6;
        double from = low > 0 ? low : 0;
        double t = by_value
                       ? spl_next_above(c->squared, n, low)
                       : from + (high - from) * ((double)(wanted - low_count) + 0.4) / (double)(high_count - low_count);
        unsigned count = spl_count_within(c->squared, n, t);
        if (count <= wanted) {
            low = t;
            low_count = count;
        } else if (by_value) { /* all between low and t are at t */
            at_tie = t;
            ties = wanted - low_count;
        } else {
            high = t;
            high_count = count;
        }
    }
    unsigned kept = 0;
    for (unsigned i = 0; !ties && i < n; i += SPL_LANES) {
        spl_vec squared = *(const spl_vec *)(c->squared + i);
        kept = spl_near_put(c->squared, c->index, kept, spl_bits_within(squared, low), squared,
                            *(const spl_vec_index *)(c->index + i));
    }
    for (unsigned i = 0, left = ties; ties && i < n; i++) {
        double d = c->squared[i];
        c->squared[kept] = d;
        c->index[kept] = c->index[i];
        unsigned tie = left > 0 && d == at_tie;
        left -= tie;
        kept += (d <= low) | tie;
    }
    c->count = wanted;
    c->bound = at_tie < INFINITY ? at_tie : low;
}

#endif
