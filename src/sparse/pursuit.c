/* Products of a block's residuals with all atoms, and their updates. A block is always multiplied whole, so that sums
 * do not depend on how blocks are shared out to threads. */
#include "sparse/pursuit.h"

#include <stdlib.h>
#include <string.h>

#include "base/memory.h"
#include "base/parallel.h"
#include "sparse/blas.h"

enum { gram_rows = 64 };

struct gram_job {
    const struct spl_atoms *atoms;
    float *gram;
};

static void gram_piece(void *context, size_t begin, size_t end, unsigned worker)
{
    const struct gram_job *job = context;
    size_t count = job->atoms->count, n = job->atoms->n;
    (void)worker;
    spl_blas_product(end - begin, count, n, job->atoms->d + begin * n, job->atoms->d, job->gram + begin * count);
}

void spl_atoms_gram(const struct spl_atoms *atoms, float *gram, unsigned threads)
{
    spl_parallel_for(threads, atoms->count, gram_rows, gram_piece, &(struct gram_job){atoms, gram});
}

float spl_atoms_product(const struct spl_atoms *atoms, uint32_t a, uint32_t b)
{
    if (atoms->gram)
        return atoms->gram[(size_t)a * atoms->count + b];
    return spl_blas_dot(atoms->n, atoms->d + (size_t)a * atoms->n, atoms->d + (size_t)b * atoms->n);
}

uint64_t spl_block_bytes(uint32_t count, uint32_t n, bool gram)
{
    return (uint64_t)SPL_BLOCK_TEXTURES * sizeof(float) * (count + (gram ? 0 : (uint64_t)n));
}

int spl_block_init(struct spl_block *block, const struct spl_atoms *atoms, struct spl_error *err)
{
    *block = (struct spl_block){.atoms = atoms};
    block->match = spl_alloc_raw(SPL_BLOCK_TEXTURES * (size_t)atoms->count, sizeof(float), err);
    if (!atoms->gram)
        block->residual = spl_alloc_raw(SPL_BLOCK_TEXTURES * (size_t)atoms->n, sizeof(float), err);
    if (block->match && (atoms->gram || block->residual))
        return 0;
    spl_block_finish(block);
    return SPL_E_NOMEM;
}

void spl_block_finish(struct spl_block *block)
{
    free(block->match);
    free(block->residual);
    *block = (struct spl_block){0};
}

void spl_block_begin(struct spl_block *block, const float *y, uint32_t rows)
{
    const struct spl_atoms *atoms = block->atoms;
    block->rows = rows;
    spl_blas_product(rows, atoms->count, atoms->n, y, atoms->d, block->match);
    if (block->residual)
        memcpy(block->residual, y, (size_t)rows * atoms->n * sizeof(float));
}

void spl_block_move(struct spl_block *block, uint32_t row, uint32_t atom, float change)
{
    const struct spl_atoms *a = block->atoms;
    if (block->residual)
        spl_blas_add(a->n, -change, a->d + (size_t)atom * a->n, block->residual + (size_t)row * a->n);
    else
        spl_blas_add(a->count, -change, a->gram + (size_t)atom * a->count, block->match + (size_t)row * a->count);
}

void spl_block_step(struct spl_block *block)
{
    const struct spl_atoms *a = block->atoms;
    if (block->residual)
        spl_blas_product(block->rows, a->count, a->n, block->residual, a->d, block->match);
}

/* Magnitudes of floats order as their bits do, and integer maxima vectorise. */
static int32_t magnitude(float value)
{
    int32_t bits;
    memcpy(&bits, &value, sizeof bits);
    return bits & INT32_MAX;
}

/* Of at least one. */
static int32_t largest_of(const float *values, uint32_t count)
{
    int32_t largest = 0;
    for (uint32_t i = 0; i < count; i++) {
        int32_t m = magnitude(values[i]);
        largest = m > largest ? m : largest;
    }
    return largest;
}

static uint32_t run_length(uint32_t first, uint32_t end)
{
    return end - first < SPL_PURSUIT_RUN ? end - first : SPL_PURSUIT_RUN;
}

uint32_t spl_largest_magnitudes(const float *values, uint32_t count, float largest[])
{
    uint32_t runs = 0;
    for (uint32_t first = 0; first < count; first += SPL_PURSUIT_RUN, runs++) {
        int32_t bits = largest_of(values + first, run_length(first, count));
        memcpy(&largest[runs], &bits, sizeof bits);
    }
    return runs;
}

uint32_t spl_block_best(const struct spl_block *block, uint32_t row, uint32_t begin, uint32_t end)
{
    const float *match = block->match + (size_t)row * block->atoms->count;
    int32_t best = -1;
    uint32_t at = begin;
    for (uint32_t first = begin; first < end; first += SPL_PURSUIT_RUN) {
        int32_t largest = largest_of(match + first, run_length(first, end));
        if (largest > best) {
            best = largest;
            at = first;
        }
    }
    while (magnitude(match[at]) != best)
        at++;
    return at;
}

uint32_t spl_block_best_two(const struct spl_block *block, uint32_t row, float *second)
{
    const uint32_t count = block->atoms->count;
    const float *match = block->match + (size_t)row * count;
    int32_t best = -1, next = 0;
    uint32_t run = 0;
    for (uint32_t first = 0; first < count; first += SPL_PURSUIT_RUN) {
        int32_t largest = largest_of(match + first, run_length(first, count));
        int32_t less = largest > best ? best : largest;
        next = less > next ? less : next;
        run = largest > best ? first : run;
        best = largest > best ? largest : best;
    }
    uint32_t at = run;
    while (magnitude(match[at]) != best)
        at++;
    for (uint32_t k = run; k < run + run_length(run, count); k++)
        if (k != at && magnitude(match[k]) > next)
            next = magnitude(match[k]);
    memcpy(second, &next, sizeof next);
    return at;
}
