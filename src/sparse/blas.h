/* The few calls of BLAS and LAPACK that dictionaries need, from a library that is loaded when the first of them is
 * wanted: a daemon that only serves neither links it nor starts its threads. */
#ifndef SPL_SPARSE_BLAS_H
#define SPL_SPARSE_BLAS_H

#include <stddef.h>

#include "base/error.h"

/* Loads OpenBLAS, once a process; the calls below may be used from then on, from any number of threads at once: each
 * runs on the thread that makes it, so that sums are formed in the same order whatever runs beside them.
 * SPL_E_UNSUPPORTED where the library is missing, is one that cannot be called from several threads, or lacks a symbol.
 * To be called before other threads of the caller's read the environment (it sets OPENBLAS_NUM_THREADS). */
int spl_blas_open(struct spl_error *err);

/* out[rows × columns] = a[rows × depth] · b[columns × depth]ᵀ, all row by row without gaps. */
void spl_blas_product(size_t rows, size_t columns, size_t depth, const float *a, const float *b, float *out);

/* y += factor · x */
void spl_blas_add(size_t count, float factor, const float *x, float *y);

float spl_blas_dot(size_t count, const float *x, const float *y);

/* out[rows] = a[rows × columns] · x */
void spl_blas_apply(size_t rows, size_t columns, const float *a, const float *x, float *out);

/* out[columns] = a[rows × columns]ᵀ · x */
void spl_blas_apply_transposed(size_t rows, size_t columns, const float *a, const float *x, float *out);

/* out[n × n] += a[rows × n]ᵀ · a; the upper triangle only. */
void spl_blas_covariance(size_t rows, size_t n, const float *a, float *out);

/* The `wanted` largest eigenvalues of the symmetric matrix a[n × n] (its upper triangle; destroyed), largest first, and
 * their unit vectors, one a row of vectors[wanted × n]. Behind the matrix are SPL_BLAS_PAD floats more, since OpenBLAS
 * reads some (0.3.21, ssymv of processors that it does not know) and would leave the page. SPL_E_NOMEM,
 * SPL_E_INTERNAL (no convergence: not finite). */
enum { SPL_BLAS_PAD = 16 };
int spl_blas_eigen(size_t n, float *a, size_t wanted, float *values, float *vectors, struct spl_error *err);

#endif
