/* The splats of a dataset, chunk by chunk, as the photographs see them: in world coordinates, as they decode. Vertices
 * of lines are among them, which take colours as splats do, but no textures. */
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
};

/* Refuses more than UINT32_MAX splats. On failure nothing is held. */
int spl_splats_init(struct spl_splats *splats, const struct spl_dataset *dataset, struct spl_error *err);
void spl_splats_finish(struct spl_splats *splats);

/* A decoded splat and where it is. */
struct spl_world_splat {
    double position[3];
    struct spl_splat splat;
};

/* Decodes chunk `chunk` into out[SPL_CHUNK_SPLATS]; returns how many. Any thread. */
uint32_t spl_splats_get(const struct spl_splats *splats, uint32_t chunk, struct spl_world_splat *out);

#endif
