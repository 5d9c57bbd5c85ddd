/* Datasets of tiles as one: a city out of squares that were packed each on its own. */
#ifndef SPLATD_COLLECT_H
#define SPLATD_COLLECT_H

#include <stddef.h>

#include <splatd/api.h>
#include <splatd/cancel.h>
#include <splatd/error.h>
#include <splatd/pack.h>

SPL_BEGIN_DECLARATIONS

enum { SPL_COLLECT_TILES_MAX = 10000 };

struct spl_collect_options {
    size_t size;               /* spl_collect_options_init() */
    const char *const *inputs; /* datasets; folders, for all in them but collections; @NAME, a list of paths */
    size_t input_count;
    const char *output;      /* NAME.spld, in the folder of the datasets */
    const char *title;       /* as of struct spl_pack_options */
    const char *description; /* likewise */
    unsigned threads;        /* 0 = all cores */
    void (*progress)(void *context, const struct spl_progress *progress); /* may be NULL */
    void *progress_context;  /* of both */
    const struct spl_cancel *cancel; // may be NULL; the old file, or none, is left
    /* Each collection in a folder, which is no tile: the others are collected without it. May be NULL. */
    void (*left_out)(void *context, const struct spl_error *why);
    const struct spl_saved_view *default_view; /* this and the next as of struct spl_pack_options */
    const struct spl_saved_view *views;
    size_t view_count;
};

static inline void spl_collect_options_init(struct spl_collect_options *options)
{
    spl_sized_init(options, sizeof *options);
}

/* Writes `options->output` (temporary file, sync, rename), a dataset of the coarse levels of all tiles together, which
 * names them: the tiles stay where they are, hold all that is finer, and must not change afterwards. Of each tile the
 * root is read, and one is open at a time. What is written depends on the tiles alone, not on their order or on
 * threads. Tiles lie in the output's folder, have no textures and no maps of stations, and agree in unit, coordinate
 * system, up, surface and attributes. Blocks; about 100 bytes of memory a splat of the tiles' roots. SPL_E_USAGE of
 * options; SPL_E_INPUT of tiles that cannot be one dataset, SPL_E_LIMIT of too many, and what opening one says; field
 * "inputs". Any thread. */
SPL_API int spl_collect(const struct spl_collect_options *options, struct spl_error *err);

struct spl_merge_options {
    size_t size;            /* spl_merge_options_init() */
    const char *collection; /* a file, whose tiles lie beside it, or the URL of one */
    const char *output;     /* NAME.spld, in any folder; none of the tiles */
    unsigned threads;       /* 0 = all cores */
    void (*progress)(void *context, const struct spl_progress *progress); /* may be NULL */
    void *progress_context;
    const struct spl_cancel *cancel; // may be NULL; the old file, or none, is left
};

static inline void spl_merge_options_init(struct spl_merge_options *options)
{
    spl_sized_init(options, sizeof *options);
}

/* Writes `options->output` (temporary file, sync, rename), one dataset of what a collection and all of its tiles hold,
 * which needs neither of them any more: its splats are theirs bit for bit, at every level. What is written depends on
 * these files alone. Blocks; takes about 72 bytes of memory a chunk (of up to 128 splats) and three pages, and as much
 * room on disk as the tiles. Nothing is written where the file could not be opened. SPL_E_USAGE of options, of an
 * output that is read; SPL_E_INPUT of a dataset that is no collection; of a tile that is
 * missing, another one or damaged what opening and reading says, with its name. Any thread. */
SPL_API int spl_merge(const struct spl_merge_options *options, struct spl_error *err);

SPL_END_DECLARATIONS

#endif
