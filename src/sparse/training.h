/* The state of a training, shared by the files that make it: sampling (sample.c), coding (train_code.c), updates of
 * atoms (train_update.c), replacing and dropping them (train_replace.c), the loop (train.c). */
#ifndef SPL_SPARSE_TRAINING_H
#define SPL_SPARSE_TRAINING_H

#include "sparse/pursuit.h"
#include "sparse/train.h"

/* A texture of the batch as it was coded last; weights are not quantised. */
struct spl_sparse_row {
    uint8_t count;
    uint16_t atom[SPL_ATOMS_MAX];
    float weight[SPL_ATOMS_MAX];
    float margin[SPL_ATOMS_MAX]; /* how much less the second best atom would have taken off the squared error */
};

struct spl_training {
    const struct spl_train_settings *settings;
    uint32_t n, m;        /* values of a texture, of its projection */
    uint64_t population;  /* textures of the source */
    size_t sample, batch; /* textures; a batch is updated from at once */
    unsigned threads;

    float *basis; /* [m × n], rows orthonormal: what textures are projected on; NULL: m = n */
    float *y;     /* [sample × m], in random order */
    float *norm;  /* [sample]: squared, of the whole texture */
    float *error; /* [sample]: squared, as coded last */

    uint32_t count;  /* atoms */
    float *atoms;    /* [count × m] */
    float *next;     /* [count × m]: written while atoms are read (section 3.3, implementation notes) */
    float *gram;     /* [count × count]; NULL where it would not fit */
    double *history; /* [count]: sum of squared weights of past batches, forgetting */
    uint64_t *uses;  /* [count], of this epoch */
    double *benefit; /* [count], of this epoch: squared error that the second best atoms would leave more */
    double *power;   /* [count], of this epoch: sum of squared weights */

    struct spl_sparse_row *row; /* [batch] */
    float *residual;            /* [batch × m] */
    uint32_t *user;             /* [batch · atoms]: rows by atom */
    uint32_t *first_user;       /* [dictionary + 1] */

    uint64_t rounds;        /* batches so far */
    double epoch_error;     /* of this epoch */
    uint64_t epoch_weights; /* atoms of all textures, of this epoch */
};

/* Bits that a further atom is taken to cost while training. */
float spl_training_price(const struct spl_training *t);

/* An estimate of the bits of atom a's coefficients. */
double spl_training_atom_bits(const struct spl_training *t, uint32_t a);

/* Squared error at which a texture needs no atom. */
float spl_training_enough(const struct spl_training *t);

/* Plans the memory, reads an even random sample, finds the basis, allocates everything. On failure the caller still
 * calls spl_training_finish. */
int spl_training_init(struct spl_training *t, const struct spl_texture_source *source,
                      const struct spl_train_settings *settings, struct spl_error *err);
void spl_training_finish(struct spl_training *t);

/* Codes the `count` textures from `first` on: row, residual, error, and the epoch's sums. */
int spl_training_code(struct spl_training *t, size_t first, size_t count, struct spl_error *err);

/* Moves the atoms by what was coded last. */
void spl_training_update(struct spl_training *t, size_t count);

/* The first atoms: textures that need one. */
void spl_training_start(struct spl_training *t);

/* Unused atoms and duplicates become textures that are coded worst, or go where none needs an atom. With `drop` they
 * go, and so do atoms that save less than their own bytes, a quarter of all at most. */
int spl_training_replace(struct spl_training *t, bool drop, uint32_t *dropped, struct spl_error *err);

#endif
