/* Learning a dictionary from a dataset's textures.
 *
 * Two ways to the same end, so that one chart can show both: k-SVD as in the paper (Aharon et al. 2006; power
 * iterations instead of the SVD, all textures every round), and mini-batches (online dictionary learning, Mairal et al.
 * 2009: sums of x·xᵀ and y·xᵀ that forget, block coordinate descent on the atoms), which reaches its quality in
 * minutes. Atoms start as textures of the data; unused and duplicate ones are replaced by what is coded worst. */
#ifndef SPL_SPARSE_TRAIN_H
#define SPL_SPARSE_TRAIN_H

#include "sparse/code.h"

/* Where textures come from; they need not fit into memory. */
struct spl_texture_source {
    uint64_t count;
    uint32_t size;
    /* Reads `count` textures from `first` on (n bytes each, see dictionary.h) to `out`; 0 or negative with `err`.
     * Called by one thread at a time, in rising order of `first` within an epoch. */
    int (*read)(void *context, uint64_t first, uint32_t count, uint8_t *out, struct spl_error *err);
    void *context;
};

enum spl_train_method { SPL_TRAIN_BATCHES, SPL_TRAIN_KSVD };

struct spl_train_settings {
    enum spl_train_method method;
    uint32_t dictionary; /* atoms at most, 1..SPL_DICTIONARY_MAX; fewer where the data do not earn them: with lambda an
                            atom must save more than its own bytes */
    uint32_t atoms;      /* a texture's at most, 1..SPL_ATOMS_MAX */
    float psnr;          /* dB at which a texture needs no further atom, as in spl_code_settings; 0: none */
    float lambda;        /* as in spl_code_settings; counts the dictionary's bytes too */
    uint32_t epochs;     /* rounds at most; 0: until an epoch gains less than 0.02 dB */
    double seconds;      /* no epoch is begun that would end later than this; 0: no limit */
    uint64_t sample;     /* textures that are trained on at most; 0: as many as memory_bytes hold */
    uint64_t seed;
    /* After each batch, by the calling thread: so many more textures were coded. May be NULL; gets the report's
     * context. */
    void (*advance)(void *context, uint64_t textures);
    uint64_t
        memory_bytes; /* of everything that training holds; the sample of textures is cut to fit: an even random one */
    unsigned threads; /* 0: all cores */
};

/* One line of the chart of quality against time. */
struct spl_train_progress {
    uint32_t epoch;         /* from 1 */
    double seconds;         /* since the start, reading included */
    double psnr;            /* of the sample as it is coded at this epoch (weights not yet quantised), dB */
    double atoms_per_splat; /* mean */
    uint32_t dictionary;    /* atoms */
    uint64_t sample;        /* textures that are trained on */
};

/* Called after each epoch by the calling thread; false ends training with SPL_E_CANCELLED. May be NULL. */
typedef bool spl_train_report(void *context, const struct spl_train_progress *progress);

/* Trains; `out` (zeroed) is filled and finished by the caller with spl_dictionary_finish, zeroed on failure. No
 * textures, or none that needs an atom, give a dictionary of none. The same seed, data and settings (but threads and
 * memory that suffices, and without a limit of seconds) give the same bytes on the same kind of processor. Blocks.
 * SPL_E_USAGE (settings, naming the field), SPL_E_LIMIT (memory_bytes is too small for any training, with both
 * numbers), SPL_E_NOMEM, the source's own. */
int spl_dictionary_train(const struct spl_texture_source *source, const struct spl_train_settings *settings,
                         spl_train_report *report, void *context, struct spl_dictionary *out, struct spl_error *err);

#endif
