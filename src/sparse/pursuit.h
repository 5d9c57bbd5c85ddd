/* What training and coding share: how well every atom matches each residual of a block of textures, kept up to date as
 * atoms are taken. With a Gram matrix a step costs one of its rows (batch-OMP); without one, where it would not fit,
 * the block's residuals are kept and multiplied with all atoms anew. */
#ifndef SPL_SPARSE_PURSUIT_H
#define SPL_SPARSE_PURSUIT_H

#include <stddef.h>
#include <stdint.h>

#include "base/error.h"

enum { SPL_BLOCK_TEXTURES = 128, SPL_PURSUIT_RUN = 64 };

/* Atoms of norm 1, one a row. */
struct spl_atoms {
    uint32_t count, n;
    const float *d;    /* [count × n] */
    const float *gram; /* [count × count]; may be NULL */
};

/* One thread's scratch. */
struct spl_block {
    const struct spl_atoms *atoms;
    uint32_t rows;   /* textures, at most SPL_BLOCK_TEXTURES */
    float *match;    /* [rows × count]: residual · atom */
    float *residual; /* [rows × n]; NULL where there is a Gram matrix */
};

/* gram[count × count] = d · dᵀ, by all `threads`. */
void spl_atoms_gram(const struct spl_atoms *atoms, float *gram, unsigned threads);

float spl_atoms_product(const struct spl_atoms *atoms, uint32_t a, uint32_t b);

/* Scratch for blocks over atoms of this count and size; what it takes, in bytes, beside it. SPL_E_NOMEM. */
int spl_block_init(struct spl_block *block, const struct spl_atoms *atoms, struct spl_error *err);
uint64_t spl_block_bytes(uint32_t count, uint32_t n, bool gram);
void spl_block_finish(struct spl_block *block);

/* Starts with `rows` textures y[rows × n], means removed. */
void spl_block_begin(struct spl_block *block, const float *y, uint32_t rows);

/* The residual of `row` loses change · atom. spl_block_step makes `match` current after moves (nothing to do with a
 * Gram matrix). */
void spl_block_move(struct spl_block *block, uint32_t row, uint32_t atom, float change);
void spl_block_step(struct spl_block *block);

/* The largest magnitude of each run of SPL_PURSUIT_RUN of values[count], the last one shorter; returns how many. */
uint32_t spl_largest_magnitudes(const float *values, uint32_t count, float largest[]);

/* The atom in [begin, end) whose match has the largest magnitude; the first of equals. begin < end. */
uint32_t spl_block_best(const struct spl_block *block, uint32_t row, uint32_t begin, uint32_t end);

/* The same of all atoms, and the largest magnitude of the others; 0 where there are none. */
uint32_t spl_block_best_two(const struct spl_block *block, uint32_t row, float *second);

#endif
