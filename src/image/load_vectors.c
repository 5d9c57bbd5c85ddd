/* Vectors of three from NPY. The file must be as long as its header says before anything is allocated. Any thread. */
#include <stdlib.h>
#include <string.h>

#include "base/memory.h"
#include "image/decode.h"
#include "image/vectors.h"

enum { piece = 3 * 1024 }; /* numbers that are read at a time */

static int fail(const char *name, const char *what, struct spl_error *err)
{
    return spl_fail(err, SPL_E_INPUT, "%s: NPY: %s", name, what);
}

/* Shape, kind and order of the numbers; the file is left at the first. */
static int read_form(FILE *file, uint64_t bytes, const char *name, size_t most, size_t *count, size_t *size,
                     bool *by_columns, struct spl_error *err)
{
    char header[SPL_NPY_HEADER_MAX];
    uint64_t shape[SPL_NPY_SHAPE_MAX];
    int rc = spl_npy_read_header(file, name, header, err);
    if (rc)
        return rc;
    const char *descr = spl_npy_find(header, "'descr'"), *order = spl_npy_find(header, "'fortran_order'");
    *size = descr && !strncmp(descr, "'<f4'", 5) ? 4 : descr && !strncmp(descr, "'<f8'", 5) ? 8 : 0;
    *by_columns = order && !strncmp(order, "True", 4);
    if (!*size)
        return fail(name, "its numbers must be '<f4' or '<f8', float32 or float64", err);
    if (!*by_columns && (!order || strncmp(order, "False", 5)))
        return fail(name, "fortran_order is missing", err);
    if (spl_npy_parse_shape(spl_npy_find(header, "'shape'"), shape) != 2 || shape[1] != 3)
        return fail(name, "its shape must be (count, 3)", err);
    const long start = ftell(file);
    if (!shape[0] || shape[0] > most)
        return spl_fail(err, SPL_E_INPUT, "%s: NPY: it has %llu rows; 1 to %zu are taken", name,
                        (unsigned long long)shape[0], most);
    if (start < 0 || bytes < (uint64_t)start || bytes - (uint64_t)start != shape[0] * 3 * *size)
        return spl_fail(err, SPL_E_INPUT,
                        "%s: NPY: %llu bytes are there, %llu rows of 3 numbers and the header need %llu", name,
                        (unsigned long long)bytes, (unsigned long long)shape[0],
                        (unsigned long long)((start < 0 ? 0 : (uint64_t)start) + shape[0] * 3 * *size));
    *count = (size_t)shape[0];
    return SPL_OK;
}

static double number_at(const unsigned char *raw, size_t size)
{
    float small;
    double number;
    memcpy(size == 4 ? (void *)&small : (void *)&number, raw, size);
    return size == 4 ? (double)small : number;
}

int spl_vectors_load_npy(FILE *file, uint64_t bytes, const char *name, size_t most, double **out, size_t *count,
                         struct spl_error *err)
{
    unsigned char raw[8 * piece];
    size_t size, rows = 0;
    bool by_columns;
    *out = NULL;
    int rc = read_form(file, bytes, name, most, &rows, &size, &by_columns, err);
    if (rc)
        return rc;
    double *vectors = spl_alloc_raw(3 * rows, sizeof *vectors, err);
    if (!vectors)
        return SPL_E_NOMEM;
    for (size_t at = 0; at < 3 * rows;) {
        const size_t wanted = 3 * rows - at < piece ? 3 * rows - at : piece;
        if (fread(raw, size, wanted, file) != wanted) {
            free(vectors);
            return fail(name, "cut off", err);
        }
        for (size_t i = 0; i < wanted; i++, at++)
            vectors[by_columns ? at % rows * 3 + at / rows : at] = number_at(raw + size * i, size);
    }
    *out = vectors;
    *count = rows;
    return SPL_OK;
}
