/* Coders of splat textures beside each other, on the same textures: how training converges, and bytes against quality,
 * with the paper's own settings and photographs put onto the splats (table 1 and figure 7 of the sparse-coding paper).
 */
#ifndef SPL_MEASURE_TEXTURES_H
#define SPL_MEASURE_TEXTURES_H

#include "dataset/dataset.h"
#include "measure/chart.h"
#include "measure/projected.h"
#include "sparse/train.h"

enum { SPL_TEXTURES_EPOCHS_MAX = 64, SPL_TEXTURES_ROWS_MAX = 24 };

/* What is trained and coded; bits. */
enum spl_textures_runs {
    SPL_TEXTURES_RUN_TRAININGS = 1, /* k-SVD and mini-batches, for their chart */
    SPL_TEXTURES_RUN_D8W4 = 2,
    SPL_TEXTURES_RUN_D12W4 = 4,
    SPL_TEXTURES_RUN_D16W8 = 8,
    SPL_TEXTURES_RUN_ADAPTIVE = 16,
    SPL_TEXTURES_RUN_ALL = 31
};

struct spl_textures_options {
    const struct spl_texture_source *source;
    const struct spl_texture_origin *origin;
    const struct spl_dataset *dataset; /* what was packed: its geometry is charged to every row; may be NULL */
    const struct spl_projected_report *projected; /* rows of photographs; may be NULL */
    uint32_t epochs;                              /* of each training, 1..SPL_TEXTURES_EPOCHS_MAX */
    unsigned runs;                                /* bit per enum spl_textures_runs; 0: what needs none */
    uint64_t sample; /* textures that are trained on at most, others being measured; 0 = all, but 196608 in one round
                        for more than 16384 atoms */
    uint64_t memory_bytes, seed;
    unsigned threads;
    void (*progress)(void *context, const char *what, const struct spl_train_progress *epoch); /* may be NULL */
    void *context;
};

/* Bytes of a splat: its mean colour, or the index of its photograph; its codes; and its share of what all splats look
 * up, which is the dictionary as it is stored, photographs with their mips, or textures with theirs. */
struct spl_textures_row {
    char name[40];
    double color, codes, shared;
    double psnr;                                  /* against the textures, dB; infinite where they are the textures */
    struct spl_projected_figure packed, left_out; /* of frames against photographs; NaN = not measured */
    double atoms;                                 /* a splat with a texture, mean; NaN for what has none */
    double shares[SPL_ATOMS_MAX + 1]; /* splats with a texture by their number of atoms; all 0 for what has none */
    uint32_t count;                   /* atoms of the dictionary */
    uint64_t sample;                  /* textures that were trained on, others measured; 0 = all, both */
    double seconds;                   /* training and coding */
    enum spl_textures_kind {
        SPL_TEXTURES_OTHER,
        SPL_TEXTURES_PHOTOGRAPHS,
        SPL_TEXTURES_PAPER, /* index and weight of fixed width */
        SPL_TEXTURES_OURS,  /* least error + lambda bits */
        SPL_TEXTURES_PACKED /* the dataset itself */
    } kind;
};

struct spl_textures_report {
    struct spl_train_progress ksvd[SPL_TEXTURES_EPOCHS_MAX], batches[SPL_TEXTURES_EPOCHS_MAX];
    uint32_t ksvd_epochs, batches_epochs, dictionary; /* atoms both were trained to */
    double geometry; /* bytes a splat without colour: positions, normals, radii, headers; 0 without a dataset */
    uint64_t splats;
    char left_away[512]; /* the coding that did not fit, and why; "" */
    struct spl_textures_row row[SPL_TEXTURES_ROWS_MAX];
    uint32_t rows;
};

static inline double spl_textures_row_bytes(const struct spl_textures_row *row)
{
    return row->color + row->codes + row->shared;
}

/* Trains and codes all of it; minutes to half an hour. SPL_E_INPUT where the source is empty or its textures are
 * smaller than a block, and what training and coding fail with. Blocks. */
int spl_textures_measure(const struct spl_textures_options *options, struct spl_textures_report *report,
                         struct spl_error *err);

/* Bytes a splat that the adaptive coding needs for `psnr`, mean colour and dictionary with it, between its rows; NaN
 * beyond them. */
double spl_textures_bytes_at(const struct spl_textures_report *report, double psnr);

/* Quality against seconds of training, and against bytes a splat. As spl_chart_write(). */
int spl_textures_chart_training(const struct spl_textures_report *report, char **svg, size_t *length,
                                struct spl_error *err);
int spl_textures_chart_rate(const struct spl_textures_report *report, char **svg, size_t *length,
                            struct spl_error *err);

#endif
