/* OpenBLAS behind dlopen. Its pthread and OpenMP builds may be called from many threads at once when each call is told
 * to stay on its own; the serial build of Debian is made without locks and is refused. Threads would be started while
 * the library is loaded, so the variable that forbids it is set before. */
#include "sparse/blas.h"

#include <cblas.h>
#include <dlfcn.h>
#include <pthread.h>
#include <stdlib.h>
#include <string.h>

#include "base/memory.h"

typedef void eigen_function(const char *jobz, const char *range, const char *uplo, const int *n, float *a,
                            const int *lda, const float *vl, const float *vu, const int *il, const int *iu,
                            const float *abstol, int *m, float *w, float *z, const int *ldz, int *isuppz, float *work,
                            const int *lwork, int *iwork, const int *liwork, int *info);

static struct {
    __typeof__(cblas_sgemm) *gemm;
    __typeof__(cblas_saxpy) *axpy;
    __typeof__(cblas_sdot) *dot;
    __typeof__(cblas_sgemv) *gemv;
    __typeof__(cblas_ssyrk) *syrk;
    eigen_function *eigen;
    const char *missing; // may be NULL
} blas;

/* dlsym() gives a data pointer, which ISO C does not convert to one of a function. */
static bool find(void *library, const char *name, void *function)
{
    void *symbol = dlsym(library, name);
    memcpy(function, &symbol, sizeof symbol);
    return symbol != NULL;
}

static void load(void)
{
    int (*parallel)(void);
    setenv("OPENBLAS_NUM_THREADS", "1", 1);
    setenv("OMP_NUM_THREADS", "1", 1);
    void *library = dlopen("libopenblas.so.0", RTLD_NOW | RTLD_LOCAL);
    if (!library)
        blas.missing = "libopenblas.so.0 was not found: install libopenblas0-pthread";
    else if (!find(library, "openblas_get_parallel", &parallel) || parallel() == OPENBLAS_SEQUENTIAL)
        blas.missing = "libopenblas.so.0 is the serial build, which threads cannot share: install libopenblas0-pthread";
    else if (!find(library, "cblas_sgemm", &blas.gemm) || !find(library, "cblas_saxpy", &blas.axpy) ||
             !find(library, "cblas_sdot", &blas.dot) || !find(library, "cblas_sgemv", &blas.gemv) ||
             !find(library, "cblas_ssyrk", &blas.syrk) || !find(library, "ssyevr_", &blas.eigen))
        blas.missing = "libopenblas.so.0 lacks BLAS or LAPACK: install libopenblas0-pthread";
}

int spl_blas_open(struct spl_error *err)
{
    static pthread_once_t once = PTHREAD_ONCE_INIT;
    pthread_once(&once, load);
    return blas.missing ? spl_fail(err, SPL_E_UNSUPPORTED, "coding textures needs OpenBLAS: %s", blas.missing) : 0;
}

void spl_blas_product(size_t rows, size_t columns, size_t depth, const float *a, const float *b, float *out)
{
    if (rows && columns)
        blas.gemm(CblasRowMajor, CblasNoTrans, CblasTrans, (int)rows, (int)columns, (int)depth, 1, a, (int)depth, b,
                  (int)depth, 0, out, (int)columns);
}

void spl_blas_add(size_t count, float factor, const float *x, float *y)
{
    blas.axpy((int)count, factor, x, 1, y, 1);
}

float spl_blas_dot(size_t count, const float *x, const float *y)
{
    return blas.dot((int)count, x, 1, y, 1);
}

void spl_blas_apply(size_t rows, size_t columns, const float *a, const float *x, float *out)
{
    blas.gemv(CblasRowMajor, CblasNoTrans, (int)rows, (int)columns, 1, a, (int)columns, x, 1, 0, out, 1);
}

void spl_blas_apply_transposed(size_t rows, size_t columns, const float *a, const float *x, float *out)
{
    blas.gemv(CblasRowMajor, CblasTrans, (int)rows, (int)columns, 1, a, (int)columns, x, 1, 0, out, 1);
}

void spl_blas_covariance(size_t rows, size_t n, const float *a, float *out)
{
    if (rows)
        blas.syrk(CblasRowMajor, CblasUpper, CblasTrans, (int)n, (int)rows, 1, a, (int)n, 1, out, (int)n);
}

int spl_blas_eigen(size_t n, float *a, size_t wanted, float *values, float *vectors, struct spl_error *err)
{
    int size = (int)n, first = (int)(n - wanted + 1), found = 0, info = 0, ask = -1, integers = 0;
    float none = 0, best = 0;
    /* LAPACK's columns are our rows: the upper triangle becomes its lower one, eigenvectors come as rows. */
    blas.eigen("V", "I", "L", &size, a, &size, &none, &none, &first, &size, &none, &found, values, vectors, &size, NULL,
               &best, &ask, &integers, &ask, &info);
    int work_count = (int)best;
    float *work = spl_alloc_raw((size_t)work_count + SPL_BLAS_PAD, sizeof *work, err);
    int *work_integers = spl_alloc_raw((size_t)integers, sizeof *work_integers, err);
    int *support = spl_alloc_raw(2 * n, sizeof *support, err);
    float *all_values = spl_alloc(n, sizeof *all_values, err);
    int rc = SPL_E_NOMEM;
    if (!work || !work_integers || !support || !all_values)
        goto done;
    blas.eigen("V", "I", "L", &size, a, &size, &none, &none, &first, &size, &none, &found, all_values, vectors, &size,
               support, work, &work_count, work_integers, &integers, &info);
    rc = info || found != (int)wanted
             ? spl_fail(err, SPL_E_INTERNAL, "eigenvectors of %zu × %zu did not converge", n, n)
             : 0;
    if (rc)
        goto done;
    for (size_t i = 0; i < wanted; i++)
        values[i] = all_values[wanted - 1 - i];
    for (size_t i = 0; i < wanted / 2; i++)
        for (size_t k = 0; k < n; k++) {
            float swap = vectors[i * n + k];
            vectors[i * n + k] = vectors[(wanted - 1 - i) * n + k];
            vectors[(wanted - 1 - i) * n + k] = swap;
        }
done:
    free(work);
    free(work_integers);
    free(support);
    free(all_values);
    return rc;
}
