/* One splat by its id: which chunk and node hold it. Chunks continue each other's ids, which opening has checked, so a
 * binary search finds the chunk; nodes are looked through. Any thread. */
#include "dataset/dataset.h"

#include "dataset/chunk.h"

static const struct spl_node *node_of(const struct spl_dataset *dataset, uint32_t chunk)
{
    uint32_t count = 0;
    const struct spl_node *nodes = spl_dataset_get_nodes(dataset, &count);
    for (uint32_t i = 0; i < count; i++)
        if (chunk - nodes[i].first_chunk < nodes[i].chunk_count) // wraps where it lies before
            return &nodes[i];
    return NULL;
}

bool spl_dataset_find_splat(const struct spl_dataset *dataset, uint32_t id, struct spl_splat *splat)
{
    uint32_t count = 0, low = 0;
    const struct spl_chunk *chunks = spl_dataset_get_chunks(dataset, &count);
    for (uint32_t high = count; low < high;) {
        uint32_t middle = low + (high - low) / 2;
        if (id - chunks[middle].first_id < chunks[middle].count) {
            const struct spl_node *node = node_of(dataset, middle);
            size_t bytes;
            if (node)
                spl_chunk_decode(&chunks[middle], spl_dataset_get_page(dataset, node->page, &bytes),
                                 id - chunks[middle].first_id, splat);
            return node != NULL;
        }
        if (id < chunks[middle].first_id)
            high = middle;
        else
            low = middle + 1;
    }
    return false;
}
