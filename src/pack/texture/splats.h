/* The splats of a dataset, chunk by chunk, as the photographs see them: in world coordinates, as they decode. Vertices
 * of lines are among them, which take colours as splats do, but no textures; so are the cells of panels, where they are
 * asked for, each as the disc that it stands for: panels then have no splats of their own, and their cells are chunks
 * behind those of the dataset, with ids behind its own. */
#ifndef SPL_PACK_TEXTURE_SPLATS_H
#define SPL_PACK_TEXTURE_SPLATS_H

#include "dataset/chunk.h"
#include "dataset/dataset.h"
#include "pack/stage.h"

struct spl_splats {
    const struct spl_dataset *dataset; // borrowed
    const struct spl_node *nodes;
    const struct spl_chunk *chunks;
    uint32_t *node_of; /* by chunk; owned */
    uint32_t node_count, chunk_count;
    uint64_t count; /* ids are below it */

    struct spl_chunk *own_chunks; /* with cells what `chunks` is; else NULL. Owned, as the rest */
    struct spl_cells_part *parts; /* of the chunks from chunks_before on: what they are */
    uint64_t *first_cell;         /* by chunk of the dataset, of panels: id of its first cell */
    uint32_t chunks_before;       /* of the dataset */
};

/* Cells of a panel, row by row: as many as a chunk has splats. */
struct spl_cells_part {
    uint32_t chunk;       /* of the dataset */
    uint8_t panel, first; /* cell among those that are there */
};

/* Refuses more than UINT32_MAX splats. On failure nothing is held. */
int spl_splats_init(struct spl_splats *splats, const struct spl_dataset *dataset, struct spl_error *err);

/* The same with cells of panels. */
int spl_splats_init_with_cells(struct spl_splats *splats, const struct spl_dataset *dataset, struct spl_error *err);
void spl_splats_finish(struct spl_splats *splats);

/* A decoded splat and where it is. */
struct spl_world_splat {
    double position[3];
    struct spl_splat splat;
};

/* Decodes chunk `chunk` into out[SPL_CHUNK_SPLATS]; returns how many. Any thread. */
uint32_t spl_splats_get(const struct spl_splats *splats, uint32_t chunk, struct spl_world_splat *out);

#endif
