/* A dataset made of another: the same splats with other colours and with textures. What the second pass of packing with
 * photographs writes. */
#ifndef SPL_DATASET_RETEXTURE_H
#define SPL_DATASET_RETEXTURE_H

#include <stdint.h>

#include <jansson.h>

#include "dataset/dataset.h"
#include "sparse/code.h"

struct spl_retexture {
    const struct spl_dataset *from;          /* keeps all its tables; its own textures are dropped */
    const uint8_t (*colors)[3];              /* by splat id, info.splats of them; NULL: those that it has */
    const struct spl_dictionary *dictionary; /* NULL or without atoms: no textures are written */
    /* Sets the codes of chunk `chunk`, whose splats are chunks[chunk].first_id on: called once for each, in rising
     * order, from the calling thread. A return below 0 ends the writing with it. Not called where there is no
     * dictionary. */
    int (*code_chunk)(void *context, uint64_t chunk, struct spl_chunk_code *code, struct spl_error *err);
    void *context;
    const json_t *color_source; /* put before what META's "color" has; NULL = nothing */
    const json_t *textures;     /* META's "textures": settings, statistics; NULL = none */
    size_t page_bytes;          /* of the new file's pages, about; 0 = SPL_PAGE_BYTES */
};

/* Writes `path` (temporary file, sync, rename): geometry and optional attributes are copied bit for bit. Blocks on
 * disk; holds two pages in memory. Errors of the disk, of pages that were overwritten, SPL_E_NOMEM, SPL_E_LIMIT where a
 * node's codes are larger than a page, and those of code_chunk. */
int spl_dataset_retexture(const struct spl_retexture *retexture, const char *path, struct spl_error *err);

#endif
