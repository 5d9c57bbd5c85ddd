/* An honest dataset of one node, whose chunks are given other radii and written anew. */
#include "support/make_knot.h"

#include <math.h>
#include <stdint.h>
#include <stdlib.h>

#include "base/error.h"
#include "dataset/chunk.h"
#include "dataset/dataset.h"
#include "dataset/writer.h"
#include "support/make_dataset.h"

enum { forged_every = 20 };

static double unit(uint64_t *state)
{
    *state = *state * 6364136223846793005u + 1442695040888963407u;
    return (double)(*state >> 40) / (1 << 24);
}

static void write_anew(const char *path, const struct spl_dataset *dataset, struct spl_chunk *chunks, uint64_t count)
{
    struct spl_dataset_writer *writer;
    size_t bytes;
    uint64_t nodes;
    uint32_t page;
    const struct spl_node *node = spl_dataset_get_nodes(dataset, &nodes);
    const uint32_t *words = spl_dataset_get_page(dataset, 0, &bytes);
    spl_assert(nodes == 1 && !spl_dataset_writer_create(path, &writer, NULL));
    spl_assert(
        !spl_dataset_writer_add_node(writer, words, bytes / sizeof *words - SPL_PAGE_TAIL_WORDS, NULL, 0, &page, NULL));
    spl_assert(!spl_dataset_writer_finish(writer, node, 1, chunks, count, spl_dataset_get_meta(dataset), NULL));
    spl_dataset_writer_destroy(writer);
}

void make_knot_file(const char *path, size_t count)
{
    uint64_t state = 1;
    double side = 0.025 * cbrt((double)count);
    uint64_t chunk_count;
    struct make_splat *splats = calloc(count, sizeof *splats);
    spl_assert(splats);
    for (size_t i = 0; i < count; i++) {
        splats[i] = (struct make_splat){.normal = {0, 0, 1}, .radius = 0.01f, .linear = true};
        for (int a = 0; a < 3; a++)
            splats[i].position[a] = side * unit(&state);
    }
    struct spl_dataset *dataset = make_dataset(splats, count);
    const struct spl_chunk *honest = spl_dataset_get_chunks(dataset, &chunk_count);
    struct spl_chunk *chunks = calloc(chunk_count, sizeof *chunks);
    spl_assert(chunks);
    for (uint64_t i = 0; i < chunk_count; i++) {
        chunks[i] = honest[i];
        if (i % forged_every == 0)
            chunks[i].radius_min = chunks[i].radius_mean = 1000;
    }
    write_anew(path, dataset, chunks, chunk_count);
    free(chunks);
    free(splats);
    spl_dataset_close(dataset);
}
