/* Coders of splat textures beside each other, on the same textures: how training converges, and bytes against quality,
 * with the paper's own settings and block-compressed photographs (table 1 and figure 7 of the sparse-coding paper). */
#ifndef SPL_MEASURE_TEXTURES_H
#define SPL_MEASURE_TEXTURES_H

#include "measure/chart.h"
#include "sparse/train.h"

enum { SPL_TEXTURES_EPOCHS_MAX = 64, SPL_TEXTURES_ROWS_MAX = 24 };

struct spl_textures_options {
    const struct spl_texture_source *source;
    uint64_t splats; /* of the dataset: bytes are told of each */
    uint64_t pixels; /* of its photographs; 0 = unknown: no rows of photographs */
    uint32_t epochs; /* of each training, 1..SPL_TEXTURES_EPOCHS_MAX */
    uint64_t memory_bytes, seed;
    unsigned threads;
    void (*progress)(void *context, const char *what, const struct spl_train_progress *epoch); /* may be NULL */
    void *context;
};

struct spl_textures_row {
    char name[40];
    double codes, dictionary; /* bytes a splat; codes: of photographs, the pixels with their mips */
    double psnr;              /* against the textures, dB; infinite where they are the textures */
    double atoms;             /* a splat with a texture, mean; NaN for what has none */
    uint32_t count;           /* atoms of the dictionary */
    double seconds;           /* training and coding */
    bool paper;               /* the paper's coding: index and weight of fixed width */
};

struct spl_textures_report {
    struct spl_train_progress ksvd[SPL_TEXTURES_EPOCHS_MAX], batches[SPL_TEXTURES_EPOCHS_MAX];
    uint32_t ksvd_epochs, batches_epochs, dictionary; /* atoms both were trained to */
    struct spl_textures_row row[SPL_TEXTURES_ROWS_MAX];
    uint32_t rows, first_adaptive, adaptives; /* row[first_adaptive ..]: least error + lambda · bits, rising quality */
};

/* Trains and codes all of it; minutes to half an hour. SPL_E_INPUT where the source is empty or its textures are
 * smaller than a block, and what training and coding fail with. Blocks. */
int spl_textures_measure(const struct spl_textures_options *options, struct spl_textures_report *report,
                         struct spl_error *err);

/* Bytes a splat that the adaptive coding needs for `psnr`, between its rows; NaN beyond them. */
double spl_textures_bytes_at(const struct spl_textures_report *report, double psnr);

/* Quality against seconds of training, and against bytes a splat. As spl_chart_write(). */
int spl_textures_chart_training(const struct spl_textures_report *report, char **svg, size_t *length,
                                struct spl_error *err);
int spl_textures_chart_rate(const struct spl_textures_report *report, char **svg, size_t *length,
                            struct spl_error *err);

#endif
