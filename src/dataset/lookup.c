/* One splat, or vertex of a line, by its id: which chunk and node hold it; and the linear splats of all leaves. Chunks
 * continue each other's ids, so a binary search finds the chunk; nodes are looked through. Words are read from the
 * file, not through a map, so that a file that was cut short in place is no SIGBUS. Any thread. */
#include "dataset/dataset.h"

#include "dataset/chunk.h"
#include "dataset/open.h"

static const struct spl_node *node_of(const struct spl_dataset *dataset, uint64_t chunk)
{
    uint64_t count = 0;
    const struct spl_node *nodes = spl_dataset_get_nodes(dataset, &count);
    for (uint64_t i = 0; i < count; i++)
        if (chunk - nodes[i].first_chunk < nodes[i].chunk_count) // wraps where it lies before
            return &nodes[i];
    return NULL;
}

static bool chunk_of(const struct spl_dataset *dataset, uint64_t id, uint64_t *index)
{
    uint64_t count = 0, low = 0;
    const struct spl_chunk *chunks = spl_dataset_get_chunks(dataset, &count);
    for (uint64_t high = count; low < high;) {
        uint64_t middle = *index = low + (high - low) / 2;
        if (id - chunks[middle].first_id < chunks[middle].count)
            return true;
        if (id < chunks[middle].first_id)
            high = middle;
        else
            low = middle + 1;
    }
    return false;
}

const struct spl_node *spl_dataset_find_chunk(const struct spl_dataset *dataset, uint64_t id, uint64_t *chunk)
{
    return chunk_of(dataset, id, chunk) ? node_of(dataset, *chunk) : NULL;
}

bool spl_dataset_find_splat(const struct spl_dataset *dataset, uint64_t id, struct spl_splat *splat)
{
    uint32_t words[SPL_CHUNK_WORDS_MAX + SPL_PAGE_TAIL_WORDS];
    uint64_t index = 0;
    const struct spl_node *node = spl_dataset_find_chunk(dataset, id, &index);
    if (!node)
        return false;
    struct spl_chunk chunk = dataset->chunks[index];
    uint32_t count = spl_chunk_words(&chunk) + SPL_PAGE_TAIL_WORDS; // opening has checked that the page has them
    spl_assert(count <= sizeof words / sizeof *words);
    uint64_t offset = dataset->pages[node->page]->offset + (uint64_t)chunk.geometry_word * sizeof *words;
    if (spl_dataset_read(dataset, offset, words, count * sizeof *words, NULL))
        return false;
    chunk.geometry_word = 0;
    spl_chunk_decode(&chunk, words, (uint32_t)(id - chunk.first_id), splat);
    return true;
}

int spl_dataset_count_linear(const struct spl_dataset *dataset, uint64_t *linear, struct spl_error *err)
{
    for (uint64_t n = 0; n < dataset->info.nodes; n++) {
        const struct spl_node *node = &dataset->nodes[n];
        for (uint32_t c = 0; c < node->chunk_count && !node->child_count; c++) {
            const struct spl_chunk *chunk = &dataset->chunks[node->first_chunk + c];
            uint32_t mask[SPL_LINEAR_WORDS];
            if (!(chunk->geometry_bits >> SPL_GEOMETRY_LINEAR) || spl_chunk_kind(chunk) != SPL_CHUNK_DISCS)
                continue;
            if (chunk->geometry_bits >> SPL_GEOMETRY_LINEAR == SPL_LINEAR_SOME) {
                uint64_t word = spl_chunk_color_word(chunk) - SPL_LINEAR_WORDS; // which the page has, as opening saw
                int rc = spl_dataset_read(dataset, dataset->pages[node->page]->offset + word * sizeof *mask, mask,
                                          sizeof mask, err);
                if (rc)
                    return rc;
            }
            *linear += spl_chunk_count_linear(chunk, mask);
        }
    }
    return SPL_OK;
}
