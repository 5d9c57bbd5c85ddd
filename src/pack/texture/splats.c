/* Chunks as lists of world splats. Pages are read through the map of the file, which is the packer's own and not
 * replaced meanwhile. Any thread. */
#include "pack/texture/splats.h"

#include <stdlib.h>

#include "base/memory.h"

int spl_splats_init(struct spl_splats *splats, const struct spl_dataset *dataset, struct spl_error *err)
{
    *splats = (struct spl_splats){.dataset = dataset, .count = spl_dataset_get_info(dataset)->ids};
    uint64_t node_count, chunk_count; /* no more than splats */
    splats->nodes = spl_dataset_get_nodes(dataset, &node_count);
    splats->chunks = spl_dataset_get_chunks(dataset, &chunk_count);
    if (splats->count > UINT32_MAX)
        return spl_fail(err, SPL_E_LIMIT, "%llu splats; photographs are put onto %u at most",
                        (unsigned long long)splats->count, UINT32_MAX);
    splats->node_count = (uint32_t)node_count;
    splats->chunk_count = (uint32_t)chunk_count;
    splats->node_of = spl_alloc(splats->chunk_count, sizeof *splats->node_of, err);
    if (!splats->node_of)
        return SPL_E_NOMEM;
    for (uint32_t n = 0; n < splats->node_count; n++)
        for (uint32_t c = 0; c < splats->nodes[n].chunk_count; c++)
            splats->node_of[splats->nodes[n].first_chunk + c] = n;
    return SPL_OK;
}

void spl_splats_finish(struct spl_splats *splats)
{
    free(splats->node_of);
    *splats = (struct spl_splats){0};
}

uint32_t spl_splats_get(const struct spl_splats *splats, uint32_t chunk, struct spl_world_splat *out)
{
    const struct spl_chunk *header = &splats->chunks[chunk];
    const struct spl_node *node = &splats->nodes[splats->node_of[chunk]];
    size_t bytes;
    const uint32_t *page = spl_dataset_get_page(splats->dataset, node->page, &bytes);
    for (uint32_t i = 0; i < header->count; i++) {
        spl_chunk_decode(header, page, i, &out[i].splat);
        for (int a = 0; a < 3; a++)
            out[i].position[a] = node->origin[a] + (double)out[i].splat.position[a];
    }
    return header->count;
}
