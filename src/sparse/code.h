/* Textures as sums of few atoms: what is stored of a chunk of splats, and the pursuit that finds it.
 *
 * Orthogonal matching pursuit on the Gram matrix (batch-OMP, Rubinstein et al. 2008) instead of the paper's k-d tree:
 * after one product of all textures with all atoms a step costs one row of the Gram matrix a splat. Weights are
 * quantised inside the pursuit (section 3.4 of the paper): the next atom sees the quantised residual. */
#ifndef SPL_SPARSE_CODE_H
#define SPL_SPARSE_CODE_H

#include <stdint.h>

#include "shared.h" /* SPL_CHUNK_SPLATS */
#include "sparse/dictionary.h"

#define SPL_ATOMS_MAX 8

/* The grid of weights of the t-th atom of a chunk's splats: weight = step · (code + 0.5 ± gap), code signed and
 * weight_bits wide, -2^(weight_bits-1) .. 2^(weight_bits-1) - 1, the gap away from zero: an atom that weighs little is
 * not taken, so no code is wasted on it. index_bits may be 0 (all use atom 0). */
struct spl_code_plane {
    float step, gap;     /* what spl_code_step and spl_code_gap give for these codes */
    uint8_t step_code;   /* 0..63 */
    uint8_t gap_code;    /* 0..3 */
    uint8_t index_bits;  /* 0..16 */
    uint8_t weight_bits; /* 1..8 */
};

/* A splat's atoms in the order of the pursuit: any prefix is a coarser texture. atom[t] < 2^index_bits of plane t. */
struct spl_splat_code {
    uint8_t count; /* 0..SPL_ATOMS_MAX; a splat that needs no atom has none */
    uint16_t atom[SPL_ATOMS_MAX];
    int16_t weight[SPL_ATOMS_MAX]; /* codes */
};

/* Plane t holds the t-th atom of every splat that has more than t; planes = the largest count of the chunk's splats. */
struct spl_chunk_code {
    uint32_t splats; /* 1..SPL_CHUNK_SPLATS */
    uint32_t planes; /* 0..SPL_ATOMS_MAX */
    struct spl_code_plane plane[SPL_ATOMS_MAX];
    struct spl_splat_code splat[SPL_CHUNK_SPLATS];
};

/* What a chunk with any plane costs beside its planes' headers, masks and codes: its word in the head of its page. */
#define SPL_CODE_CHUNK_BITS 32

enum { SPL_CODE_STEPS = 64, SPL_CODE_GAPS = 4 };

/* step = 2^((step_code - 56) / 4): 6·10⁻⁵ (code 0) to 3.4 (63), in steps of 19 %, in the units of dictionary.h;
 * gap = 0, 0.5, 1.5, 3. */
float spl_code_step(uint8_t step_code);

static inline float spl_code_gap(uint8_t gap_code)
{
    return 0.25f * (float)(gap_code * (gap_code + 1));
}

static inline float spl_code_weight(const struct spl_code_plane *plane, int16_t weight)
{
    return plane->step * ((float)weight + 0.5f + (weight < 0 ? -plane->gap : plane->gap));
}

/* Bits of `code` as it is stored: SPL_CODE_CHUNK_BITS, and, up to a whole word, per plane SPL_TEXTURE_HEADER_BITS, a
 * bit for each splat that has the plane before (the first: SPL_CHUNK_SPLATS) and index_bits + weight_bits for each that
 * has it; 0 without planes. */
uint64_t spl_chunk_code_bits(const struct spl_chunk_code *code);

struct spl_code_settings {
    uint32_t atoms;       /* a splat's at most, 0..SPL_ATOMS_MAX */
    float psnr;           /* dB: a splat takes no further atom once it is this good; 0: no such stop */
    float lambda;         /* > 0: an atom must lower the splat's squared error (sum over its n values) by more
                             than lambda · its bits, and widths are chosen for the smallest error + lambda · bits; 0:
                             the paper's coding, every plane weight_bits and the dictionary's full index width */
    uint32_t weight_bits; /* 1..8; with lambda the widest that is tried */
};

/* Sums over splats; PSNR = -10 log10(squared_error / values). Add up those of several calls. */
struct spl_code_sums {
    double squared_error;                  /* against the textures, mean colours rounded to bytes */
    double plain_error;                    /* the same without any atom */
    uint64_t values;                       /* n · splats that have a texture */
    uint64_t splats;                       /* that have a texture */
    uint64_t bits;                         /* spl_chunk_code_bits */
    uint64_t histogram[SPL_ATOMS_MAX + 1]; /* splats with a texture, by count of atoms */
};

/* A dictionary made ready for pursuit: its atoms as floats, their Gram matrix (4·count² bytes; one row at a time from
 * the atoms where that is more than 1/2 of `memory_bytes`). Borrows nothing. Shared read-only by any number of threads.
 * NULL: SPL_E_USAGE (settings, a non-finite scale), SPL_E_LIMIT (does not fit into memory_bytes), SPL_E_NOMEM. */
struct spl_coder *spl_coder_create(const struct spl_dictionary *dictionary, const struct spl_code_settings *settings,
                                   uint64_t memory_bytes, unsigned threads, struct spl_error *err);
void spl_coder_destroy(struct spl_coder *coder);

/* Changes settings->lambda, which was and stays > 0. Nobody may be coding. */
void spl_coder_set_lambda(struct spl_coder *coder, float lambda);

/* Codes the `splats` (1..SPL_CHUNK_SPLATS) textures of a chunk. texture[i]: n bytes, or NULL for a splat without, which
 * gets no atom. mean[i] receives the texture's mean colour, rounded: the splat's colour is to be set to it; untouched
 * where there is no texture. `sums` is added to. Pure: the same input gives the same codes on the same kind of
 * processor. Any thread, one chunk a call; takes some megabytes of scratch for its time. SPL_E_NOMEM, SPL_E_USAGE. */
int spl_coder_code(const struct spl_coder *coder, const uint8_t *const *texture, uint32_t splats, uint8_t (*mean)[3],
                   struct spl_chunk_code *out, struct spl_code_sums *sums, struct spl_error *err);

/* out[n] = colour + the first `atoms` of `splat`'s atoms, not clamped, 0..1 being black to white: what a decoder must
 * give. `planes` are those of the splat's chunk. Indices must be < dictionary->count. */
void spl_code_decode(const struct spl_dictionary *dictionary, const struct spl_code_plane *planes,
                     const struct spl_splat_code *splat, uint32_t atoms, const float colour[3], float *out);

#endif
