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

SPL_END_DECLARATIONS

#endif
