/* A dataset made of another: its splats, or fewer of them, with other colours, textures or maps of stations. What the
 * later passes of packing write. What is not said anew stays as it is. */
#ifndef SPL_DATASET_REWRITE_H
#define SPL_DATASET_REWRITE_H

#include <stdbool.h>
#include <stdint.h>

#include <jansson.h>

#include "dataset/dataset.h"
#include "sparse/code.h"

struct spl_rewrite {
    const struct spl_dataset *from;          /* keeps all its tables; ids, nodes and chunks below are its own */
    const uint8_t (*colors)[3];              /* by splat id, info.ids of them; NULL: those that it has */
    const uint64_t *first_cell; /* by chunk, of panels: where the colours of their cells begin in `colors`, panel by
                                 * panel and row by row. NULL: there are no panels, or no colours */
    const struct spl_dictionary *dictionary; /* NULL: the textures that it has; one without atoms: none */
    /* Sets the codes of chunk `chunk`, whose splats are chunks[chunk].first_id on: called once for each that stays, in
     * rising order, from the calling thread. A return below 0 ends the writing with it. Not called without
     * dictionary. */
    int (*code_chunk)(void *context, uint64_t chunk, struct spl_chunk_code *code, struct spl_error *err);
    void *context;              /* of code_chunk and get_map */
    const json_t *color_source; /* put before what META's "color" has; NULL = nothing */
    const json_t *textures;     /* META's "textures", of the dictionary: settings, statistics; NULL = none */
    size_t page_bytes;          /* of the new file's pages, about; 0 = SPL_PAGE_BYTES */

    const struct spl_map_row *maps; /* NULL: the maps that it has; a pointer with map_count 0: none */
    uint32_t map_count;
    const struct spl_chunk_stations *stations; /* by chunk: as of `maps` */
    /* Lends the words of map `index`, spl_map_words() of its row, until it is called again or the writing ends: called
     * once for each, in rising order, after the last code_chunk. A return below 0 ends the writing with it. */
    int (*get_map)(void *context, uint32_t index, const uint32_t **words, struct spl_error *err);
    const json_t *about_maps; /* META's "maps": settings, statistics; NULL = none */

    /* By node: its children are dropped with all below them, so that its splats are the finest there are, and its
     * panels stand for as many points as spl_panels_count_discs() says; NULL = none. Nodes, chunks and ids of the new
     * file are numbered without what is dropped. META then says "pruned", its radius is that of the new leaves; bounds
     * and view stay those of the scan. */
    const bool *leaf;
    float leaf_radius; /* radii of those nodes' discs are multiplied by it, what selection takes for their spacing is
                        * not; 0 = 1 */
};

/* Writes `path` (temporary file, sync, rename): geometry and optional attributes are copied bit for bit. Blocks on
 * disk; holds two pages and a map in memory. Errors of the disk, of pages that were overwritten, SPL_E_NOMEM,
 * SPL_E_LIMIT where a node's codes are larger than a page or a map is none that a file can have, SPL_E_INPUT where no
 * splat would be left, and those of code_chunk and get_map. */
int spl_dataset_rewrite(const struct spl_rewrite *rewrite, const char *path, struct spl_error *err);

#endif
